"""The front as lines in parallel coordinates, with the lines of the policies laid out above the others."""

from nicegui import ui
from nicegui.events import EChartPointClickEventArguments

from jmorl.studio.charts.parallel_chart import parallel_marks, parallel_options
from jmorl.studio.panels.drawing import clicked, draw
from jmorl.studio.panels.panel import Shown
from jmorl.studio.tab import Tab


class ParallelPanel:
    """The chart of all objectives."""

    def __init__(self, tab: Tab):
        self.tab = tab
        self.drawn, self.marked = Shown(), Shown()
        with ui.element("section").classes("panel lines").props('aria-label="Parallel coordinates"'):
            self.lines = ui.echart({}, on_point_click=self._look_at)
            self.marks = ui.echart({}).classes("overlay")

    def show(self) -> None:
        """Draw the lines after a new view; draw the marks over them whenever the selection changes."""
        view, selection = self.tab.view, self.tab.selection
        if self.drawn.is_new(view):
            draw(self.lines, parallel_options(view))
        if self.marked.is_new(view, selection):
            draw(self.marks, parallel_marks(view, selection))

    def _look_at(self, event: EChartPointClickEventArguments) -> None:
        self.tab.look_at(int(clicked(event)[len(self.tab.view.objectives)]))

"""The front as lines in parallel coordinates, with the lines of the policies laid out above the others."""

from nicegui import ui
from nicegui.events import EChartPointClickEventArguments

from jmorl.studio.charts.parallel_chart import parallel_marks, parallel_options
from jmorl.studio.panels.drawing import clicked, draw, mark
from jmorl.studio.panels.panel import Shown
from jmorl.studio.tab import Tab


class ParallelPanel:
    """The chart of all objectives."""

    def __init__(self, tab: Tab):
        self.tab = tab
        self.drawn, self.marked = Shown(), Shown()
        with ui.element("section").classes("panel lines").props('aria-label="Parallel coordinates"'):
            self.chart = ui.echart({}, on_point_click=self._look_at)

    def show(self) -> None:
        """Draw all lines after a new view; draw only those laid out when the selection alone changes."""
        view, selection = self.tab.view, self.tab.selection
        all_new = self.drawn.is_new(view)
        if not self.marked.is_new(selection) and not all_new:
            return
        marks = parallel_marks(view, selection)
        if all_new:
            options = parallel_options(view)
            draw(self.chart, {**options, "series": [*options["series"], *marks]})
        else:
            mark(self.chart, marks)

    def _look_at(self, event: EChartPointClickEventArguments) -> None:
        self.tab.look_at(int(clicked(event)[-1]))

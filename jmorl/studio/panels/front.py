"""The front as points, with the bounds, the policies laid out and the points of E-NAUTILUS."""

from nicegui import ui
from nicegui.events import EChartPointClickEventArguments

from jmorl.studio import texts
from jmorl.studio.charts.front_chart import front_marks, front_options
from jmorl.studio.panels.drawing import clicked, draw
from jmorl.studio.panels.panel import Shown
from jmorl.studio.tab import Tab

# The looks are classes of studio.css. The star and the letters need no legend: what stands beside them explains them.
LEGEND = (
    ("inside", "in the search area"),
    ("outside", "outside"),
    ("ghost", "earlier fronts"),
    ("ring", "choices"),
    ("proposed", "search area that would follow"),
    ("expected", "expected by the model"),
)


class FrontPanel:
    """The chart of two objectives, and the choice of these two where there are more."""

    def __init__(self, tab: Tab):
        self.tab = tab
        self.drawn, self.marked = Shown(), Shown()
        with ui.element("section").classes("panel front").props('aria-label="The front"'):
            if len(tab.view.objectives) > 2:
                self._add_pickers()
            with ui.element("div").classes("chart"):
                self.points = ui.echart({}, on_point_click=self._look_at)
                self.marks = ui.echart({}).classes("overlay")
            # It scrolls where it does not fit: keys must reach it.
            self.outlook = ui.label().classes("outlook").props('aria-live="polite" tabindex=0')
            _add_legend()

    def show(self) -> None:
        """Draw the front after a new view; draw the marks over it, which are few, whenever the selection changes."""
        tab = self.tab
        if self.drawn.is_new(tab.view, tab.axes, tab.dialogue):
            draw(self.points, front_options(tab.view, tab.axes, tab.point_question))
        if self.marked.is_new(tab.view, tab.axes, tab.dialogue, tab.selection):
            draw(self.marks, front_marks(tab.view, tab.selection, tab.axes, tab.point_question))
            self.outlook.set_text(texts.outlook(tab.view, tab.selection))

    def _add_pickers(self) -> None:
        names = {index: objective.label for index, objective in enumerate(self.tab.view.objectives)}
        with ui.element("div").classes("axes"):
            self.pickers = [
                ui.select(names, value=axis, label=direction, on_change=self._pick)
                for axis, direction in zip(self.tab.axes, ("→", "↑"), strict=True)
            ]
            for picker in self.pickers:
                picker.props("dense options-dense borderless")

    def _pick(self) -> None:
        right, up = (int(picker.value) for picker in self.pickers)
        self.tab.turn_axes((right, up))

    def _look_at(self, event: EChartPointClickEventArguments) -> None:
        self.tab.look_at(int(clicked(event)[0]))


def _add_legend() -> None:
    with ui.element("div").classes("legend"):
        for look, text in LEGEND:
            with ui.element("span"):
                ui.element("i").classes(look)
                ui.label(text)

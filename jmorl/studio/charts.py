"""The charts on the page: the front as points and as lines, and the curves of progress."""

from typing import TYPE_CHECKING, Any

from nicegui import ui
from nicegui.events import EChartPointClickEventArguments

from jmorl.studio.curves import curve_options
from jmorl.studio.front_chart import front_marks, front_options
from jmorl.studio.parallel_chart import parallel_marks, parallel_options

if TYPE_CHECKING:
    from jmorl.studio.page import Page


class Charts:
    """Shows what the page shows, as pictures."""

    def __init__(self, page: "Page"):
        self.page = page
        self.axes = (0, 1)  # objectives of the chart of points
        names = {index: objective.label for index, objective in enumerate(page.view.objectives)}
        with ui.element("section").classes("panel front").props('aria-label="The front"'):
            if len(names) > 2:
                with ui.element("div").classes("axes"):
                    for place, title in enumerate(("→", "↑")):
                        picker = ui.select(names, value=place, label=title, on_change=self._picked)
                        picker.props("dense options-dense borderless")
                        setattr(self, f"picker_{place}", picker)
            with ui.element("div").classes("chart"):
                self.front = ui.echart({}, on_point_click=self._point)
                self.front_marks = ui.echart({}).classes("overlay")
            self._add_legend()
        with ui.element("section").classes("panel lines").props('aria-label="Parallel coordinates"'):
            self.parallel = ui.echart({}, on_point_click=self._line)
            self.parallel_marks = ui.echart({}).classes("overlay")

    def add_curves(self) -> None:
        """Put the curves of progress here."""
        self.curves = ui.echart({})

    def show(self) -> None:
        """Everything anew."""
        view = self.page.view
        _draw(self.front, front_options(view, self.axes, self._asked()))
        _draw(self.parallel, parallel_options(view))
        _draw(self.curves, curve_options(view))
        self.show_marks()

    def show_marks(self) -> None:
        """Only what is laid out, and what follows from it: little, however many policies there are."""
        view, selection = self.page.view, self.page.selection
        _draw(self.front_marks, front_marks(view, selection, self.axes, self._asked()))
        _draw(self.parallel_marks, parallel_marks(view, selection))

    def _asked(self) -> Any:
        dialogue = self.page.dialogue
        return dialogue.question if dialogue and not dialogue.chosen else None

    def _picked(self) -> None:
        self.axes = (int(self.picker_0.value), int(self.picker_1.value))  # type: ignore[attr-defined]
        self.show()

    def _point(self, event: EChartPointClickEventArguments) -> None:
        self.page.look_at(int(_numbers(event)[0]))

    def _line(self, event: EChartPointClickEventArguments) -> None:
        self.page.look_at(int(_numbers(event)[-1]))

    def _add_legend(self) -> None:
        """What the marks are; the ring, the star and the letters are explained by what stands beside them."""
        with ui.element("div").classes("legend"):
            for look, text in (
                ("inside", "within the bounds"),
                ("outside", "outside"),
                ("ghost", "earlier fronts"),
                ("ring", "choices"),
                ("proposed", "bounds that would follow"),
                ("expected", "expected by the model"),
            ):
                with ui.element("span"):
                    ui.element("i").classes(look)
                    ui.label(text)


def _draw(chart: ui.echart, options: dict[str, Any]) -> None:
    if chart.options == options:  # painting takes a processor that may be training
        return
    chart.options.clear()
    chart.options.update(options)
    chart.update()


def _numbers(event: EChartPointClickEventArguments) -> Any:
    """What the clicked point or line was given as."""
    return event.data

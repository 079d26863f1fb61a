"""The limits: what each objective must reach, for the table, the chart, and with the next answer for the search."""

import math

from nicegui import ui

from jmorl.display.readings import reading_label
from jmorl.studio import texts
from jmorl.studio.panels.panel import Shown
from jmorl.studio.tab import Tab


class LimitsPanel:
    """A number for each objective, beside the range that the front has in it."""

    def __init__(self, tab: Tab):
        self.tab = tab
        self.shown = Shown()
        self.showing = False  # what the tab holds, which is no input
        with ui.element("div").classes("limits"):
            self.hint = ui.label().classes("explanation")
            with ui.element("div").classes("limit-rows"):
                rows = [self._add_row(index) for index in range(len(tab.view.objectives))]
            self.numbers, self.ranges = zip(*rows, strict=True)
            self.reached = ui.label().classes("explanation")

    def show(self) -> None:
        """Show the limits of the tab, and how many policies reach them."""
        view, selection = self.tab.view, self.tab.selection
        if not self.shown.is_new(view, selection):
            return
        self.hint.set_text(texts.LIMITS_LATER if view.result else texts.LIMITS_HINT)
        limits = selection.limits or (-math.inf,) * len(view.objectives)
        self.showing = True
        for number, objective, least in zip(self.numbers, view.objectives, limits, strict=True):
            number.set_value(float(objective.read.of(least)) if math.isfinite(least) else None)
        self.showing = False
        for label, told in zip(self.ranges, texts.ranges(view), strict=True):
            label.set_text(told)
        self.reached.set_text(texts.limits_reached(view, selection))

    def _add_row(self, index: int) -> tuple[ui.number, ui.label]:
        objective = self.tab.view.objectives[index]
        name = f"{reading_label(objective)}, at {'most' if objective.read.less_is_better else 'least'}"
        ui.label(name)
        number = ui.number(on_change=lambda event: self._set(index, event.value)).classes("limit")
        number.props('dense outlined clearable debounce=400 placeholder="anything"').props["aria-label"] = name
        return number, ui.label().classes("point-side")

    def _set(self, index: int, value: float | None) -> None:
        if not self.showing:
            objective = self.tab.view.objectives[index]
            self.tab.limit(index, None if value is None else objective.read.to_return(value))

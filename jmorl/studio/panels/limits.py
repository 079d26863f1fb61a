"""The limits: what each objective must reach, for the table, the chart, and with the next answer for the search."""

import math

from nicegui import ui

from jmorl.display.readings import reading_label
from jmorl.studio import texts, words
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
        later = view.result or self.tab.access.watching
        self.hint.set_text(words.LIMITS_LATER if later else words.LIMITS_HINT)
        limits = selection.limits or (-math.inf,) * len(view.objectives)
        self.showing = True
        for number, objective, least in zip(self.numbers, view.objectives, limits, strict=True):
            now = _number(number.value)
            wanted = float(objective.read.of(least)) if math.isfinite(least) else None
            if now != wanted:  # what somebody has typed stays as it is
                number.set_value("" if wanted is None else f"{wanted:g}")
        self.showing = False
        for label, told in zip(self.ranges, texts.ranges(view), strict=True):
            label.set_text(told)
        self.reached.set_text(texts.limits_reached(view, selection))

    def _add_row(self, index: int) -> tuple[ui.input, ui.label]:
        objective = self.tab.view.objectives[index]
        name = f"{reading_label(objective)}, at {'most' if objective.read.less_is_better else 'least'}"
        ui.label(name)
        number = ui.input(
            on_change=lambda event: self._set(index, event.value),
            validation=lambda text: words.NO_NUMBER if math.isnan(_number(text) or 0.0) else None,
        ).classes("limit")
        number.props(
            'dense outlined clearable hide-bottom-space debounce=400 inputmode=decimal placeholder="anything"'
        ).props["aria-label"] = name
        return number, ui.label().classes("point-side")

    def _set(self, index: int, text: str | None) -> None:
        value = _number(text)
        if not self.showing and (value is None or not math.isnan(value)):
            objective = self.tab.view.objectives[index]
            self.tab.limit(index, None if value is None else objective.read.to_return(value))


def _number(text: str | None) -> float | None:
    """Return the number that somebody has written, with a point or a comma; None for nothing, NaN for no number."""
    written = (text or "").strip().replace("\N{MINUS SIGN}", "-").replace(",", ".")
    try:
        value = float(written) if written else None
    except ValueError:
        return math.nan
    return value if value is None or math.isfinite(value) else math.nan

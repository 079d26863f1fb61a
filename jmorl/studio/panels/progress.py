"""The progress of the search, generation by generation."""

from nicegui import ui

from jmorl.studio import words
from jmorl.studio.charts.curves import curve_options
from jmorl.studio.panels.drawing import draw
from jmorl.studio.panels.panel import Shown
from jmorl.studio.tab import Tab


class ProgressPanel:
    """The curves of progress."""

    def __init__(self, tab: Tab):
        self.tab = tab
        self.drawn = Shown()
        with ui.element("div").classes("curves"):
            ui.label(words.PROGRESS_HINT).classes("explanation")
            self.curves = ui.echart({})

    def show(self) -> None:
        """Draw the curves after a new view."""
        if self.drawn.is_new(self.tab.view):
            draw(self.curves, curve_options(self.tab.view))

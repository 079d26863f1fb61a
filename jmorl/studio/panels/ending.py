"""The dialog that asks whether the run shall end, and with which policy as its result."""

from nicegui import ui

from jmorl.studio import texts, words
from jmorl.studio.panels.panel import Shown
from jmorl.studio.tab import Ending, Tab


class EndingDialog:
    """A policy or two to end with, by letter and scores, and the way back. It does not outlive its question."""

    def __init__(self, tab: Tab):
        self.tab = tab
        self.shown = Shown()
        with ui.dialog().props('aria-label="End the run?"') as self.dialog, ui.card():
            ui.label(words.END_TITLE).classes("title")
            self.text = ui.label().classes("explanation")
            self.buttons = ui.element("div").classes("endings")
            ui.button(words.NOT_YET, on_click=self.dialog.close).props("flat no-caps")
        self.dialog.on_value_change(self._closed)

    def show(self) -> None:
        """Open for an ending that is to be confirmed; close when there is none."""
        ending = self.tab.ending
        if not self.shown.is_new(ending):
            return
        self.tab.covered = ending is not None
        if ending is None:
            self.dialog.close()
            return
        self._offer(ending)
        self.dialog.open()

    def _offer(self, ending: Ending) -> None:
        view, selection = self.tab.view, self.tab.selection
        self.text.set_text(words.END_EXPLANATION if ending.question else f"{words.END_LATER} {words.END_EXPLANATION}")
        self.buttons.clear()
        with self.buttons:
            for policy in filter(None, map(view.policy, ending.policies)):
                name = texts.end_with(view, selection, policy)
                ui.button(name, on_click=lambda policy=policy: self.tab.end(policy.id)).props("no-caps color=primary")

    def _closed(self) -> None:
        if not self.dialog.value and self.tab.ending:
            self.tab.do_not_end()

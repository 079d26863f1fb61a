"""The dialog in which somebody gives a policy, or a run of the history, a name and a note."""

from nicegui import ui

from jmorl.studio import texts, words
from jmorl.studio.panels.panel import Shown
from jmorl.studio.tab import Tab


class NoteDialog:
    """A line and a few lines of text, and the way to keep them or not. What cannot be kept stays written."""

    def __init__(self, tab: Tab):
        self.tab = tab
        self.shown = Shown()
        dialog = ui.dialog().props('aria-label="Name and note"')
        with dialog.bind_value_to(tab, "covered") as self.dialog, ui.card().classes("note-card"):
            self.subject = ui.label().classes("title")
            self.name = ui.input(words.NAME).props("outlined dense counter autofocus").on("keydown.enter", self._save)
            self.text = ui.textarea(words.NOTE).props("outlined dense counter")
            ui.label(words.NOTE_HINT).classes("explanation")
            with ui.element("div").classes("buttons"):
                ui.button(words.SAVE, on_click=self._save).props("no-caps color=primary")
                ui.button(words.CANCEL, on_click=tab.stop_editing).props("flat no-caps")
        self.dialog.on_value_change(self._closed)

    def show(self) -> None:
        """Open for what somebody begins to write; close when it is kept, or given up."""
        editing = self.tab.editing
        if not self.shown.is_new(editing):
            return
        if editing:
            self.subject.set_text(texts.subject(editing.subject))
            self.name.set_value(editing.before.name)
            self.text.set_value(editing.before.text)
        self.dialog.set_value(editing is not None)

    async def _save(self) -> None:
        await self.tab.save_note(self.name.value or "", self.text.value or "")

    def _closed(self) -> None:
        if not self.dialog.value and self.tab.editing:
            self.tab.stop_editing()

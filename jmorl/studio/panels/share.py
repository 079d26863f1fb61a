"""The address at which others can watch, and what they can do there."""

from nicegui import ui
from nicegui.events import GenericEventArguments

from jmorl.studio import words
from jmorl.studio.tab import Tab

# The clipboard of newer browsers is there for encrypted pages alone.
COPY = """() => {
  document.querySelector(".share input").select();
  emit(document.execCommand("copy"));
}"""


class Share:
    """The button that opens a dialog with the address."""

    def __init__(self, tab: Tab):
        self.tab = tab
        dialog = ui.dialog().props(f'aria-label="{words.SHARE_TITLE}"')
        with dialog.bind_value_to(tab, "covered") as self.dialog, ui.card().classes("share"):
            ui.label(words.SHARE_TITLE).classes("title")
            for text in words.SHARE_RIGHTS:
                ui.label(text)
            ui.label(words.SHARE_GUARDED if tab.access.guarded else words.SHARE_OPEN)
            ui.input(words.SHARE_LINK, value=tab.access.link).props("outlined dense readonly")
            with ui.element("div").classes("buttons"):
                copy = ui.button(words.COPY).props("no-caps color=primary")
                copy.on("click", self._tell, js_handler=COPY)
                ui.button("Close", on_click=self.dialog.close).props("flat no-caps")
        ui.button(words.SHARE, on_click=self.dialog.open).props("flat dense no-caps size=sm")

    def _tell(self, event: GenericEventArguments) -> None:
        copied = bool(event.args)
        self.tab.tell(words.COPIED if copied else words.COPY_YOURSELF, "hint" if copied else "warning")

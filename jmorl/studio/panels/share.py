"""The address at which others can watch, and what they can do there."""

from nicegui import ui
from nicegui.events import GenericEventArguments

from jmorl.studio import texts
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
        dialog = ui.dialog().props(f'aria-label="{texts.SHARE_TITLE}"')
        with dialog.bind_value_to(tab, "covered") as self.dialog, ui.card().classes("share"):
            ui.label(texts.SHARE_TITLE).classes("title")
            for text in texts.SHARE_RIGHTS:
                ui.label(text)
            ui.label(texts.SHARE_GUARDED if tab.access.guarded else texts.SHARE_OPEN)
            ui.input(texts.SHARE_LINK, value=tab.access.link).props("outlined dense readonly")
            with ui.element("div").classes("buttons"):
                copy = ui.button(texts.COPY).props("no-caps color=primary")
                copy.on("click", self._tell, js_handler=COPY)
                ui.button("Close", on_click=self.dialog.close).props("flat no-caps")
        ui.button(texts.SHARE, on_click=self.dialog.open).props("flat dense no-caps size=sm")

    def _tell(self, event: GenericEventArguments) -> None:
        copied = bool(event.args)
        self.tab.tell(texts.COPIED if copied else texts.COPY_YOURSELF, "hint" if copied else "warning")

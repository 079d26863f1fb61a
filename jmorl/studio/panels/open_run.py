"""The line that says which run is open, and leads to it."""

from nicegui import ui

from jmorl.studio import home_texts, words
from jmorl.studio.home_tab import HomeTab


class OpenRun:
    """What the open run is doing, or what opening another one waits for; nothing where no run is open."""

    def __init__(self, tab: HomeTab):
        self.tab = tab
        with ui.element("section").classes("bar open-run").props('aria-label="Open run"') as self.bar:
            self.text = ui.label().classes("heading").props('role="status"')
            self.way = ui.link(words.GO_TO_RUN, "/")

    def show(self) -> None:
        """Say what is going on now."""
        session = self.tab.session
        view = session.view if session.is_open else None
        text = home_texts.open_run(view, session.opening, session.clock())
        self.text.set_text(text)
        self.bar.set_visibility(bool(text))
        self.way.set_visibility(view is not None and not session.opening)

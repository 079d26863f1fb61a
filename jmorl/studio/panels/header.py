"""The line at the top: the run, its phase, and the share of its budget that is used."""

from nicegui import ui

from jmorl.studio import texts, words
from jmorl.studio.home import printable
from jmorl.studio.panels.panel import Shown
from jmorl.studio.tab import Tab

TICK_SECONDS = 1.0  # between two times that are shown


class Header:
    """The name of the run, its phase, its budget and its speed; in the browser's own tab, whether a question waits."""

    def __init__(self, tab: Tab):
        self.tab = tab
        self.shown, self.titled = Shown(), Shown()
        self.next_tick = 0.0  # on the session's clock
        with ui.element("h1").classes("brand"):
            ui.label("jmorl studio")
        ui.link(words.ALL_RUNS, "/runs").classes("all-runs")
        self.run_name = ui.label().classes("run-name")
        self.phase = ui.label().classes("phase").props('role="status"')
        with ui.element("div").classes("meter").props('role="progressbar" aria-label="Budget used"'):
            self.meter = ui.element("div")
        self.facts = ui.label().classes("facts")
        if tab.access.watching:
            ui.label(words.WATCHING).classes("watching").tooltip(words.WATCHING_HINT)

    def show(self) -> None:
        """Show a new view at once, and otherwise, once a second, what changes with time alone."""
        view, session = self.tab.view, self.tab.session
        now = session.clock()
        if not self.shown.is_new(view) and now < self.next_tick:
            return
        self.next_tick = now + TICK_SECONDS
        title = texts.title(view, self.tab.access.watching)
        if self.titled.is_new(title):
            ui.page_title(title)
        self.run_name.set_text(f"{printable(view.noted.run.named(view.path.name))} · {view.config.env}")
        self.phase.set_text(texts.phase(view, now, session.leaving))
        self.facts.set_text(texts.facts(view, now))
        self.meter.style(f"width: {100 * texts.share_done(view, now):.1f}%")

"""The page: its panels, where they stand, and when they are shown."""

from collections.abc import Callable, MutableMapping
from typing import Any

from nicegui import ui

from jmorl.studio import words
from jmorl.studio.access import STEERS, Access, Tone
from jmorl.studio.look import KINDS, dress
from jmorl.studio.panels.between import BetweenPanel
from jmorl.studio.panels.call import Call
from jmorl.studio.panels.cards import Cards
from jmorl.studio.panels.comparison import ComparisonDialog
from jmorl.studio.panels.ending import EndingDialog
from jmorl.studio.panels.front import FrontPanel
from jmorl.studio.panels.header import Header
from jmorl.studio.panels.history import HistoryPanel
from jmorl.studio.panels.introduction import Introduction
from jmorl.studio.panels.keys import Keys
from jmorl.studio.panels.limits import LimitsPanel
from jmorl.studio.panels.lost import Lost
from jmorl.studio.panels.navigation import NavigationPanel
from jmorl.studio.panels.note_dialog import NoteDialog
from jmorl.studio.panels.panel import Panel
from jmorl.studio.panels.parallel import ParallelPanel
from jmorl.studio.panels.policy_table import PolicyTable
from jmorl.studio.panels.progress import ProgressPanel
from jmorl.studio.panels.question_bar import QuestionBar
from jmorl.studio.panels.share import Share
from jmorl.studio.session import Session
from jmorl.studio.tab import Tab

REFRESH_SECONDS = 0.1
SIDE: dict[str, Callable[[Tab], Panel]] = {
    words.POLICIES: PolicyTable,
    words.PROGRESS: ProgressPanel,
    words.HISTORY: HistoryPanel,
    words.LIMITS: LimitsPanel,
    words.NAVIGATION: NavigationPanel,
    words.BETWEEN: BetweenPanel,
}


class Page:
    """The panels of one browser tab, and the messages over them."""

    def __init__(self, session: Session, kept: MutableMapping[str, Any] | None = None, access: Access = STEERS):
        self.tab = tab = Tab(session, self._show, self._tell, kept, self._renew, access)
        dress()
        self.panels: list[Panel] = [Lost(lambda: tab.view.path)]
        with ui.element("div").classes("studio") as self.root:
            with ui.element("header").classes("bar"):
                self.panels.append(Header(tab))
                with ui.element("div").classes("tools"):
                    if not access.watching:
                        self.panels.append(Call(tab))
                    if access.link:
                        Share(tab)
                    Keys(tab)
            with ui.element("div").classes("top"):
                self.panels += [Introduction(tab), QuestionBar(tab), EndingDialog(tab)]
                self.panels += [NoteDialog(tab), ComparisonDialog(tab)]
            with ui.element("div").classes("charts"):
                self.panels += [FrontPanel(tab), ParallelPanel(tab)]
            with ui.element("div").classes("side"):
                self._add_side()
                self.panels.append(Cards(tab))
        self._show()
        self.timer = ui.timer(REFRESH_SECONDS, tab.follow)

    def _add_side(self) -> None:
        """Add the panels of which one is open. All stay mounted, so that none has to be filled anew when it opens."""
        with ui.element("section").classes("panel tabs"):
            with ui.tabs(on_change=lambda event: self.tab.turn_to(event.value)) as self.titles:
                for title in SIDE:
                    ui.tab(title)
            self.titles.props("dense no-caps align=left")
            with ui.tab_panels(self.titles, value=self.tab.side, animated=False) as panels:
                for title, panel in SIDE.items():
                    with ui.tab_panel(title):
                        self.panels.append(panel(self.tab))
            panels.props("keep-alive").classes("tab-panels")

    def _show(self) -> None:
        self.titles.set_value(self.tab.side)
        for panel in self.panels:
            panel.show()

    def _renew(self) -> None:
        self.timer.deactivate()
        with self.root:
            ui.navigate.reload()

    def _tell(self, text: str, tone: Tone) -> None:
        with self.root:  # the button that was pressed may be gone
            ui.notify(text, type=KINDS[tone], multi_line=tone == "failure")

"""The home page: the runs below a folder, the one that is open, and the form of a new one."""

import time
from collections.abc import MutableMapping
from typing import Any

from nicegui import ui

from jmorl.studio import words
from jmorl.studio.access import STEERS, Access, Tone
from jmorl.studio.home import Home, printable
from jmorl.studio.home_tab import HomeTab
from jmorl.studio.look import KINDS, dress
from jmorl.studio.panels.lost import Lost
from jmorl.studio.panels.open_run import OpenRun
from jmorl.studio.panels.panel import Panel
from jmorl.studio.panels.run_form import RunForm
from jmorl.studio.panels.run_list import RunList
from jmorl.studio.session import Session

REFRESH_SECONDS = 0.5  # of what is going on
READ_SECONDS = 2.0  # between two times that the folder is read
REST = 4  # times as long as reading took, it is not read again: training has the processors


class HomePage:
    """The panels of one browser tab on the home page, and the messages over them."""

    def __init__(
        self, session: Session, home: Home, kept: MutableMapping[str, Any] | None = None, access: Access = STEERS
    ):
        self.tab = tab = HomeTab(session, home, self._show, self._tell, self._go, kept, access)
        dress()
        self.panels: list[Panel] = [Lost(lambda: home.folder)]
        with ui.element("div").classes("home") as self.root:
            with ui.element("header").classes("bar"):
                with ui.element("h1").classes("brand"):
                    ui.label("jmorl studio")
                ui.label(printable(home.folder)).classes("run-name")
                if access.watching:
                    ui.label(words.WATCHING).classes("watching").tooltip(words.WATCHING_HINT)
                else:
                    ui.link(words.NEW_RUN, "#new-run").classes("to-form")
            self.panels.append(OpenRun(tab))
            with ui.element("div").classes("home-main"):
                self.panels.append(RunList(tab))
                if not access.watching:
                    self.panels.append(RunForm(tab))
        self._show()
        ui.timer(REFRESH_SECONDS, self._show)
        self.timer = ui.timer(READ_SECONDS, self._read)

    async def _read(self) -> None:
        started = time.monotonic()
        await self.tab.follow()
        self.timer.interval = max(READ_SECONDS, REST * (time.monotonic() - started))

    def _show(self) -> None:
        if not self.root.is_deleted:  # the page may have been left while a command was at work
            for panel in self.panels:
                panel.show()

    def _tell(self, text: str, tone: Tone) -> None:
        if not self.root.is_deleted:
            with self.root:
                ui.notify(text, type=KINDS[tone], multi_line=tone == "failure")

    def _go(self) -> None:
        if not self.root.is_deleted:
            with self.root:
                ui.navigate.to("/")

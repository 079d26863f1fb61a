"""Showing a run while it lasts."""

import sys
from typing import Literal

from rich.console import Console

from envs.core import Objective
from jmorl.config import Config
from jmorl.report.live import LiveView
from jmorl.report.watchers import Json, Lines, Quiet, Watcher

Kind = Literal["auto", "live", "lines", "json", "quiet"]


def watcher(kind: Kind, config: Config, objectives: tuple[Objective, ...], console: Console) -> Watcher:
    """Who shows the events of a run: `with watcher(...) as watching: watching.show(event)`.

    "auto" is a live view on a terminal, and lines elsewhere. With a person to be asked on this terminal a live view
    becomes lines, too: it would draw over the question. JSON goes to standard output, whatever the console is.
    """
    if kind == "auto":
        kind = "live" if console.is_terminal else "lines"
    if kind == "live" and config.user == "terminal":
        kind = "lines"
    match kind:
        case "live":
            return LiveView(config, objectives, console)
        case "lines":
            return Lines(config, objectives, console)
        case "json":
            return Json(config, sys.stdout)
        case "quiet":
            return Quiet()
    raise AssertionError(kind)

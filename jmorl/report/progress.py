"""Showing a run while it lasts."""

import sys

from envs.core import Objective
from jmorl.config import Config
from jmorl.display.console import PlainConsole
from jmorl.report.live import LiveView
from jmorl.report.watchers import Json, Lines, Quiet, Watcher


def kind_of_progress(json: bool, quiet: bool, console: PlainConsole) -> str:
    """Return how a run is shown, as `watcher` takes it. A terminal that cannot move its cursor gets lines."""
    if json or quiet:
        return "json" if json else "quiet"
    return "live" if console.is_terminal and not console.is_dumb_terminal else "lines"


def watcher(kind: str, config: Config, objectives: tuple[Objective, ...], console: PlainConsole) -> Watcher:
    """Return who shows the events of a run, each given to its `show`, within a `with` block.

    "live" redraws a view of the run on a terminal. "lines" is one for each event. "json" goes to standard output,
    whatever the console is. "quiet" shows nothing. Raises ValueError for another kind.
    """
    match kind:
        case "live":
            return LiveView(config, objectives, console)
        case "lines":
            return Lines(config, objectives, console)
        case "json":
            return Json(config, sys.stdout)
        case "quiet":
            return Quiet()
    raise ValueError(f"unknown kind of progress {kind!r}; known: live, lines, json, quiet")

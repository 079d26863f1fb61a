"""The list of runs on the home page."""

from typing import Any

from nicegui.element import Element

from jmorl.studio import home_texts, words
from jmorl.studio.home import ListedRun
from jmorl.studio.home_tab import HomeTab
from jmorl.studio.panels.panel import Shown


class Rows(Element, component="run_list.js"):
    """The rows, in the browser: found by words, gone through by keys."""


class RunList:
    """The runs below the folder, a row each, which opens its run."""

    def __init__(self, tab: HomeTab):
        self.tab = tab
        self.shown = Shown()
        self.rows = Rows()
        self.rows.props["columns"] = words.RUNS_COLUMNS
        self.rows.props["rows"] = []
        self.rows.props["texts"] = {"filter": words.FILTER, "none": words.NO_MATCH}
        self.rows.props["empty"] = words.READING
        self.rows.props["opens"] = not tab.access.watching
        self.rows.on("open", lambda event: tab.open(str(event.args)))

    def show(self) -> None:
        """Send the rows when something in them has changed."""
        runs, open_folder = self.tab.runs, self.tab.session.open_folder
        if runs is not None and self.shown.is_new(runs, str(open_folder)):
            self.rows.props["rows"] = [_row(run, run.path == open_folder) for run in runs]
            self.rows.props["empty"] = words.NO_RUNS
            self.rows.update()


def _row(run: ListedRun, is_open: bool) -> dict[str, Any]:
    """Return what a row shows: for each column but the last a text, and a smaller one below it."""
    facts = run.facts
    cells = [
        (run.name, home_texts.branch_of(facts.origin) if facts else ""),
        (facts.env, home_texts.decider(facts)) if facts else ("", ""),
        (home_texts.progress(facts), home_texts.budget(facts)) if facts else ("", ""),
        (
            words.OPEN_HERE if is_open else words.STATES[run.state],
            run.why or (home_texts.result(facts) if facts else ""),
        ),
    ]
    return {"name": run.name, "state": "open" if is_open else run.state, "cells": cells, "written": run.written}

"""The history on the page: a run, its branches, every choice, and the way back."""

from collections.abc import Sequence

from nicegui import ui

from jmorl.decision.records import DecisionRecord
from jmorl.display.readings import values_in_words
from jmorl.display.text import plural
from jmorl.studio import texts, words
from jmorl.studio.history import Branch
from jmorl.studio.home import printable
from jmorl.studio.panels.panel import Shown
from jmorl.studio.tab import Tab
from jmorl.studio.view import View

LISTED = 20  # policies that a question showed, at most


class HistoryPanel:
    """A tree: the run that came first, under each run the branches that leave it."""

    def __init__(self, tab: Tab):
        self.tab = tab
        self.seen = Shown()
        self.content: tuple[tuple[Branch, ...], str, str] | None = None  # shown: branches, open run, open question
        with ui.element("div").classes("history"):
            self.compare = ui.button(words.COMPARE, on_click=tab.compare).props("no-caps dense outline size=sm")
            self.compare.classes("compare")
            self.tree = ui.element("div").props('role="tree" aria-label="History"')

    def show(self) -> None:
        """Read the history after a new view; replace the tree only if it has changed: somebody may press a button."""
        view = self.tab.view
        if not self.seen.is_new(view):
            return
        content = self.tab.session.history(), view.run, _open_question(view)
        if content == self.content:
            return
        self.content = content
        self.compare.set_visibility(len(content[0]) > 1)
        self.tree.clear()
        with self.tree:
            for branch in content[0]:
                self._add_branch(branch)

    def _add_branch(self, branch: Branch) -> None:
        view = self.tab.view
        is_open = branch.run == view.run
        item = ui.element("div").classes("branch" + (" open" if is_open else "")).props('role="treeitem"')
        with item.style(f"margin-left: {18 * branch.depth}px"):
            with ui.element("div").classes("branch-head"):
                ui.label(printable(branch.title)).classes("branch-name")
                if not self.tab.access.watching:
                    edit = ui.button(icon="edit", on_click=lambda: self.tab.edit_run(branch))
                    edit.props("flat dense round size=xs").props["aria-label"] = (
                        f"name and note of {printable(branch.name)}"
                    )
                ui.label(_state(branch, is_open)).classes("branch-state")
                if not is_open and not self.tab.access.watching:
                    open_it = ui.button(words.OPEN, on_click=lambda: self.tab.switch(branch.run))
                    open_it.props("no-caps dense outline size=sm")
            if branch.noted.run.text or branch.noted.problem:
                ui.label(branch.noted.run.text or branch.noted.problem).classes("note")
            for step in branch.steps:
                self._add_step(branch, step)
            if is_open and view.question:
                with ui.element("div").classes("step"):
                    ui.label(f"{_open_question(view)}: open").classes("open-step")

    def _add_step(self, branch: Branch, step: DecisionRecord) -> None:
        more = f", then {step.generations} rounds" if step.generations > 1 else ", and stop" if step.stop else ""
        policy = branch.noted.policy(step.policy).named(f"policy {step.policy}")
        text = f"{_title(step.purpose, step.generation)}: {policy} ({self._values(step.values)})"
        shown = [f"policy {each.policy}: {self._values(each.values)}" for each in step.shown[:LISTED]]
        if len(step.shown) > LISTED:
            shown.append(f"and {len(step.shown) - LISTED} more")
        with ui.element("div").classes("step"):
            by_whom = ", chosen for you" if step.stand_in else ""
            with ui.label(f"{text} of {plural(len(step.shown), 'policy')}{more}{by_whom}"):
                if shown:
                    ui.tooltip("\n".join(shown)).classes("shown")
            self._add_way_back(branch, step.generation)
        for generation in range(step.generation + 1, step.generation + step.generations):
            if generation - 1 in branch.checkpoints:
                with ui.element("div").classes("step"):
                    ui.label(f"Round {generation}: not asked").classes("branch-state")
                    self._add_way_back(branch, generation)

    def _add_way_back(self, branch: Branch, generation: int) -> None:
        if generation - 1 in branch.checkpoints and not self.tab.access.watching:
            back = ui.button(words.CHOOSE_OTHERWISE, on_click=lambda: self.tab.step_back(branch.run, generation))
            back.props("no-caps dense flat size=sm")

    def _values(self, values: Sequence[float]) -> str:
        view = self.tab.view
        return texts.minus(values_in_words(values, texts.writers_of(view)))


def _open_question(view: View) -> str:
    return _title(view.question.purpose, view.question.generation) if view.question else ""


def _title(purpose: str, generation: int) -> str:
    return "The end" if purpose == "final" else f"Round {generation}"


def _state(branch: Branch, is_open: bool) -> str:
    parts = [f"leaves after round {branch.leaves_after}"] if branch.parent else []
    if is_open:
        parts.append("open")
    parts.append("ended" if branch.finished else "not ended")
    return ", ".join(parts)

"""The history on the page: a run, its branches, every choice, and the way back."""

from typing import TYPE_CHECKING

from nicegui import ui

from jmorl.decision.records import DecisionRecord
from jmorl.display.text import plural, values_in_words
from jmorl.studio import words
from jmorl.studio.history import Branch

if TYPE_CHECKING:
    from jmorl.studio.page import Page


class HistoryPanel:
    """A tree: the run that came first, under each run the branches that leave it."""

    def __init__(self, page: "Page"):
        self.page = page
        self.tree = ui.element("div").classes("history").props('role="tree" aria-label="History"')

    def show(self) -> None:
        self.tree.clear()
        with self.tree:
            for branch in self.page.session.history():
                self._add_branch(branch)

    def _add_branch(self, branch: Branch) -> None:
        view = self.page.view
        is_open = branch.run == view.run
        item = ui.element("div").classes("branch" + (" open" if is_open else "")).props('role="treeitem"')
        with item.style(f"margin-left: {18 * branch.depth}px"):
            with ui.element("div").classes("branch-head"):
                ui.label(branch.name).classes("branch-name")
                ui.label(_state(branch, is_open)).classes("branch-state")
                if not is_open:
                    open_it = ui.button("Open", on_click=lambda: self.page.switch(branch.run))
                    open_it.props("no-caps dense outline size=sm")
            for step in branch.steps:
                self._add_step(branch, step)
            if is_open and view.question:
                with ui.element("div").classes("step"):
                    ui.label(f"{_title(view.question.purpose, view.question.generation)}: open").classes("open-step")

    def _add_step(self, branch: Branch, step: DecisionRecord) -> None:
        view = self.page.view
        values = words.minus(values_in_words(step.values, view.objectives, words.formats_of(view)))
        with ui.element("div").classes("step"):
            chosen = f"{_title(step.purpose, step.generation)}: policy {step.policy} ({values})"
            more = (
                f", then {step.generations} generations" if step.generations > 1 else ", and stop" if step.stop else ""
            )
            ui.label(f"{chosen} of {plural(len(step.shown), 'policy')}{more}")
            if step.generation - 1 in branch.checkpoints:
                back = ui.button("Choose otherwise", on_click=lambda: self.page.step_back(branch.run, step.generation))
                back.props("no-caps dense flat size=sm")


def _title(purpose: str, generation: int) -> str:
    return "The end" if purpose == "final" else f"Generation {generation}"


def _state(branch: Branch, is_open: bool) -> str:
    parts = [f"leaves after generation {branch.leaves_after}"] if branch.parent else []
    if is_open:
        parts.append("open")
    parts.append("ended" if branch.finished else "not ended")
    return ", ".join(parts)

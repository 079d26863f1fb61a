"""The question, and the answers that need no policy to be looked at."""

from typing import TYPE_CHECKING

from nicegui import ui

from jmorl.decision.protocol import Answer, Question
from jmorl.studio import texts

if TYPE_CHECKING:
    from jmorl.studio.page import Page


class QuestionBar:
    """What is asked; more of an objective, keep the last choice, stop; at the end, the result."""

    def __init__(self, page: "Page"):
        self.page = page
        self.question: Question | None = None  # that is shown
        self.ending: Answer | None = None  # to it, if it is confirmed
        self.generations = 1  # to go on for before the next question
        self.shown: tuple[object, ...] = ()  # what the buttons are for
        with ui.element("section").classes("bar question").props('aria-label="The question"'):
            self.heading = ui.label().classes("heading").props('role="status" aria-live="polite"')
            self.buttons = ui.element("div").classes("buttons")
        with ui.dialog() as self.stopping, ui.card():
            self.stop_text = ui.label()
            with ui.row():
                ui.button("End the run", on_click=self._stop).props("no-caps color=primary")
                ui.button("Go on", on_click=self.stopping.close).props("flat no-caps")

    def show(self) -> None:
        view, selection = self.page.view, self.page.selection
        self.heading.set_text(texts.heading(view, selection))
        if view.question is not self.question:
            self.question = view.question
            self.generations = 1  # of silence, anew for each question
            self.stopping.close()
        shown = id(view.question), id(view.result), view.timeline is None, bool(view.front), selection.more_of, view.run
        if shown == self.shown:  # nobody shall lose a button that they are about to press
            return
        self.shown = shown
        self.buttons.clear()
        with self.buttons:
            if view.front:
                self._add_more()
            if view.question:
                self._add_answers()
            elif view.result:
                self._add_result()
            elif view.timeline is None:
                ui.button("Go on with this run", on_click=self._go_on).props("no-caps dense color=primary")

    def keep(self) -> None:
        """Choose what was chosen last."""
        if self.page.view.previous:
            self.page.choose(self.page.view.previous.id)

    def _add_more(self) -> None:
        ui.label("Better in")
        for index, objective in enumerate(self.page.view.objectives):
            pressed = self.page.selection.more_of == index
            button = ui.button(objective.label, on_click=lambda index=index: self.page.more_of(index))
            button.props(f"no-caps dense {'unelevated' if pressed else 'outline'} aria-pressed={str(pressed).lower()}")

    def _add_answers(self) -> None:
        question, previous = self.page.view.question, self.page.view.previous
        assert question
        if previous and self.page.view.choosable(previous.id):
            keep = ui.button(f"Keep policy {previous.id}", on_click=self.keep).props("no-caps dense outline")
            keep.tooltip("your last choice")
        if question.purpose == "steer":
            ui.label("then go on for")
            number = ui.number(value=self.generations, min=1, max=99, format="%d", on_change=self._count)
            number.props('dense outlined aria-label="generations before the next question"').classes("count")
            ui.label("gen.").tooltip("generations before the next question")
            ui.button("Stop here", on_click=self._ask_to_stop).props("no-caps dense outline color=negative")

    def _add_result(self) -> None:
        view = self.page.view
        assert view.result
        address = f"/policies/{view.run}/{view.result.id}.npz"
        save = ui.button("Save the policy file", on_click=lambda: ui.download(address))
        save.props("no-caps dense color=primary")
        ui.button("How it came about", on_click=lambda: self.page.tabs.set_value("History")).props(
            "no-caps dense outline"
        )

    def _count(self, event: object) -> None:
        value = getattr(event, "value", None)
        self.generations = max(int(value), 1) if value else 1

    def _candidate(self) -> int | None:
        """The policy that a stop would end with."""
        previous = self.page.view.previous
        return self.page.selection.focus if self.page.selection.focus is not None else previous.id if previous else None

    def _ask_to_stop(self) -> None:
        policy = self._candidate()
        if policy is None or not self.page.view.choosable(policy):
            ui.notify("Look at the policy first that shall be the result, one that can be chosen.")
            return
        self.ending = Answer(policy, stop=True)
        self.stop_text.set_text(f"End the run here, with policy {policy} as its result?")
        self.stopping.open()

    def _stop(self) -> None:
        """Just what was confirmed, wherever the focus is now; the dialog does not outlive its question."""
        self.stopping.close()
        if self.question and self.ending:
            self.page.answer(self.question, self.ending)

    async def _go_on(self) -> None:
        await self.page.switch(self.page.view.run)

"""The question, and the answers that need no policy to be looked at."""

from nicegui import ui
from nicegui.events import ValueChangeEventArguments

from jmorl.decision.answers import Answer
from jmorl.decision.protocol import Question
from jmorl.studio import texts
from jmorl.studio.panels.panel import Shown
from jmorl.studio.tab import Tab


class QuestionBar:
    """The question, with buttons to see more of an objective, keep the last choice, or stop; at the end, the result."""

    def __init__(self, tab: Tab):
        self.tab = tab
        self.question: Question | None = None  # the one shown
        self.ending: Answer | None = None  # its answer that ends the run, if that is confirmed
        self.asked, self.offered = Shown(), Shown()
        with ui.element("section").classes("bar question").props('aria-label="The question"'):
            self.heading = ui.label().classes("heading").props('role="status" aria-live="polite"')
            self.buttons = ui.element("div").classes("buttons")
        with ui.dialog().bind_value_to(tab, "covered") as self.stopping, ui.card():
            self.stop_text = ui.label()
            with ui.row():
                ui.button("End the run", on_click=self._stop).props("no-caps color=primary")
                ui.button("Go on", on_click=self.stopping.close).props("flat no-caps")

    def show(self) -> None:
        """Show what is asked; replace the buttons only where others are due: somebody may be about to press one."""
        view, selection = self.tab.view, self.tab.selection
        if not self.asked.is_new(view, selection):
            return
        self.heading.set_text(texts.heading(view, selection))
        if view.question is not self.question:
            self.question = view.question
            self.stopping.close()
        at_rest, has_front = view.timeline is None, bool(view.front)
        if self.offered.is_new(view.run, view.question, view.result, at_rest, has_front, selection.more_of):
            self._add_buttons()

    def _add_buttons(self) -> None:
        view = self.tab.view
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

    def _add_more(self) -> None:
        ui.label("Better in")
        for index, objective in enumerate(self.tab.view.objectives):
            pressed = self.tab.selection.more_of == index
            button = ui.button(objective.label, on_click=lambda index=index: self.tab.more_of(index))
            button.props(f"no-caps dense {'unelevated' if pressed else 'outline'} aria-pressed={str(pressed).lower()}")

    def _add_answers(self) -> None:
        question, previous = self.tab.view.question, self.tab.view.previous
        assert question
        if previous and self.tab.view.choosable(previous.id):
            keep = ui.button(f"Keep policy {previous.id}", on_click=self.tab.keep).props("no-caps dense outline")
            keep.tooltip("your last choice")
        if question.purpose == "steer":
            ui.label("then go on for")
            number = ui.number(value=self.tab.generations, min=1, max=99, format="%d", on_change=self._go_on_for)
            number.props('dense outlined aria-label="generations before the next question"').classes("count")
            ui.label("gen.").tooltip("generations before the next question")
            ui.button("Stop here", on_click=self._ask_to_stop).props("no-caps dense outline color=negative")

    def _add_result(self) -> None:
        view = self.tab.view
        assert view.result
        address = f"/policies/{view.run}/{view.result.id}.npz"
        save = ui.button("Save the policy file", on_click=lambda: ui.download(address))
        save.props("no-caps dense color=primary")
        ui.button("How it came about", on_click=lambda: self.tab.turn_to(texts.HISTORY)).props("no-caps dense outline")

    def _go_on_for(self, event: ValueChangeEventArguments[float | None]) -> None:
        self.tab.go_on_for(int(event.value or 1))

    def _candidate(self) -> int | None:
        """Return the policy that a stop would end with."""
        previous = self.tab.view.previous
        return self.tab.selection.focus if self.tab.selection.focus is not None else previous.id if previous else None

    def _ask_to_stop(self) -> None:
        policy = self._candidate()
        if policy is None or not self.tab.view.choosable(policy):
            self.tab.tell("Look at the policy first that shall be the result, one that can be chosen.", "hint")
            return
        self.ending = Answer(policy, stop=True)
        self.stop_text.set_text(f"End the run here, with policy {policy} as its result?")
        self.stopping.open()

    def _stop(self) -> None:
        """Give the answer that was confirmed, wherever the focus is now. The dialog does not outlive its question."""
        self.stopping.close()
        if self.question and self.ending:
            self.tab.answer(self.question, self.ending)

    async def _go_on(self) -> None:
        await self.tab.switch(self.tab.view.run)

"""The question, and the answers that need no policy to be looked at."""

from nicegui import ui
from nicegui.events import ValueChangeEventArguments

from jmorl.report.journey import how_to
from jmorl.studio import texts, words
from jmorl.studio.panels.panel import Shown
from jmorl.studio.tab import Tab

ROUNDS = 5  # that a run which has ended goes on for, if somebody does not say otherwise


class QuestionBar:
    """The question, with the ways to answer it; between two questions, and at the end, what can be done then."""

    def __init__(self, tab: Tab):
        self.tab = tab
        self.rounds = ROUNDS
        self.asked, self.offered = Shown(), Shown()
        with ui.element("section").classes("bar question").props('aria-label="The question"'):
            self.heading = ui.label().classes("heading").props('role="status" aria-live="polite"')
            self.buttons = ui.element("div").classes("buttons")
        dialog = ui.dialog().props('aria-label="How to use the policy"')
        with dialog.bind_value_to(tab, "covered") as self.how_to, ui.card():
            ui.label(words.HOW_TO)
            self.lines = ui.element("pre").classes("lines-of-python")
            ui.button(words.CLOSE, on_click=self.how_to.close).props("flat no-caps")

    def show(self) -> None:
        """Show what is asked; replace the buttons only where others are due: somebody may be about to press one."""
        view, selection = self.tab.view, self.tab.selection
        if not self.asked.is_new(view, selection):
            return
        self.heading.set_text(texts.heading(view, selection))
        at_rest, has_front, chosen = view.timeline is None, bool(view.front), view.previous is not None
        between = at_rest, has_front, chosen, view.asking, view.stand_in, view.rounds_to_question
        state = view.run, view.question, view.result, *between
        if self.offered.is_new(*state, selection.more_of):
            self._add_buttons()

    def _add_buttons(self) -> None:
        view = self.tab.view
        self.buttons.clear()
        with self.buttons:
            if view.front:
                self._add_more()
            if self.tab.access.watching and not view.result:
                ui.label(words.OTHERS_ANSWER).classes("explanation")
            elif view.question:
                self._add_answers()
            elif view.result:
                self._add_result()
            elif view.timeline is None and not view.for_good:
                ui.button(words.GO_ON, on_click=self._go_on).props("no-caps dense color=primary")
            elif view.timeline and view.generations:
                self._add_interruptions()

    def _add_more(self) -> None:
        ui.label(words.BETTER_IN)
        for index, objective in enumerate(self.tab.view.objectives):
            pressed = self.tab.selection.more_of == index
            button = ui.button(objective.label, on_click=lambda index=index: self.tab.more_of(index))
            button.props(f"no-caps dense {'unelevated' if pressed else 'outline'} aria-pressed={str(pressed).lower()}")
            button.classes("objective")

    def _add_answers(self) -> None:
        view = self.tab.view
        assert view.question
        keep = texts.keep(view)
        if keep:
            ui.button(keep, on_click=self.tab.keep).props("no-caps dense outline").tooltip(words.KEEP_HINT)
        left = view.timeline.left if view.timeline else 1
        if texts.offers_equal(view):
            ui.button(words.NO_DIFFERENCE, on_click=self.tab.say_equal).props("no-caps dense outline")
        if view.question.purpose != "steer":
            return
        if texts.offers_pair(view):
            pair = ui.button(words.COMPARE_TWO, on_click=self.tab.ask_pair).props("no-caps dense outline")
            pair.tooltip(words.COMPARE_TWO_HINT)
        if not view.question.again:
            ui.button(words.SKIP, on_click=self.tab.skip).props("no-caps dense outline").tooltip(words.SKIP_HINT)
        if left > 1:
            ui.label(words.THEN_GO_ON_FOR)
            number = ui.number(value=self.tab.generations, min=1, max=left, format="%d", on_change=self._go_on_for)
            number.props('dense outlined aria-label="rounds before the next question"').classes("count")
            ui.label(f"of {left} rounds")
        ui.button(words.STOP_HERE, on_click=self.tab.stop).props("no-caps dense outline color=negative")

    def _add_interruptions(self) -> None:
        view = self.tab.view
        rounds = view.rounds_to_question
        if rounds is not None and not view.asking and (rounds > 1 or view.config.ask == "unsure"):
            ask = ui.button(words.ASK_NOW, on_click=self.tab.ask_now).props("no-caps dense outline")
            ask.tooltip(words.ASK_NOW_HINT)
        if view.stand_in:
            back = ui.button(words.CHOOSE_OTHERWISE, on_click=self._take_back).props("no-caps dense outline")
            back.tooltip(words.TAKE_BACK_HINT)
        ui.button(words.PAUSE, on_click=self.tab.pause).props("no-caps dense outline").tooltip(words.PAUSE_HINT)
        if view.previous and rounds is not None and view.asking != "end":
            ui.button(words.STOP_HERE, on_click=self.tab.stop).props("no-caps dense outline color=negative")

    def _add_result(self) -> None:
        view = self.tab.view
        assert view.result
        ui.button(words.SAVE_POLICY, on_click=self._save).props("no-caps dense color=primary")
        with ui.dropdown_button(words.SAVE_MORE, auto_close=True).props("no-caps dense outline"):
            for what, address in words.MORE_FILES.items():
                ui.item(what, on_click=lambda address=address: ui.download(address.format(run=view.run)))
        ui.button(words.HOW_IT_CAME_ABOUT, on_click=lambda: self.tab.turn_to(words.HISTORY)).props(
            "no-caps dense outline"
        )
        if self.tab.access.watching:
            return
        ui.button(words.TRAIN_ON, on_click=self._train_on).props("no-caps dense outline").tooltip(words.TRAIN_ON_HINT)
        number = ui.number(value=self.rounds, min=1, max=1000, format="%d", on_change=self._set_rounds)
        number.props('dense outlined aria-label="rounds to train on for"').classes("count")
        ui.label(words.ROUNDS)

    async def _take_back(self) -> None:
        view = self.tab.view
        await self.tab.step_back(view.run, view.choices[-1][0])

    def _save(self) -> None:
        """Save the file of the result, and say how to use it."""
        view = self.tab.view
        assert view.result
        ui.download(f"/policies/{view.run}/{view.result.id}.npz")
        self.lines.clear()
        with self.lines:
            ui.label(how_to(view.config.env, f"policy-{view.result.id}.npz"))
        self.how_to.open()

    def _go_on_for(self, event: ValueChangeEventArguments[float | None]) -> None:
        self.tab.go_on_for(int(event.value or 1))

    def _set_rounds(self, event: ValueChangeEventArguments[float | None]) -> None:
        self.rounds = int(event.value or 1)

    async def _train_on(self) -> None:
        await self.tab.train_on(self.rounds)

    async def _go_on(self) -> None:
        await self.tab.switch(self.tab.view.run)

"""The page: its parts, and what brings them up to date.

All that is shown comes from the session's records; a tab keeps nothing of its own but which objectives its chart has.
"""

from collections.abc import Callable
from pathlib import Path

from nicegui import run, ui
from nicegui.events import KeyEventArguments

from jmorl.decision.protocol import Answer, Question
from jmorl.display.text import objective_label
from jmorl.storage.checkpoints import CheckpointError
from jmorl.studio import texts
from jmorl.studio.cards import Cards
from jmorl.studio.chart_style import BLUE, RED
from jmorl.studio.charts import Charts
from jmorl.studio.history_panel import HistoryPanel
from jmorl.studio.navigation_panel import NavigationPanel
from jmorl.studio.policies import PolicyTable
from jmorl.studio.question_bar import QuestionBar
from jmorl.studio.session import Session
from jmorl.studio.view import View

REFRESH_SECONDS, TICK_SECONDS = 0.1, 1.0
STYLE = Path(__file__).parent / "studio.css"


class Page:
    """One tab."""

    def __init__(self, session: Session):
        self.session = session
        self.view, self.selection, self.dialogue = session.view, session.selection, session.dialogue
        self.settled: Question | None = None  # answered, and whoever sits at this tab knows
        ui.add_css(STYLE)
        ui.colors(primary=BLUE, negative=RED)
        with ui.element("main").classes("studio") as self.root:
            self._add_header()
            self.question_bar = QuestionBar(self)
            with ui.element("div").classes("charts"):
                self.charts = Charts(self)
            with ui.element("div").classes("side"):
                self._add_tabs()
                self.cards = Cards(self)
        self._add_keys()
        self._show_all()
        ui.timer(REFRESH_SECONDS, self.refresh)

    def refresh(self) -> None:
        """Bring up to date what is not."""
        view, selection, dialogue = self.session.view, self.session.selection, self.session.dialogue
        other_run = view.path != self.view.path
        if not other_run and len(view.choices) > len(self.view.choices):
            self._tell_of_answer(self.view.question, view)
        new_view, new_desk, new_dialogue = (
            view is not self.view,
            selection is not self.selection,
            dialogue is not self.dialogue,
        )
        self.view, self.selection, self.dialogue = view, selection, dialogue
        if other_run:
            self._show_all()
            return
        if new_view:
            self.charts.show()
            self.table.show()
            self.history.show()
        elif new_dialogue:
            self.charts.show()
        elif new_desk:
            self.charts.show_marks()
        if new_view or new_desk:
            self.question_bar.show()
            self.table.show_marks()
            self.cards.show()
        if new_view or new_dialogue:
            self.navigation.show()
        if new_view or self.session.clock() >= self.next_tick:
            self._tick()

    def choose(self, policy: int) -> None:
        """Answer the open question as this tab shows it."""
        question = self.view.question
        if question is None:
            ui.notify("No question is open: it is already answered, or still to come.", type="warning")
        elif not self.view.choosable(policy):
            ui.notify(f"Policy {policy} is not among those you can choose from.")
        else:
            self.answer(question, Answer(policy, generations=self.question_bar.generations))

    def answer(self, question: Question, answer: Answer) -> None:
        """Answer a question that this tab has shown; a second click does nothing more."""
        if question is self.settled:
            return
        self.settled = question
        if not self.session.answer(question, answer):
            ui.notify("This question is already answered, in another tab; nothing has changed.", type="warning")

    def look_at(self, policy: int) -> None:
        if not self.view.policy(policy):
            ui.notify(f"Policy {policy} is no longer in the front.")
        self.session.look_at(policy)
        self.refresh()

    def put_away(self, policy: int) -> None:
        self.session.put_away(policy)
        self.refresh()

    def more_of(self, objective: int) -> None:
        """More of an objective, or, asked for again, all policies."""
        self.session.more_of(None if self.selection.more_of == objective else objective)
        self.refresh()

    async def step_back(self, run_id: str, generation: int) -> None:
        """Ask an earlier question again, in a branch."""
        await self._wait_for("Stepping back", self.session.step_back, run_id, generation)

    async def switch(self, run_id: str) -> None:
        """Open another branch, or go on with the one that is open."""
        await self._wait_for("Opening", self.session.switch, run_id)

    async def _wait_for(self, doing: str, command: Callable[..., None], *arguments: str | int) -> None:
        with self.root:  # what was pressed may be gone when this is over
            training = self.view.timeline and not self.view.question
            ui.notify(f"{doing} after this generation …" if training else f"{doing} …")
            try:
                await run.io_bound(command, *arguments)
            except (ValueError, OSError, CheckpointError) as error:
                ui.notify(str(error), type="negative", multi_line=True)
        self.refresh()

    def _tell_of_answer(self, question: Question | None, view: View) -> None:
        """That the question this tab shows was answered elsewhere. A click on its way here would come to nothing."""
        if question and question is not self.settled and view.previous:
            self.settled = question
            ui.notify(f"Policy {view.previous.id} was chosen, in another tab.", type="warning")

    def _show_all(self) -> None:
        for part in (self.question_bar, self.charts, self.table, self.history, self.navigation, self.cards):
            part.show()
        self.table.show_marks()
        self._tick()

    def _add_header(self) -> None:
        with ui.element("header").classes("bar"):
            ui.label("jmorl studio").classes("brand")
            self.run_name = ui.label().classes("run-name")
            self.phase = ui.label().classes("phase").props('role="status"')
            with ui.element("div").classes("meter").props('role="progressbar" aria-label="Budget used"'):
                self.meter = ui.element("div")
            self.facts = ui.label().classes("facts")
            ui.button("Keys", on_click=self._show_keys).props("flat dense no-caps size=sm")

    def _add_tabs(self) -> None:
        with ui.element("section").classes("panel tabs"):
            with ui.tabs().props("dense no-caps align=left") as tabs:
                names = ("Policies", "Progress", "History", "E-NAUTILUS")
                for name in names:
                    ui.tab(name)
            # All stay mounted, so that none has to be filled anew when it is shown.
            with ui.tab_panels(tabs, value="Policies", animated=False).props("keep-alive").classes("tab-panels"):
                with ui.tab_panel("Policies"):
                    self.table = PolicyTable(self)
                with ui.tab_panel("Progress"):
                    self.charts.add_curves()
                with ui.tab_panel("History"):
                    self.history = HistoryPanel(self)
                with ui.tab_panel("E-NAUTILUS"):
                    self.navigation = NavigationPanel(self)
            self.tabs = tabs

    def _tick(self) -> None:
        """What changes with time alone."""
        view, now = self.view, self.session.clock()
        self.next_tick = now + TICK_SECONDS
        self.run_name.set_text(f"{view.path.name} · {view.config.env}")
        self.phase.set_text(texts.phase(view, now, self.session.leaving))
        self.facts.set_text(texts.facts(view, now))
        self.meter.style(f"width: {100 * texts.share_done(view, now):.1f}%")

    def _add_keys(self) -> None:
        ui.keyboard(self._press, ignore=["input", "select", "textarea"], repeating=True)
        with ui.dialog() as self.keys, ui.card():
            ui.label("Keys").classes("title")
            with ui.element("dl").classes("keys"):
                for key, what in texts.KEYS:
                    with ui.element("dt"):
                        ui.label(key)
                    with ui.element("dd"):
                        ui.label(what)
            for number, objective in enumerate(self.view.objectives, start=1):
                ui.label(f"{number}: {objective_label(objective)}")
            ui.button("Close", on_click=self.keys.close).props("flat no-caps")

    def _show_keys(self) -> None:
        self.keys.open()

    def _press(self, event: KeyEventArguments) -> None:
        modified = event.modifiers.ctrl or event.modifiers.alt or event.modifiers.meta
        if not event.action.keydown or modified or self.keys.value or self.question_bar.stopping.value:
            return
        key, focus = event.key, self.selection.focus
        if key.arrow_left or key.arrow_right:
            self._look_along(1 if key.arrow_right else -1)
        elif event.action.repeat:  # a key that is held down answers once
            return
        elif key.number and key.number <= len(self.view.objectives):
            self.more_of(key.number - 1)
        elif key == "?":
            self._show_keys()
        elif key == "c" and focus is not None:
            self.choose(focus)
        elif key == "x" and focus is not None:
            self.put_away(focus)
        elif key == "k":
            self.question_bar.keep()

    def _look_along(self, step: int) -> None:
        """Look at the next policy of those shown, in the order of the first objective in the chart."""
        wanted = texts.wanted(self.view, self.selection)
        shown = [policy for policy in self.view.front if wanted is None or policy.id in wanted]
        order = [policy.id for policy in sorted(shown, key=lambda policy: float(policy.values[self.charts.axes[0]]))]
        if order:
            place = order.index(self.selection.focus) + step if self.selection.focus in order else 0
            self.look_at(order[min(max(place, 0), len(order) - 1)])

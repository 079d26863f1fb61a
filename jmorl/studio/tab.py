"""One browser tab: the run as the tab shows it, and the commands that its panels give.

All that is shown comes from the session's records. A tab has little of its own: the axes of its chart, the panel open
at its side, the answer that is being given. It knows no panel and no widget.
"""

from collections.abc import Callable
from typing import Literal, TypeVar

from nicegui import run

from jmorl.decision.answers import Answer, PointAnswer
from jmorl.decision.protocol import PointQuestion, Question
from jmorl.learning.execution import ComputationFailed
from jmorl.storage.checkpoints import CheckpointError
from jmorl.studio import texts
from jmorl.studio.between import BlendScore
from jmorl.studio.dialogue import Dialogue
from jmorl.studio.selection import wanted
from jmorl.studio.session import Session
from jmorl.studio.view import View

Tone = Literal["hint", "warning", "failure"]
Result = TypeVar("Result")


class Tab:
    """The session's records that a tab shows, and what somebody who sits at it can do.

    `show` is called when the tab holds something new; `tell` puts a message on the page.
    """

    def __init__(self, session: Session, show: Callable[[], None], tell: Callable[[str, Tone], None]):
        self.session = session
        self.view, self.selection, self.dialogue = session.view, session.selection, session.dialogue
        self.axes = (0, 1)  # objectives of the chart of points: to the right, and upwards
        self.side = texts.POLICIES  # title of the panel that is open at the side
        self.covered = False  # by a dialog, which takes all keys
        self.generations = 1  # to go on for after the answer, before the next question
        self._settled: Question | None = None  # a question that whoever sits here knows to be answered
        self.show, self.tell = show, tell

    @property
    def point_question(self) -> PointQuestion | None:
        """Return the open question of E-NAUTILUS, or None."""
        return self.dialogue.question if self.dialogue and not self.dialogue.chosen else None

    @property
    def pair(self) -> tuple[int, int] | None:
        """Return the first two policies that are laid out; None for fewer."""
        first, second, *_ = [*self.selection.letters, None, None]
        return None if first is None or second is None else (first, second)

    async def score_between(self, run_id: str, first: int, second: int, per_cent: int) -> BlendScore | None:
        """Return what the blend of two policies returns; None, and why, if it cannot be scored."""
        return await self._in_background(self.session.score_between, run_id, first, second, per_cent)

    def follow(self) -> None:
        """Take over what the session has now, and show it."""
        view, selection, dialogue = self.session.view, self.session.selection, self.session.dialogue
        if view.path == self.view.path and len(view.choices) > len(self.view.choices):
            self._tell_of_answer(self.view.question, view)
        if view.question is not self.view.question:
            self.generations = 1
        self.view, self.selection, self.dialogue = view, selection, dialogue
        self.show()

    def choose(self, policy: int) -> None:
        """Answer the open question as this tab shows it."""
        question = self.view.question
        if question is None:
            self.tell("No question is open: it is already answered, or still to come.", "warning")
        elif not self.view.choosable(policy):
            self.tell(f"Policy {policy} is not among those you can choose from.", "hint")
        else:
            self.answer(question, Answer(policy, generations=self.generations))

    def keep(self) -> None:
        """Choose what was chosen last."""
        if self.view.previous:
            self.choose(self.view.previous.id)

    def answer(self, question: Question, answer: Answer) -> None:
        """Answer a question that this tab has shown; a second click does nothing more."""
        if question is self._settled:
            return
        self._settled = question
        if not self.session.answer(question, answer):
            self.tell("This question is already answered, in another tab; nothing has changed.", "warning")

    def go_on_for(self, generations: int) -> None:
        """Have the next answer hold for so many generations, at least one."""
        self.generations = max(generations, 1)

    def look_at(self, policy: int) -> None:
        """Lay a policy out and put it in focus."""
        if not self.view.policy(policy):
            self.tell(f"Policy {policy} is no longer in the front.", "hint")
        self.session.look_at(policy)
        self.follow()

    def look_along(self, step: int) -> None:
        """Look at the next policy of those shown, in the order of the objective to the right in the chart."""
        more = wanted(self.view, self.selection)
        shown = [policy for policy in self.view.front if more is None or policy.id in more]
        order = [policy.id for policy in sorted(shown, key=lambda policy: float(policy.values[self.axes[0]]))]
        if order:
            focus = self.selection.focus
            place = order.index(focus) + step if focus in order else 0
            self.look_at(order[min(max(place, 0), len(order) - 1)])

    def put_away(self, policy: int) -> None:
        """Lay a policy out no longer."""
        self.session.put_away(policy)
        self.follow()

    def more_of(self, objective: int) -> None:
        """Show the policies with more of an objective, or, asked for again, all policies."""
        self.session.more_of(None if self.selection.more_of == objective else objective)
        self.follow()

    def turn_axes(self, axes: tuple[int, int]) -> None:
        """Show other objectives in the chart of points."""
        self.axes = axes
        self.show()

    def turn_to(self, side: str) -> None:
        """Open the panel with this title at the side."""
        if side != self.side:
            self.side = side
            self.show()

    async def step_back(self, run_id: str, generation: int) -> None:
        """Ask an earlier question again, in a branch."""
        self._tell_of_wait("Stepping back")
        await self._in_background(self.session.step_back, run_id, generation)

    async def switch(self, run_id: str) -> None:
        """Open another branch, or go on with the one that is open."""
        self._tell_of_wait("Opening")
        await self._in_background(self.session.switch, run_id)

    async def begin_dialogue(self, iterations: int, points: int) -> None:
        """Begin E-NAUTILUS on the front."""
        await self._in_background(self.session.begin_dialogue, iterations, points)

    async def reply(self, at: Dialogue, answer: PointAnswer) -> None:
        """Answer in E-NAUTILUS, in the dialogue as this tab shows it."""
        if await self._in_background(self.session.reply, at, answer) is False:
            self.tell("The dialogue has moved on in another tab; nothing has changed.", "warning")

    def undo_reply(self) -> None:
        """Take the last answer in E-NAUTILUS back."""
        self.session.undo_reply()
        self.follow()

    def close_dialogue(self) -> None:
        """Leave E-NAUTILUS."""
        self.session.close_dialogue()
        self.follow()

    async def _in_background(self, command: Callable[..., Result], *arguments: object) -> Result | None:
        """Run a command that takes a while, during which the page goes on. Tell why it failed, if it does."""
        result = None
        try:
            result = await run.io_bound(command, *arguments)
        except (ValueError, OSError, CheckpointError, ComputationFailed) as error:
            self.tell(str(error), "failure")
        self.follow()
        return result

    def _tell_of_wait(self, doing: str) -> None:
        training = self.view.timeline and not self.view.question
        self.tell(f"{doing} after this generation …" if training else f"{doing} …", "hint")

    def _tell_of_answer(self, question: Question | None, view: View) -> None:
        """Say that the question this tab shows was answered elsewhere. A click on its way would come to nothing."""
        if question and question is not self._settled and view.previous:
            self._settled = question
            self.tell(f"Policy {view.previous.id} was chosen, in another tab.", "warning")

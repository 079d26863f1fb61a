"""One browser tab: the run as the tab shows it, and the commands that its panels give.

The run comes from the session's records, and an answer goes to the run. A tab has of its own what somebody looks at:
the policies laid out, the axes of the chart, the panel open at the side, the answer that is being given. It knows no
panel and no widget.
"""

import math
from collections.abc import Callable, MutableMapping
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from nicegui import run

from jmorl.decision.answers import Answer, AskPair, Instead, PointAnswer, Skip
from jmorl.decision.protocol import PointQuestion, Question
from jmorl.learning.execution import ComputationFailed
from jmorl.storage.checkpoints import CheckpointError
from jmorl.storage.notes_file import Note
from jmorl.studio import texts, words
from jmorl.studio.access import STEERS, Access, Tone, steering
from jmorl.studio.between import BlendScore
from jmorl.studio.comparison import Comparison
from jmorl.studio.dialogue import Dialogue
from jmorl.studio.history import Branch
from jmorl.studio.selection import Selection, last_choice, listed, to_begin_with
from jmorl.studio.session import Session
from jmorl.studio.view import View

Result = TypeVar("Result")


@dataclass(frozen=True, eq=False)
class Ending:
    """An answer that would end the run, before it is given."""

    question: Question | None  # that it answers; None between two questions
    policies: tuple[int, ...]  # any of which may become the result


@dataclass(frozen=True, eq=False)
class Editing:
    """A name and a note that somebody is writing."""

    run: str  # id of the run that it is about
    policy: int | None  # of that run; None: it is about the run itself
    subject: str  # what it is about, in words
    before: Note  # as it was when they began


class Tab:
    """The session's records that a tab shows, and what somebody who sits at it can do.

    A run is open. `show` is called when the tab holds something new; `tell` puts a message on the page. `kept` outlives
    a reload of the page: what is laid out is kept there. `renew` reloads the page, whose panels are made for the
    objectives of a run, when one with others was opened. With an `access` for watching, commands that steer do nothing.
    """

    def __init__(
        self,
        session: Session,
        show: Callable[[], None],
        tell: Callable[[str, Tone], None],
        kept: MutableMapping[str, Any] | None = None,
        renew: Callable[[], None] = lambda: None,
        access: Access = STEERS,
    ):
        self.session, self.access = session, access
        self.view, self.dialogue = session.view, session.dialogue
        self.kept = {} if kept is None else kept
        self.selection = Selection()
        self.ending: Ending | None = None  # that somebody is asked to confirm
        self.editing: Editing | None = None
        self.comparison: Comparison | None = None  # of branches, that is looked at
        self.left_out: frozenset[str] = frozenset()  # ids of the runs that the comparison does not show
        self.axes = (0, 1)  # objectives of the chart of points: to the right, and upwards
        self.side = words.POLICIES  # title of the panel that is open at the side
        self.covered = False  # by a dialog, which takes all keys
        self.generations = 1  # to go on for after the answer, before the next question
        self._settled: Question | None = None  # a question that whoever sits here knows to be answered
        self._limited = False  # limits were set here since the last answer
        self._told = ""  # what was wrong with the notes
        self._commands = 0  # of this tab, that are at work in the background
        self._news: str = self.kept.pop("news", "")  # of what happened before a reload
        self.show, self.tell, self.renew = show, tell, renew
        place, selection = self.kept.get("selection", (None, None))
        if place == self._place:
            self._lay_out(selection.known_in(self.view))
        else:
            self._begin()

    @property
    def _place(self) -> tuple[str, str, int]:
        """Where the run is: what is laid out belongs to a question, and without one to the run."""
        question = self.view.question
        return (self.view.run, question.purpose, question.generation) if question else (self.view.run, "", 0)

    @property
    def point_question(self) -> PointQuestion | None:
        """Return the open question of E-NAUTILUS, or None."""
        return self.dialogue.question if self.dialogue and not self.dialogue.chosen else None

    @property
    def pair(self) -> tuple[int, int] | None:
        """Return the first two policies that are laid out; None for fewer, and in the warm-up."""
        first, second, *_ = [*self.selection.letters, None, None]
        return None if first is None or second is None or self.view.early else (first, second)

    async def score_between(self, run_id: str, first: int, second: int, per_cent: int) -> BlendScore | None:
        """Return what the blend of two policies returns; None, and why, if it cannot be scored."""
        return await self._in_background(self.session.score_between, run_id, first, second, per_cent)

    def follow(self) -> None:
        """Take over what the session has now, and show it."""
        before, view, dialogue = self.view, self.session.view, self.session.dialogue
        if view.path != before.path and not self._commands:
            self._news = texts.opened_elsewhere(view)
        if view.objectives != before.objectives:
            self.kept["news"] = self._news
            self.renew()
            return
        if self._news:
            self.tell(self._news, "warning")
            self._news = ""
        if view.path == before.path and len(view.choices) > len(before.choices):
            self._tell_of_answer(before.question, view)
        led_to = dialogue.chosen if dialogue and dialogue is not self.dialogue else None
        self.view, self.dialogue = view, dialogue
        if view.question is not before.question:
            self.generations, self.ending = 1, None
        self._limited = self._limited and view.run == before.run
        asked = view.question is not None and view.question is not before.question
        if view.run != before.run or asked or view.early != before.early:
            self._begin()
        elif view is not before:
            self._lay_out(self.selection.known_in(view))
        if view.result and (view.run != before.run or not before.result):
            self._lay_out(self.selection.with_policy(view.result.id))
        if led_to and view.policy(led_to.id):
            self._lay_out(self.selection.with_policy(led_to.id))
        if self.session.prospects is not self.selection.prospects:
            self.selection = replace(self.selection, prospects=self.session.prospects)
        if view.noted.problem != self._told:
            self._told = view.noted.problem
            if self._told:
                self.tell(words.NOTES_PROBLEM.format(problem=self._told), "failure")
        self.show()

    @steering
    def choose(self, policy: int) -> None:
        """Answer the open question as this tab shows it."""
        question = self.view.question
        if question is None:
            self.tell("No question is open: it is already answered, or still to come.", "warning")
        elif not self.view.choosable(policy):
            self.tell(f"Policy {policy} is not among those you can choose from.", "hint")
        elif question.purpose == "final":
            self._ask_to_end(policy)
        else:
            self.answer(question, Answer(policy, generations=self.generations))

    @steering
    def say_equal(self) -> None:
        """Answer that there is no difference between the policies of the open question."""
        question = self.view.question
        if question:
            last = last_choice(self.view)
            kept = last.id if last and self.view.choosable(last.id) else question.front[0].id
            self.answer(question, Answer(kept, generations=self.generations, equal=True))

    @steering
    def skip(self) -> None:
        """Have the open question answered by the earlier answers."""
        if self.view.question:
            self.answer(self.view.question, Skip())

    @steering
    def ask_pair(self) -> None:
        """Have a question about two policies in place of the open one."""
        if self.view.question:
            self.answer(self.view.question, AskPair())

    def limit(self, objective: int, least: float | None) -> None:
        """Set what an objective must reach, from the next answer on for the search, too; None: anything."""
        limits = list(self.selection.limits or [-math.inf] * len(self.view.objectives))
        limits[objective] = -math.inf if least is None else least
        self._limited = True
        self._lay_out(replace(self.selection, limits=tuple(limits)))
        self.show()

    @steering
    def keep(self) -> None:
        """Choose what was chosen last, or what has replaced it."""
        kept = last_choice(self.view)
        if kept:
            self.choose(kept.id)

    @steering
    def stop(self) -> None:
        """Have the end of the run confirmed, with the last choice as its result, or the policy in focus."""
        last, focus = last_choice(self.view), self.selection.focus
        policies = [policy for policy in (last.id if last else None, focus) if policy is not None]
        if self.view.question:
            policies = [policy for policy in policies if self.view.choosable(policy)]
        elif last:
            policies = [last.id]
        if policies:
            self._ask_to_end(*dict.fromkeys(policies))
        else:
            self.tell("First click a policy that can be chosen: the one that the run shall end with.", "hint")

    @steering
    def end(self, policy: int) -> None:
        """End the run with a policy, as somebody has confirmed, wherever the focus is now."""
        ending, self.ending = self.ending, None
        if ending is None or policy not in ending.policies:
            return
        if ending.question:
            self.answer(ending.question, Answer(policy, stop=True))
        else:
            self.session.end_with(policy)
        self.show()

    def do_not_end(self) -> None:
        """Go on: nothing is confirmed."""
        self.ending = None
        self.show()

    @steering
    def ask_now(self) -> None:
        """Have the next question asked before the next generation."""
        self.session.ask_now()
        self.follow()

    @steering
    async def pause(self) -> None:
        """Leave the run after the generation that is going on; it can be taken up from there."""
        self._tell_of_wait("Pausing")
        await self._in_background(self.session.leave)

    @steering
    async def train_on(self, rounds: int) -> None:
        """Go on where the run ended, for some more generations, in a branch."""
        await self._in_background(self.session.train_on, max(rounds, 1))

    @steering
    def answer(self, question: Question, answer: Answer | Instead) -> None:
        """Answer a question that this tab has shown, with the limits set in it; a second click does nothing more."""
        if question is self._settled:
            return
        self._settled, self._limited = question, False
        limits = None if self.selection.limits == question.limits else self.selection.limits
        if isinstance(answer, Instead):
            answer.limits = limits
        else:
            answer = replace(answer, limits=limits)
        if not self.session.answer(question, answer):
            self.tell("This question is already answered, in another tab; nothing has changed.", "warning")

    def go_on_for(self, generations: int) -> None:
        """Have the next answer hold for so many generations, at least one."""
        left = self.view.timeline.left if self.view.timeline else generations
        self.generations = min(max(generations, 1), max(left, 1))

    def look_at(self, policy: int) -> None:
        """Lay a policy out and put it in focus."""
        if not self.view.policy(policy):
            self.tell(f"Policy {policy} is no longer in the front.", "hint")
        if self.view.policy(policy):
            self._lay_out(self.selection.with_policy(policy))
        self.show()

    def look_along(self, step: int) -> None:
        """Look at the next policy of those shown, in the order of the objective to the right in the chart."""
        kept = listed(self.view, self.selection)
        shown = self.view.front if kept is None else tuple(filter(None, map(self.view.policy, kept)))
        order = [policy.id for policy in sorted(shown, key=lambda policy: float(policy.values[self.axes[0]]))]
        if order:
            focus = self.selection.focus
            place = order.index(focus) + step if focus in order else 0
            self.look_at(order[min(max(place, 0), len(order) - 1)])

    def put_away(self, policy: int) -> None:
        """Lay a policy out no longer."""
        self._lay_out(self.selection.without(policy))
        self.show()

    def more_of(self, objective: int) -> None:
        """Show the policies with more of an objective than the one in focus, or else the last choice, has.

        Asked for again, show all policies.
        """
        previous = self.view.previous.id if self.view.previous else None
        than = self.selection.focus if self.selection.focus is not None else previous
        wanted_now = None if self.selection.more_of == objective else objective
        self._lay_out(replace(self.selection, more_of=wanted_now, than=than))
        self.show()

    def list_favourites(self, only: bool) -> None:
        """List favourites only, those that are no longer in the front among them; or the whole front again."""
        self._lay_out(replace(self.selection, favourites=only))
        self.show()

    @steering
    async def favour(self, policy: int) -> None:
        """Make a policy a favourite, or one no longer."""
        favourite = not self.view.noted.policy(policy).favourite
        await self._in_background(self.session.note, self.view.run, policy, favourite=favourite)

    @steering
    def edit_policy(self, policy: int) -> None:
        """Begin to write the name and the note of a policy."""
        self._edit(Editing(self.view.run, policy, f"policy {policy}", self.view.noted.policy(policy)))

    @steering
    def edit_run(self, branch: Branch) -> None:
        """Begin to write the name and the note of a run in the history."""
        self._edit(Editing(branch.run, None, branch.name, branch.noted.run))

    @steering
    async def save_note(self, name: str, text: str) -> None:
        """Keep the name and the note that somebody has written, and nothing that they have not changed."""
        editing = self.editing
        if editing is None:
            return
        now, before = {"name": name, "text": text}, {"name": editing.before.name, "text": editing.before.text}
        changes = {field: value for field, value in now.items() if value != before[field]}
        kept = await self._in_background(self.session.note, editing.run, editing.policy, **changes)
        if kept and self.editing is editing:
            self._edit(None)

    def stop_editing(self) -> None:
        """Keep nothing of what is being written."""
        self._edit(None)

    async def compare(self) -> None:
        """Show the fronts of all branches in one chart."""
        found = await self._in_background(self.session.fronts)
        if found and len(found.fronts) > 1:
            self.comparison, self.left_out = found, frozenset()
        elif found:
            self.tell(" ".join([words.NOTHING_TO_COMPARE, *found.problems]), "hint")
        self.show()

    async def compare_anew(self) -> None:
        """Take the fronts as they are by now, if they are still looked at."""
        found = await self._in_background(self.session.fronts)
        if found and self.comparison:
            self.comparison = found
            self.show()

    def compare_with(self, run_id: str, shown: bool) -> None:
        """Show the front of a branch in the comparison, or leave it out."""
        self.left_out = self.left_out - {run_id} if shown else self.left_out | {run_id}
        self.show()

    def stop_comparing(self) -> None:
        """Look at the comparison no longer."""
        self.comparison = None
        self.show()

    def turn_axes(self, axes: tuple[int, int]) -> None:
        """Show other objectives in the chart of points."""
        self.axes = axes
        self.show()

    def turn_to(self, side: str) -> None:
        """Open the panel with this title at the side."""
        if side != self.side:
            self.side = side
            self.show()

    @steering
    async def step_back(self, run_id: str, generation: int) -> None:
        """Ask an earlier question again, in a branch."""
        self._tell_of_wait("Stepping back")
        await self._in_background(self.session.step_back, run_id, generation)

    @steering
    async def switch(self, run_id: str) -> None:
        """Open another branch, or go on with the one that is open."""
        self._tell_of_wait("Opening")
        await self._in_background(self.session.switch, run_id)

    @steering
    async def begin_dialogue(self, iterations: int, points: int) -> None:
        """Begin E-NAUTILUS on the front."""
        await self._in_background(self.session.begin_dialogue, iterations, points)

    @steering
    async def reply(self, at: Dialogue, answer: PointAnswer) -> None:
        """Answer in E-NAUTILUS, in the dialogue as this tab shows it."""
        if await self._in_background(self.session.reply, at, answer) is False:
            self.tell("The dialogue has moved on in another tab; nothing has changed.", "warning")

    @steering
    def undo_reply(self) -> None:
        """Take the last answer in E-NAUTILUS back."""
        self.session.undo_reply()
        self.follow()

    @steering
    def close_dialogue(self) -> None:
        """Leave E-NAUTILUS."""
        self.session.close_dialogue()
        self.follow()

    def _begin(self) -> None:
        """Lay out what the open question is best begun with, or the result."""
        if self.view.question or self.view.early:
            selection = to_begin_with(self.view, self.axes)
            self._lay_out(replace(selection, limits=self.selection.limits) if self._limited else selection)
        elif self.view.result:
            self._lay_out(Selection().with_policy(self.view.result.id))
        else:
            self._lay_out(Selection())

    def _lay_out(self, selection: Selection) -> None:
        """Take a selection over; find out what choosing its policies would mean."""
        self.selection = replace(selection, prospects=self.session.prospects)
        self.kept["selection"] = self._place, self.selection
        for policy in self.selection.letters:
            self.session.work_out(policy)

    def _ask_to_end(self, *policies: int) -> None:
        self.ending = Ending(self.view.question, policies)
        self.show()

    def _edit(self, editing: Editing | None) -> None:
        self.editing = editing
        self.show()

    async def _in_background(
        self, command: Callable[..., Result], *arguments: object, **named: object
    ) -> Result | None:
        """Run a command that takes a while, during which the page goes on. Tell why it failed, if it does."""
        result = None
        self._commands += 1
        try:
            result = await run.io_bound(command, *arguments, **named)
        except (ValueError, OSError, CheckpointError, ComputationFailed) as error:
            self.tell(str(error), "failure")
        self.follow()
        self._commands -= 1
        return result

    def _tell_of_wait(self, doing: str) -> None:
        training = self.view.timeline and not self.view.question
        self.tell(f"{doing} after this round …" if training else f"{doing} …", "hint")

    def _tell_of_answer(self, question: Question | None, view: View) -> None:
        """Say that the question this tab shows was answered elsewhere. A click on its way would come to nothing."""
        if question and question is not self._settled and view.previous:
            self._settled = question
            self.tell(f"Policy {view.previous.id} was chosen, in another tab.", "warning")

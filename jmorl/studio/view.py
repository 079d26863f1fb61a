"""A run as it is shown: one immutable record that is replaced as a whole.

The thread of the run makes it, the page reads it; neither waits for the other.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np

import envs
from envs.core import Objective
from jmorl.config import Config, resolve
from jmorl.decision.protocol import Question
from jmorl.decision.records import DecisionRecord
from jmorl.display.text import REASONS
from jmorl.events import Decided, Event, GenerationFinished, Resumed, RunFinished
from jmorl.report.timeline import Timeline
from jmorl.search.archive import Archive
from jmorl.search.policy import Policy, rescored, values_of
from jmorl.state import RunState
from jmorl.storage.layout import Layout
from jmorl.storage.manifest import read_manifest
from jmorl.storage.notes_file import Notes, read_notes
from jmorl.storage.stored_run import StoredRun, read_run
from jmorl.units import measured_in

PERSON = "terminal"  # the config's user whose questions are put on the page
UNRECORDED = "your earlier answers speak for it"  # why a stand-in answered, as far as a log tells
EQUAL = "you saw no difference, and your earlier answers speak for it"
Asking = Literal["question", "end"]


@dataclass(frozen=True, eq=False)
class Generation:
    """The record of a generation that is over."""

    number: int  # 0: the warm-up
    front: np.ndarray  # [N, M] values of the archive after it
    steps: float  # environment steps so far
    hypervolume: float
    utility: float | None  # best in the archive, of a user who has a utility


@dataclass(frozen=True, eq=False)
class View:
    """A run at one moment."""

    path: Path
    run: str  # id in the run's manifest
    config: Config
    objectives: tuple[Objective, ...]
    generations: tuple[Generation, ...]  # the warm-up first; empty before its end
    front: tuple[Policy, ...]  # the archive; in the warm-up nothing, or `early` agents
    bounds: np.ndarray  # [M] in force, -inf before the first choice
    previous: Policy | None  # chosen last
    choices: tuple[tuple[int, np.ndarray], ...]  # so far: the generation each was made for, and its values [M]
    timeline: Timeline | None  # of the run that goes on; None if it does not
    state: RunState | None = None  # after the last generation of a run that goes on
    question: Question | None = None  # that is open
    result: Policy | None = None
    reason: str = ""  # why the run ended, in words
    problem: str = ""  # what broke the run off, a sentence
    for_good: bool = False  # going on would break the run off in the same way
    asking: Asking | None = None  # somebody wants the next question before the next generation, or the end
    stand_in: str = ""  # why the last choice was made by a stand-in; nothing if it was the person's own
    answered: int | None = None  # generation of the last question that the person answered themselves
    notes: tuple[str, ...] = ()  # what somebody should know about it, sentences
    replaced: Mapping[int, Policy] = field(default_factory=dict)  # id -> policy that was in the front once, no network
    noted: Notes = Notes()  # names, favourites and notes that somebody has given

    @cached_property
    def values(self) -> np.ndarray:  # [N, M]
        """Return the front's objective vectors; N may be zero."""
        return values_of(self.front) if self.front else np.zeros((0, len(self.objectives)))

    def policy(self, policy_id: int) -> Policy | None:
        """Return a policy that can be looked at, if it is there."""
        known = (*self.front, *filter(None, (self.previous, self.result)))
        return next((policy for policy in known if policy.id == policy_id), self.replaced.get(policy_id))

    @cached_property
    def favourites(self) -> tuple[Policy, ...]:
        """Return the favourites that can be looked at, by id; some may have been replaced in the front."""
        return tuple(policy for policy in map(self.policy, self.noted.favourites) if policy)

    @property
    def early(self) -> bool:
        """Whether the front is of agents in the middle of their warm-up, of which nothing is kept."""
        return bool(self.front) and not self.generations

    def choosable(self, policy_id: int) -> bool:
        """Return whether a policy may be the answer to the open question, shown in it or not."""
        return self.question is not None and any(policy.id == policy_id for policy in self.question.whole.front)

    @property
    def questions(self) -> tuple[int, int] | None:
        """The number of the open question among those that the person was asked, and how many there may be at most."""
        if self.question is None or self.state is None or self.timeline is None or self.config.user != PERSON:
            return None
        number = self.state.questions + 1
        silent = self.timeline.silent is None or self.question.purpose == "final"
        return number, number + (0 if silent else self.timeline.left)

    @property
    def rounds_to_question(self) -> int | None:
        """How many generations end before the person is asked, or a stand-in; None if nobody is before the end."""
        timeline = self.timeline
        if timeline is None or timeline.silent is None or self.config.user != PERSON:
            return None
        return 1 if self.asking else min(timeline.silent, timeline.left)

    def is_new(self, policy: Policy) -> bool:
        """Return whether a policy has come since the person was asked last."""
        return self.answered is not None and policy.generation >= self.answered


def stored_view(path: Path) -> View:
    """Return what a run folder has to show; of a run that is in its warm-up nothing yet. Raises as `read_run` does."""
    manifest, config = read_manifest(path), resolve(file=Layout(path).config)
    objectives = measured_in(config.evaluation.units, envs.make(config.env).objectives)
    unbounded = np.full(len(objectives), -np.inf)
    nothing = View(path, manifest["run"], config, objectives, (), (), unbounded, None, (), None, noted=read_notes(path))
    if not Layout(path).metrics.exists():
        return nothing
    stored = read_run(path)
    decisions = [record for record in stored.decisions if isinstance(record, DecisionRecord)]
    archives = _archives(stored)
    return replace(
        nothing,
        generations=_generations(stored, archives),
        front=rescored(stored.front, filter(None, [stored.chosen])),
        replaced=_replaced([policy for archive in archives for policy in archive.members], stored.front),
        bounds=stored.bounds[-1],
        previous=stored.policies[decisions[-1].policy] if decisions else None,
        choices=tuple((record.generation, np.array(record.values)) for record in decisions),
        answered=max((record.generation for record in decisions if not record.stand_in), default=None),
        stand_in=UNRECORDED if decisions and decisions[-1].stand_in else "",
        result=stored.chosen,
        reason=REASONS[stored.result["reason"]] if stored.result else "",
    )


def after(view: View, event: Event, now: float) -> View:
    """Return the view when `event` has just happened; `now` is in seconds of the timeline's clock."""
    assert view.timeline is not None
    view = replace(view, timeline=view.timeline.after(event, now))
    match event:
        case Resumed(state=state):
            past = tuple(choice for choice in view.choices if choice[0] <= state.generation)
            answered = view.answered if view.answered is None else min(view.answered, state.generation)
            view = replace(view, state=state, front=state.archive.members, bounds=event.bounds)
            return replace(view, previous=state.choice, choices=past, answered=answered or None)
        case GenerationFinished(state):
            front = state.archive.members
            values, metrics = values_of(front), event.front
            over = Generation(state.generation, values, event.steps, metrics.hypervolume, event.utility_max)
            replaced = {} if view.early else {**view.replaced, **_replaced(view.front, front)}
            return replace(view, state=state, generations=(*view.generations, over), front=front, replaced=replaced)
        case Decided(chosen=Policy() as chosen):
            choices = (*view.choices, (event.question.generation, chosen.values))
            asked, generation = event.question.was_asked(event.answer), event.question.generation
            view = replace(view, question=None, bounds=event.bounds, previous=chosen, choices=choices)
            if not asked:
                return replace(view, stand_in=_reason(event))
            equal = event.answer.equal and not getattr(event.question, "again", False)  # else their own choice stands
            return replace(view, answered=generation, stand_in=EQUAL if equal else "")
        case RunFinished():
            front = rescored(view.front, [event.chosen])
            return replace(view, front=front, result=event.chosen, reason=REASONS[event.reason], timeline=None)
    return view


def _reason(event: Decided) -> str:
    """Return why a stand-in answered."""
    return str(getattr(event.answer, "reason", "")) or UNRECORDED


def _replaced(once: Iterable[Policy], front: tuple[Policy, ...]) -> dict[int, Policy]:
    """Return those that were in a front once and are in it no more, without their networks, by id."""
    here = {policy.id for policy in front}
    return {policy.id: replace(policy, snapshot=None) for policy in once if policy.id not in here}


def _archives(stored: StoredRun) -> list[Archive]:
    """Return the archive after each generation of a stored run: of all policies evaluated by then."""
    archives = [Archive()]
    for number in range(len(stored.metrics["generation"])):
        offspring = [policy for policy in stored.policies if policy.generation == number]
        archives.append(archives[-1].offer(offspring))
    return archives[1:]


def _generations(stored: StoredRun, archives: Sequence[Archive]) -> tuple[Generation, ...]:
    """Return the generations of a stored run; the front of each is that of all policies evaluated by then."""
    generations = []
    metrics = stored.metrics
    for number, archive in enumerate(archives):
        utility = float(metrics["utility_max"][number])
        generations.append(
            Generation(
                number,
                archive.values,
                float(metrics["steps"][number]),
                float(metrics["hypervolume"][number]),
                None if np.isnan(utility) else utility,
            )
        )
    return tuple(generations)

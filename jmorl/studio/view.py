"""A run as it is shown: one immutable record that is replaced as a whole.

The thread of the run makes it, the page reads it; neither waits for the other.
"""

from dataclasses import dataclass, replace
from pathlib import Path

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
from jmorl.search.policy import Policy, values_of
from jmorl.state import RunState
from jmorl.storage.layout import Layout
from jmorl.storage.manifest import read_manifest
from jmorl.storage.stored_run import StoredRun, read_run
from jmorl.units import measured_in

PERSON = "terminal"  # the config's user whose questions are put on the page


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
    front: tuple[Policy, ...]  # the archive; empty before the end of the warm-up
    bounds: np.ndarray  # [M] in force, -inf before the first choice
    previous: Policy | None  # chosen last
    choices: tuple[tuple[int, np.ndarray], ...]  # so far: the generation each was made for, and its values [M]
    timeline: Timeline | None  # of the run that goes on; None if it does not
    state: RunState | None = None  # after the last generation of a run that goes on
    question: Question | None = None  # that is open
    result: Policy | None = None
    reason: str = ""  # why the run ended, in words
    problem: str = ""  # what broke the run off, a sentence
    notes: tuple[str, ...] = ()  # what somebody should know about it, sentences

    @property
    def values(self) -> np.ndarray:  # [N, M]
        """Return the front's objective vectors; N may be zero."""
        return values_of(self.front) if self.front else np.zeros((0, len(self.objectives)))

    def policy(self, policy_id: int) -> Policy | None:
        """Return a policy that can be looked at, if it is there."""
        known = (*self.front, *filter(None, (self.previous, self.result)))
        return next((policy for policy in known if policy.id == policy_id), None)

    def choosable(self, policy_id: int) -> bool:
        """Return whether a policy may be the answer to the open question."""
        return self.question is not None and any(policy.id == policy_id for policy in self.question.front)


def stored_view(path: Path) -> View:
    """Return what a run folder has to show; of a run that is in its warm-up nothing yet. Raises as `read_run` does."""
    manifest, config = read_manifest(path), resolve(file=Layout(path).config)
    objectives = measured_in(config.evaluation.units, envs.make(config.env).objectives)
    nothing = View(path, manifest["run"], config, objectives, (), (), np.full(len(objectives), -np.inf), None, (), None)
    if not Layout(path).metrics.exists():
        return nothing
    stored = read_run(path)
    decisions = [record for record in stored.decisions if isinstance(record, DecisionRecord)]
    return replace(
        nothing,
        generations=_generations(stored),
        front=stored.front,
        bounds=stored.bounds[-1],
        previous=stored.policies[decisions[-1].policy] if decisions else None,
        choices=tuple((record.generation, np.array(record.values)) for record in decisions),
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
            view = replace(view, state=state, front=state.archive.members, bounds=event.bounds)
            return replace(view, previous=state.choice, choices=past)
        case GenerationFinished(state):
            front = state.archive.members
            values, metrics = values_of(front), event.front
            over = Generation(state.generation, values, event.steps, metrics.hypervolume, event.utility_max)
            return replace(view, state=state, generations=(*view.generations, over), front=front)
        case Decided(chosen=Policy() as chosen):
            choices = (*view.choices, (event.question.generation, chosen.values))
            return replace(view, question=None, bounds=event.bounds, previous=chosen, choices=choices)
        case RunFinished():
            return replace(view, result=event.chosen, reason=REASONS[event.reason], timeline=None)
    return view


def _generations(stored: StoredRun) -> tuple[Generation, ...]:
    """Return the generations of a stored run; the front of each is that of all policies evaluated by then."""
    archive, generations = Archive(), []
    metrics = stored.metrics
    for number in range(len(metrics["generation"])):
        archive = archive.offer([policy for policy in stored.policies if policy.generation == number])
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

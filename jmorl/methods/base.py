"""The protocol between a run and its search method.

A method is a set of pure functions: all that it knows is in the problem it is made for and in the `RunState`, whose
`search` field holds its own state. `jmorl.loop` orders the calls. A new method is a file with a subclass of `Method`,
and one line that registers it (`jmorl.methods.registry`).

Letters: P agents, M objectives, N policies, K predictions.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

import numpy as np

from envs.core import Objective
from jmorl.decision.protocol import AnyQuestion
from jmorl.search.metrics import Utility
from jmorl.search.policy import Policy
from jmorl.search.prospect import Prospect
from jmorl.search.settings import SearchConfig
from jmorl.state import RunState

SearchState = TypeVar("SearchState")


@dataclass(frozen=True, eq=False)
class Problem:
    """What a method is made for."""

    objectives: tuple[Objective, ...]  # M, in the units of the scores
    weights: np.ndarray  # [P, M] of the warm-up
    seed: int
    search: SearchConfig

    @property
    def agents(self) -> int:
        """P."""
        return len(self.weights)


@dataclass(frozen=True, eq=False)
class Tasks:
    """What a generation trains: a policy and its weights for each agent."""

    parents: Sequence[Policy]  # [P] whose training is continued
    weights: np.ndarray  # [P, M]
    predicted: np.ndarray | None  # [P, M] expected values of the offspring; None for a method without a model
    candidates: int  # policies that could have been continued
    interval: np.ndarray | None = None  # [2, P, M] ends between which the values lie in 80 of 100 cases
    spread: np.ndarray | None = None  # [P, M] standard deviation about the expected values


@dataclass(frozen=True, eq=False)
class PackedSearch:
    """A method's state as a checkpoint keeps it."""

    document: Mapping[str, Any] = field(default_factory=dict)  # what JSON can hold; policies by their ids
    arrays: Mapping[str, np.ndarray] = field(default_factory=dict)  # none of them empty
    policies: Sequence[Policy] = ()  # all that the document mentions


class MethodError(ValueError):
    """A search method does not keep to the protocol. The message says what it gave, and what it should give."""


def checked_tasks(tasks: Any, problem: Problem) -> Tasks:
    """Return the tasks of a generation with arrays as arrays. Raise MethodError for what cannot be trained."""
    agents, objectives = problem.weights.shape
    if not isinstance(tasks, Tasks):
        raise MethodError(f"tasks must return jmorl.Tasks, not {tasks!r}")
    parents = list(tasks.parents)
    if len(parents) != agents or not all(isinstance(parent, Policy) for parent in parents):
        raise MethodError(f"tasks must have a policy for each of {agents} agents as its parents, not {parents!r}")
    weights = _numbers("weights", tasks.weights, (agents, objectives))
    if (weights < 0).any() or not weights.any(axis=1).all():
        raise MethodError("the weights of a task must not be negative, and not all zero")
    shapes = {"predicted": (agents, objectives), "interval": (2, agents, objectives), "spread": (agents, objectives)}
    given = {name: getattr(tasks, name) for name in shapes}
    optional = {name: None if each is None else _numbers(name, each, shapes[name]) for name, each in given.items()}
    return Tasks(parents, weights, candidates=tasks.candidates, **optional)


def _numbers(name: str, given: Any, shape: tuple[int, ...]) -> np.ndarray:
    """Return an array of finite numbers. Raise MethodError if it is none of the shape [P, M], or [2, P, M]."""
    try:
        array = np.asarray(given)
        valid = array.shape == shape and bool(np.isfinite(array).all())
    except (TypeError, ValueError):
        valid = False
    if not valid:
        raise MethodError(f"the {name} of tasks must be finite numbers of shape {shape}, agents by objectives")
    return array


class Method(ABC, Generic[SearchState]):
    """A way to search: which policy is trained next with which weights, and what the decision maker is asked."""

    def __init__(self, problem: Problem):
        self.problem = problem

    @abstractmethod
    def initial_state(self) -> SearchState:
        """Return what the method knows before the warm-up."""

    @abstractmethod
    def tasks(self, run: RunState) -> Tasks:
        """Return what the next generation trains. `run.generation` is its number, from 1."""

    @abstractmethod
    def taken_in(self, run: RunState, offspring: Sequence[Policy], tasks: Tasks | None) -> SearchState:
        """Return the method's state with a generation's offspring [P], which `run.archive` has been offered.

        `tasks` is None in the warm-up; in paper units that comes twice, with the untrained agents first.
        """

    @abstractmethod
    def pack(self, state: SearchState) -> PackedSearch:
        """Return the state as a checkpoint keeps it."""

    @abstractmethod
    def unpack(
        self, document: Mapping[str, Any], arrays: Mapping[str, np.ndarray], policies: Mapping[int, Policy]
    ) -> SearchState:
        """Return the state that was packed, bit for bit."""

    def question(self, run: RunState) -> AnyQuestion | None:
        """Return what to ask before the next generation; None to go on. It is called again after every answer."""
        return None

    def answered(self, run: RunState, question: AnyQuestion, answer: Any) -> SearchState:
        """Return the method's state after an answer to its question; `run.choice` is what was chosen, if a policy."""
        state: SearchState = run.search
        return state

    def asking_at_once(self, state: SearchState) -> SearchState:
        """Return the state in which the next question, if there are any, comes before the next generation."""
        return state

    def with_another_user(self, state: SearchState) -> SearchState:
        """Return the state without what the decision maker has set, for somebody else."""
        return state

    def final_front(self, run: RunState) -> Sequence[Policy]:
        """Return the policies, at least one, among which the run's result is chosen."""
        return run.archive.members

    def bounds(self, state: SearchState) -> np.ndarray:
        """Return the lower bounds [M] of the part of objective space in which is searched; -inf without a bound."""
        return np.full(len(self.problem.objectives), -np.inf)

    def limits(self, state: SearchState) -> tuple[float, ...] | None:
        """Return what each objective must reach [M] by the decision maker's word, -inf: anything; None: never said."""
        return None

    def generations_to_question(self, state: SearchState) -> int | None:
        """Return how many generations end before the next question; None for a method that never asks."""
        return None

    def prospect(self, run: RunState, policy: Policy) -> Prospect | None:
        """Return what choosing a policy would mean; None if a choice changes nothing."""
        return None

    def metrics(
        self, run: RunState, utility: Utility, offspring: Sequence[Policy], tasks: Tasks | None
    ) -> Mapping[str, float | None]:
        """Return the method's own columns of a generation's metrics, the same names every time; None where unknown.

        `utility` is the decision maker's; it returns None for one that has none.
        """
        return {}

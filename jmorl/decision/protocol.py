"""The one protocol between a run and whoever decides: a question in, an answer out.

The run imports this; users implement it; neither knows the other.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Literal

import numpy as np

from envs.core import Objective
from jmorl.decision.enautilus import IntermediatePoint, State
from jmorl.search.policy import Policy, values_of

Purpose = Literal["steer", "final", "enautilus"]


@dataclass(frozen=True)
class Question:
    """Which of these policies do you prefer?

    `purpose` is "steer" at the start of a generation and "final" at the end of a run, when the
    answer is the run's result. `front` has at least one member; at the end of an interactive run
    it holds those within the bounds. "enautilus": which of the policies that the points of E-NAUTILUS
    head for; see `DecisionMaker.choose_point`.
    """

    purpose: Purpose
    generation: int  # the one about to start; at the end, the one after the last
    objectives: tuple[Objective, ...]
    front: tuple[Policy, ...]
    bounds: np.ndarray  # [M] those in force; -inf before the first choice
    previous: int | None  # id of the policy chosen last

    @property
    def values(self) -> np.ndarray:  # [N, M]
        """The objective vectors of the front."""
        return values_of(self.front)

    def policy(self, policy_id: int) -> Policy:
        """The member of the front with this id. Raises ValueError if there is none."""
        for policy in self.front:
            if policy.id == policy_id:
                return policy
        raise ValueError(f"policy {policy_id} is not among the policies shown: {[policy.id for policy in self.front]}")


@dataclass(frozen=True)
class Answer:
    """The preferred policy, by id, and what the run shall do next."""

    policy: int
    stop: bool = False  # end the run here, with this policy
    generations: int = 1  # how many generations to go on before the next question


@dataclass(frozen=True)
class PointQuestion:
    """Which of these points of E-NAUTILUS do you prefer? Or step back, or change how to go on."""

    generation: int  # whose archive this is; with `number` it names the question
    number: int  # of answers given before in this dialogue
    objectives: tuple[Objective, ...]
    front: tuple[Policy, ...]  # N members, in the order of the state's arrays
    state: State
    points: tuple[IntermediatePoint, ...]  # at least one

    @property
    def representatives(self) -> tuple[Policy, ...]:
        """The policy that each point heads for."""
        return tuple(self.front[point.representative] for point in self.points)


@dataclass(frozen=True)
class Choose:
    """Move on to a point, by its index among those shown."""

    point: int


@dataclass(frozen=True)
class Back:
    """Undo the last choices."""

    steps: int


@dataclass(frozen=True)
class Adjust:
    """Go on in another number of iterations, or with more or fewer points in each."""

    iterations_left: int  # 0: end here
    points: int


PointAnswer = Choose | Back | Adjust


class DecisionMaker(ABC):
    """Somebody, or something, that prefers one policy to another."""

    @abstractmethod
    def answer(self, question: Question) -> Answer:
        """Choose one member of the question's front."""

    def choose_point(self, question: PointQuestion) -> PointAnswer:
        """Answer a question of E-NAUTILUS; here: the point that heads for the policy preferred among them.

        A representative is a policy, so that any decision maker can judge it; an intermediate point is not, and
        the best reachable values seldom belong to a single one. All points mix the same previous point with
        their representatives in the same proportion: for a linear utility this is the best point, too.
        """
        policies = question.representatives
        which = Question(
            "enautilus", question.generation, question.objectives, policies, bounds=question.state.point, previous=None
        )
        preferred = self.answer(which).policy
        return Choose(next(index for index, policy in enumerate(policies) if policy.id == preferred))

    def utility(self, values: np.ndarray) -> np.ndarray | None:
        """Objective vectors [N, M] to utilities [N], for the metrics; None if it has no such function."""
        return None

    def satisfied(self, values: np.ndarray) -> bool:
        """Whether a run with the front `values` [N, M] may stop early."""
        return False

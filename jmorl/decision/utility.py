"""Artificial users who know what they want: the policy of greatest utility (the paper, section 4.2.1)."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from jmorl.decision.protocol import Answer, DecisionMaker, Question

Utility = Callable[[np.ndarray], np.ndarray]  # objective vectors [N, M] to utilities [N]

# The paper's artificial users: their weights of the two objectives.
USERS: Mapping[str, tuple[float, float]] = {"A": (0.5, 0.5), "B": (0.7, 0.3), "C": (0.3, 0.7)}


def linear_utility(weights: Sequence[float]) -> Utility:
    """`sum_o w_o z_o`, with M weights (the paper, eq. 2 and 5)."""
    w = np.array(weights, float)

    def utility(values: np.ndarray) -> np.ndarray:
        # Not a matrix product, which may round equal rows differently, and so break ties at random.
        return (w * values).sum(axis=1)

    return utility


def chebyshev_utility(weights: Sequence[float], utopian: Sequence[float] | None = None) -> Utility:
    """`-max_o w_o (z*_o - z_o)`, with M weights (the paper, eq. 3, for maximisation).

    z* is `utopian` [M]; without it, the ideal point of the vectors that are compared. A fixed z* gives a vector the
    same utility in every set, generation and run, but has to be known; the ideal point is always at hand, but moves
    as the front grows. There are no absolute values, so that more is never worse, even beyond z*. The paper puts z* a
    small constant above the ideal point; that matters only between almost equal utilities, and is left out.
    """
    w = np.array(weights, float)
    fixed = None if utopian is None else np.array(utopian, float)

    def utility(values: np.ndarray) -> np.ndarray:
        best = values.max(axis=0) if fixed is None else fixed
        return -(w * (best - values)).max(axis=1)

    return utility


@dataclass(frozen=True)
class UtilityUser(DecisionMaker):
    """Prefers the policy of greatest utility, and of equal ones the first.

    `comparable`: the utility of a vector does not depend on those beside it, so that it may serve as a metric.
    """

    scalarise: Utility
    comparable: bool = True

    def answer(self, question: Question) -> Answer:
        """Return the preferred member of the question's front."""
        order = np.argsort(-self.scalarise(question.values), kind="stable")
        ids = [question.front[row].id for row in order]
        return Answer(ids[0], ranking=tuple(ids) if question.form == "rank" else ())

    def utility(self, values: np.ndarray) -> np.ndarray | None:
        """Return the utilities [N] of objective vectors [N, M]; None without a utility."""
        return self.scalarise(values) if self.comparable else None

"""Artificial users who know what they want: the policy of greatest utility (the paper, section 4.2.1).

Some of them err, some change their mind, and some have limits.
"""

import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from jmorl.decision.answers import Answer
from jmorl.decision.protocol import DecisionMaker, Question

Utility = Callable[[np.ndarray], np.ndarray]  # objective vectors [N, M] to utilities [N]

# The paper's artificial users: their weights of the two objectives.
USERS: Mapping[str, tuple[float, float]] = {"A": (0.5, 0.5), "B": (0.7, 0.3), "C": (0.3, 0.7)}

CONCAVITY = 5.0  # k of the concave utility
LIMIT_PENALTY = 1000.0  # utility that each unit costs which a value is below its limit


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


def concave_utility(weights: Sequence[float], worst: Sequence[float], best: Sequence[float]) -> Utility:
    """`sum_o w_o log(1 + k u_o)`, with M weights and k = 5; u is 0 at the worst values [M] and 1 at the best [M].

    Much of one objective makes up less and less for little of another.
    """
    w, low, span = np.array(weights, float), np.array(worst, float), np.subtract(best, worst)

    def utility(values: np.ndarray) -> np.ndarray:
        return (w * np.log1p(CONCAVITY * np.maximum((values - low) / span, 0.0))).sum(axis=1)

    return utility


def limited_utility(utility: Utility, limits: Sequence[float]) -> Utility:
    """Return the utility less a large multiple of what is missing to the limits [M], -inf where there is none."""
    least = np.array(limits, float)

    def limited(values: np.ndarray) -> np.ndarray:
        return utility(values) - LIMIT_PENALTY * np.maximum(least - values, 0.0).sum(axis=1)

    return limited


@dataclass(frozen=True)
class Slips:
    """How somebody errs: at random, or by mistaking policies of almost equal utility for each other."""

    share: float = 0.0  # of answers that are one of those shown, at random
    temperature: float = 0.0  # of the softmax over utilities, in shares of their range (Bradley and Terry 1952)

    def order(self, utilities: np.ndarray, generator: np.random.Generator) -> np.ndarray:
        """Return the order of preference [N] that somebody with these utilities [N] tells."""
        if generator.random() < self.share:
            return generator.permutation(len(utilities))
        span = np.ptp(utilities) or 1.0
        # The order of utilities with Gumbel noise is that of Plackett and Luce.
        heard = utilities + self.temperature * span * generator.gumbel(size=len(utilities))
        return np.argsort(-heard, kind="stable")


@dataclass(frozen=True)
class UtilityUser(DecisionMaker):
    """Prefers the policy of greatest utility, and of equal ones the first.

    `comparable`: the utility of a vector does not depend on those beside it, so that it may serve as a metric. Slips
    depend on what is shown alone, so that the same run has the same ones. Before the generation `changes_in` the
    utility was the one called `before`. Limits [M] are told with every answer.
    """

    scalarise: Utility
    comparable: bool = True
    slips: Slips = Slips()
    before: Utility | None = None
    changes_in: int = 1
    limits: tuple[float, ...] | None = None

    def answer(self, question: Question) -> Answer:
        """Return the preferred member of the question's front."""
        early = self.before is not None and question.generation < self.changes_in
        utilities = self.before(question.values) if early and self.before else self.scalarise(question.values)
        seen = zlib.crc32(np.ascontiguousarray(question.values).tobytes())
        order = self.slips.order(utilities, np.random.default_rng([seen, question.generation]))
        ids = [question.front[row].id for row in order]
        return Answer(ids[0], ranking=tuple(ids) if question.form == "rank" else (), limits=self.limits)

    def utility(self, values: np.ndarray) -> np.ndarray | None:
        """Return the utilities [N] of objective vectors [N, M]; None without a utility."""
        return self.scalarise(values) if self.comparable else None

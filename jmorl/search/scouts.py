"""Scouts: policies trained far from the choice, where the search has stagnated.

All that lies near a choice may descend from one policy, and be stuck with its way of doing things: a car that swings
twice does not learn to swing three times. A scout starts from a policy of the warm-up and is trained towards the choice
for some generations, whatever it scores in between.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from jmorl.search.policy import Policy

ENDURANCE = 4  # generations that a scout is trained for


@dataclass(frozen=True)
class Scouts:
    """The scouts underway, and where the next ones start."""

    starts: tuple[Policy, ...] = ()  # of the warm-up; they take turns
    underway: tuple[Policy, ...] = ()
    generations: int = 0  # that those underway have been trained for
    sent: int = 0  # starts so far

    def trained_now(self, count: int) -> tuple[Policy, ...]:
        """Return the scouts to train in this generation: those underway, or else so many that start; no start, none."""
        if self.underway or not self.starts:
            return self.underway
        return tuple(self.starts[(self.sent + each) % len(self.starts)] for each in range(count))

    def after(self, offspring: Sequence[Policy]) -> "Scouts":
        """Return the scouts after a generation in which they became these policies."""
        sent = self.sent if self.underway else self.sent + len(offspring)
        generations = self.generations + 1
        if generations == ENDURANCE:
            return replace(self, underway=(), generations=0, sent=sent)
        return replace(self, underway=tuple(offspring), generations=generations, sent=sent)


def supporting_weights(chosen: np.ndarray, values: np.ndarray, weights: np.ndarray) -> int:
    """Return for which of the weights [W, M] a choice [M] loses least against the best of the values [N, M].

    Choice and values in one scale. Ties go to the first.
    """
    return int(np.argmin((values @ weights.T).max(axis=0) - weights @ chosen))

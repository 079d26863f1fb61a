"""Proposing targets in raw units from pilot runs, on other seeds than the experiment's.

A rule and no taste: for each user, the policy of greatest utility on the pooled front of both methods' pilot runs, in
units of that front's range; then relaxed in all objectives alike, in steps of 2.5 % of the range, until at least half
of the pilot runs reach it. So a target is what either method can reach, and not at once.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from jmorl.decision.utility import USERS
from jmorl.paper.analysis import generations_within, pooled_front
from jmorl.paper.plan import USER_STEPS
from jmorl.paper.record import RunRecord
from jmorl.search.bounds import within

RELAXATION = 0.025  # of the range of the pooled front
SHARE = 0.5  # of the pilot runs that reach a target
DIGITS = 3


@dataclass(frozen=True)
class Proposal:
    """A target, and how it came about."""

    user: str
    best: np.ndarray  # [M] of greatest utility on the pooled front
    target: np.ndarray  # [M]
    relaxed: float  # share of the range by which
    reached: int  # of all pilot runs

    def __str__(self) -> str:
        target, best = (", ".join(f"{value:.{DIGITS}g}" for value in values) for values in (self.target, self.best))
        return f'"{self.user}": [{target}]  best ({best}), relaxed by {self.relaxed:.1%}, {self.reached} runs reach it'


def proposals(records: Sequence[RunRecord], steps: int) -> list[Proposal]:
    """One for each of the paper's users, from at least one pilot run."""
    front = pooled_front(records, steps)
    span = np.ptp(front, axis=0)
    fronts = [_front(record, steps) for record in records]
    found = []
    for user, weights in USERS.items():
        best = front[np.argmax((front / np.where(span > 0, span, 1.0)) @ np.array(weights))]
        relaxed = 0.0
        while sum(within(each, _rounded(best - relaxed * span)).any() for each in fronts) < SHARE * len(records):
            relaxed += RELAXATION
        target = _rounded(best - relaxed * span)
        found.append(Proposal(user, best, target, relaxed, sum(bool(within(f, target).any()) for f in fronts)))
    return found


def propose(env: str, records: Mapping[str, RunRecord]) -> str:
    """The proposals for an environment, as text."""
    if not records:
        return f"{env}: no pilot runs yet"
    steps = min(USER_STEPS[env], *(int(record.steps[-1]) for record in records.values()))
    seeds = sorted({record.config["seed"] for record in records.values()})
    lines = map(str, proposals(list(records.values()), steps))
    return "\n".join([f"{env}, from {len(records)} runs with seeds {seeds}, after {steps} steps:", *lines])


def _front(record: RunRecord, steps: int) -> np.ndarray:  # [N, M]
    return record.values[list(record.generations[generations_within(record, steps) - 1].front)]


def _rounded(values: np.ndarray) -> np.ndarray:
    return np.array([float(f"{value:.{DIGITS}g}") for value in values])

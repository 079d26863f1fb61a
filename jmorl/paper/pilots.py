"""Proposals of targets in raw units, from pilot runs, on other seeds than the experiment's.

A rule and no taste: for each user, the policy of greatest utility on the pooled front of all runs of both methods, in
units of that front's range; then relaxed in all objectives alike, in steps of 2.5 % of the range, until it is reached
by at least half of each method's runs: the interactive ones for that user, and as many of PGMORL. Such a target is
within reach of either method. Whether it is reached by the warm-up alone, and so measures nothing, is said with it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from jmorl.decision.utility import USERS
from jmorl.experiments.record import RunRecord
from jmorl.paper.analysis import generations_within, pooled_front
from jmorl.paper.plan import METHODS, USER_STEPS
from jmorl.search.bounds import within

RELAXATION = 0.025  # of the range of the pooled front
SHARE = 0.5  # of each method's pilot runs that reach a target
DIGITS = 3

Runs = Mapping[str, Sequence[RunRecord]]  # method -> its pilot runs for a user


@dataclass(frozen=True)
class Proposal:
    """A target, and how it came about."""

    user: str
    best: np.ndarray  # [M] of greatest utility on the pooled front
    target: np.ndarray  # [M]
    relaxed: float  # share of the range by which
    reached: Mapping[str, int]  # method -> runs
    runs: int  # of each method
    at_once: int  # runs of both methods that reach it with the warm-up

    def __str__(self) -> str:
        target, best = (", ".join(f"{value:.{DIGITS}g}" for value in values) for values in (self.target, self.best))
        reached = " and ".join(f"{count} of {self.runs} {method} runs" for method, count in self.reached.items())
        text = f'"{self.user}": [{target}]  best ({best}), relaxed by {self.relaxed:.1%}, {reached} reach it'
        return text + (f"; NOT USABLE: {self.at_once} reach it with the warm-up alone" if self.at_once else "")


def proposals(records: Sequence[RunRecord], steps: int) -> list[Proposal]:
    """Return a proposal for each of the paper's users that has runs of both methods."""
    whole = [record for record in records if record.fault is None]
    front = pooled_front(whole, steps)
    by_user = {user: _of(whole, user) for user in USERS}
    return [_proposal(user, runs, front, steps) for user, runs in by_user.items() if all(runs.values())]


def _of(whole: Sequence[RunRecord], user: str) -> Runs:
    """Return equally many runs of each method: those of this user, and of PGMORL, which has no user."""
    runs = {
        method: [r for r in whole if r.config["method"] == method and (method == "pgmorl" or r.config["user"] == user)]
        for method in METHODS
    }
    fewest = min(map(len, runs.values()))
    return {method: some[:fewest] for method, some in runs.items()}


def _proposal(user: str, runs: Runs, front: np.ndarray, steps: int) -> Proposal:
    pooled = [record for some in runs.values() for record in some]
    extent = np.ptp(front, axis=0)
    span = np.where(extent > 0, extent, np.maximum(np.abs(front[0]), 1.0))
    best = front[np.argmax((front / span) @ np.array(USERS[user]))]
    relaxed = 0.0
    while not _by_half(runs, _rounded(best - relaxed * span), steps):
        relaxed += RELAXATION
    target = _rounded(best - relaxed * span)
    reached = {method: _reaching(some, target, steps) for method, some in runs.items()}
    at_once = sum(_has(record, target, 0) for record in pooled)
    return Proposal(user, best, target, relaxed, reached, len(pooled) // len(runs), at_once)


def _by_half(runs: Runs, target: np.ndarray, steps: int) -> bool:
    return all(_reaching(some, target, steps) >= SHARE * len(some) for some in runs.values())


def _reaching(records: Sequence[RunRecord], target: np.ndarray, steps: int) -> int:
    return sum(_has(record, target, generations_within(record, steps) - 1) for record in records)


def _has(record: RunRecord, target: np.ndarray, generation: int) -> bool:
    """Say whether the archive has a policy as good as the target after a generation."""
    return bool(within(record.values[list(record.generations[generation].front)], target).any())


def propose(env: str, records: Mapping[str, RunRecord]) -> str:
    """Write the proposals for an environment."""
    whole = [record for record in records.values() if record.fault is None]
    if not whole:
        return f"{env}: no pilot runs yet"
    steps = min(USER_STEPS[env], *(record.total_steps for record in whole))
    seeds = sorted({record.config["seed"] for record in whole})
    lines = [str(each) for each in proposals(whole, steps)] or ["runs of one of the methods are missing"]
    return "\n".join([f"{env}, from {len(whole)} runs with seeds {seeds}, after {steps} steps:", *lines])


def _rounded(values: np.ndarray) -> np.ndarray:
    return np.array([float(f"{value:.{DIGITS}g}") for value in values])

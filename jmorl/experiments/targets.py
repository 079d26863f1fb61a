"""Steps to a target: when each run reaches it, and what one contender saves against another.

Letters: S runs, one a seed; M objectives.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jmorl.experiments.record import RunRecord
from jmorl.experiments.statistics import Difference, Times, saved
from jmorl.search.bounds import within


@dataclass(frozen=True)
class Reached:
    """The first generation of a run whose archive reaches a target."""

    generation: int
    steps: int
    seconds: float  # compilation not counted
    policies: tuple[int, ...]  # ids of those in the archive that reach it
    policy: int  # id of the one among them that clears it by most in its tightest objective


def reached(record: RunRecord, target: Sequence[float], cap: float = np.inf) -> Reached | None:
    """Return the first generation with a policy at least as good as the target [M] in every objective.

    None if no such generation ends within `cap` steps.
    """
    for number, generation in enumerate(record.generations):
        ids = np.array(generation.front)
        values = record.values[ids]
        inside = within(values, np.array(target))
        if generation.steps <= cap and inside.any():
            margins = np.where(inside, (values - target).min(axis=1), -np.inf)
            return Reached(
                number,
                generation.steps,
                float(record.seconds[number]),
                tuple(ids[inside].tolist()),
                int(ids[np.argmax(margins)]),
            )
    return None


@dataclass(frozen=True)
class TargetRow:
    """The runs of one contender on its way to one target."""

    target: str
    values: tuple[float, ...]  # [M] the target
    method: str  # the contender's name
    seeds: tuple[int, ...]  # [S] those there are
    records: tuple[RunRecord, ...]  # [S]
    found: tuple[Reached | None, ...]  # [S]
    times: Times

    @property
    def hits(self) -> list[tuple[RunRecord, Reached]]:
        """The runs that reached the target."""
        return [(record, hit) for record, hit in zip(self.records, self.found, strict=True) if hit]

    @property
    def late(self) -> list[RunRecord]:
        """The runs that did not reach the target, without those that broke down before they had a generation."""
        runs = zip(self.records, self.found, strict=True)
        return [record for record, hit in runs if hit is None and record.generations]

    @property
    def faults(self) -> int:
        """The number of runs that broke down."""
        return sum(record.fault is not None for record in self.records)

    @property
    def seconds(self) -> float:
        """Mean time until the target was reached, or the budget used up; compilation not counted."""
        runs = zip(self.records, self.found, strict=True)
        return float(np.mean([hit.seconds if hit else record.total_seconds for record, hit in runs]))


def target_row(
    target: str, values: Sequence[float], method: str, seeds: Sequence[int], records: Sequence[RunRecord], cap: int
) -> TargetRow:
    """Make the row of at least one run, in the order of the seeds.

    A run's last generation is a whole one; what it finds after `cap` steps is too late.
    """
    found = tuple(reached(record, values, cap) for record in records)
    times = Times(tuple(hit.steps if hit else None for hit in found), cap)
    return TargetRow(target, tuple(values), method, tuple(seeds), tuple(records), found, times)


def compared(one: TargetRow, other: TargetRow) -> Difference | None:
    """Return the steps that the first saves against the second on the seeds of both; None if they share no seed."""
    common = [seed for seed in one.seeds if seed in other.seeds]
    return saved(_on(one, common), _on(other, common)) if common else None


def _on(row: TargetRow, seeds: Sequence[int]) -> Times:
    """Return the row's times on these seeds, in their order."""
    return Times(tuple(row.times.reached[row.seeds.index(seed)] for seed in seeds), row.times.budget)

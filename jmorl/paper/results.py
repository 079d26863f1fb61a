"""The results of an item in one kind of units: from its cells' records, as far as there are any."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from jmorl.paper.analysis import (
    Finals,
    Reached,
    finals,
    greatest_utility,
    mean_utility,
    reached,
    steps_within,
)
from jmorl.paper.plan import METHODS, Cell, Item, Plan
from jmorl.paper.record import RunRecord
from jmorl.paper.statistics import Interval, Times, interval, saved

Records = Mapping[str, RunRecord]  # by the cell's key


@dataclass(frozen=True)
class TargetRow:
    """One method on its way to one target."""

    target: str
    values: tuple[float, ...]  # [M] the target
    method: str
    seeds: tuple[int, ...]  # [S] those there are
    records: tuple[RunRecord, ...]  # [S]
    found: tuple[Reached | None, ...]  # [S]
    times: Times

    @property
    def raw(self) -> np.ndarray:  # [successes, M]
        """The mean undiscounted returns of the policies that reached the target."""
        hits = [record.raw[hit.policy] for record, hit in zip(self.records, self.found, strict=True) if hit]
        return np.array(hits).reshape(-1, len(self.values))

    @property
    def seconds(self) -> float:
        """Mean time until the target was reached, or the budget used up; compilation not counted."""
        ends = [
            hit.seconds if hit else record.seconds[-1] for record, hit in zip(self.records, self.found, strict=True)
        ]
        return float(np.mean(ends))

    @property
    def drifted(self) -> int:
        """How many successes are of policies that had not reached the target in the units after the warm-up."""
        return sum(1 for hit in self.found if hit and not hit.without_drift)


def target_row(
    target: str, values: Sequence[float], method: str, seeds: Sequence[int], records: Sequence[RunRecord], budget: int
) -> TargetRow:
    """A row of at least one run; `budget` is what the runs really make."""
    found = tuple(reached(record, values) for record in records)
    times = Times(tuple(hit.steps if hit else None for hit in found), budget)
    return TargetRow(target, tuple(values), method, tuple(seeds), tuple(records), found, times)


def compared(one: TargetRow, other: TargetRow) -> Interval | None:
    """Steps that the first saves against the second on the seeds that both have; None if there is none."""
    common = [seed for seed in one.seeds if seed in other.seeds]
    if not common:
        return None
    pair = (_on(row, common) for row in (one, other))
    return saved(*pair)


def _on(row: TargetRow, seeds: Sequence[int]) -> Times:
    return Times(tuple(row.times.reached[row.seeds.index(seed)] for seed in seeds), row.times.budget)


def target_rows(plan: Plan, item: Item, units: str, records: Records) -> list[TargetRow]:
    """A row for each target and method that has a run."""
    rows = []
    for name, values in (plan.targets(item.env, units) or {}).items():
        for method in METHODS:
            cells = {seed: cell_of(plan, item, units, method, name, seed) for seed in plan.seeds_of(item)}
            there = {seed: records[cell.key] for seed, cell in cells.items() if cell.key in records}
            if there:
                budget = steps_within(next(iter(cells.values())).config, plan.steps(item))
                rows.append(target_row(name, values, method, tuple(there), tuple(there.values()), budget))
    return rows


def cell_of(plan: Plan, item: Item, units: str, method: str, goal: str, seed: int) -> Cell:
    return plan.pgmorl(item, units, seed) if method == "pgmorl" else plan.interactive(item, units, goal, seed)


@dataclass(frozen=True)
class Curves:
    """A utility over the steps of the runs of one method, for one user."""

    user: str
    method: str
    seeds: tuple[int, ...]  # [S]
    steps: np.ndarray  # [G + 1]
    utility: np.ndarray  # [S, G + 1]
    bounded: np.ndarray  # [S, G + 1] within the bounds only; the same where there are none

    @property
    def last(self) -> np.ndarray:  # [S]
        return self.utility[:, -1]


def curves(plan: Plan, item: Item, units: str, records: Records) -> list[Curves]:
    """For each user and method that has a run; of the archive's best, or of the buffer's mean."""
    found = []
    for user, weights in plan.user_weights(item, units).items():
        for method in METHODS:
            cells = {seed: cell_of(plan, item, units, method, user, seed) for seed in plan.seeds_of(item)}
            there = {seed: records[cell.key] for seed, cell in cells.items() if cell.key in records}
            if there:
                found.append(_curves(user, method, there, weights, item, plan.steps(item)))
    return found


def _curves(
    user: str, method: str, runs: Mapping[int, RunRecord], weights: Sequence[float], item: Item, steps: int
) -> Curves:
    if item.kind == "greatest utility":
        utility = bounded = np.stack([greatest_utility(run, weights, steps) for run in runs.values()])
    else:
        utility = np.stack([mean_utility(run, weights, steps) for run in runs.values()])
        bounded = np.stack([mean_utility(run, weights, steps, bounded=True) for run in runs.values()])
    first = next(iter(runs.values()))
    return Curves(user, method, tuple(runs), first.steps[: utility.shape[1]], utility, bounded)


def advantage(one: Curves, other: Curves) -> Interval | None:
    """How much more the first has at the end, on the seeds that both have; None if there is none."""
    pairs = [
        one.last[one.seeds.index(seed)] - other.last[other.seeds.index(seed)]
        for seed in one.seeds
        if seed in other.seeds
    ]
    return interval(pairs) if pairs else None


def final_policies(plan: Plan, item: Item, units: str, records: Records) -> dict[str, Finals]:
    """For each user for whom both methods have all their runs: pooling is over all seeds."""
    found = {}
    seeds = plan.seeds_of(item)
    for user, weights in plan.user_weights(item, units).items():
        pair = [
            [records.get(cell_of(plan, item, units, method, user, seed).key) for seed in seeds] for method in METHODS
        ]
        interactive, pgmorl = ([record for record in each if record] for each in pair)
        if len(interactive) == len(pgmorl) == len(seeds):
            found[user] = finals(interactive, pgmorl, weights, plan.steps(item))
    return found

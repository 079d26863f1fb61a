"""The results of an item in one kind of units: from its cells' records, as far as there are any."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from jmorl.experiments.record import RunRecord
from jmorl.experiments.statistics import Difference, difference
from jmorl.experiments.targets import TargetRow, compared, target_row
from jmorl.paper.analysis import Finals, buffer_utility, finals, greatest_utility, offspring_utility
from jmorl.paper.plan import METHODS, Item, Plan

Records = Mapping[str, RunRecord]  # by the cell's key


@dataclass(frozen=True)
class Pair:
    """The interactive method and what it is compared with, on one target: the better row of PGMORL."""

    interactive: TargetRow
    baseline: TargetRow
    others: tuple[TargetRow, ...]  # PGMORL's other rows
    difference: Difference  # steps that the interactive method saves

    @property
    def rows(self) -> tuple[TargetRow, TargetRow]:
        """Both rows."""
        return self.interactive, self.baseline


def pair_of(rows: Sequence[TargetRow]) -> Pair | None:
    """Return the pair of one target's rows; None if runs of one of the methods are missing.

    Better is what reaches the target more often, then with fewer steps.
    """
    ours = [row for row in rows if row.method == "interactive"]
    theirs = [row for row in rows if row.method != "interactive" and ours and compared(ours[0], row)]
    if not theirs:
        return None
    best = max(theirs, key=lambda row: (row.times.successes / len(row.seeds), -row.times.restricted_mean.mean))
    found = compared(ours[0], best)
    assert found is not None
    return Pair(ours[0], best, tuple(row for row in theirs if row is not best), found)


def target_rows(plan: Plan, item: Item, units: str, records: Records) -> list[TargetRow]:
    """Return a row for each target and method that has a run."""
    rows = []
    for name, values in plan.targets(item.env, units).items():
        for method in plan.methods(item, units):
            there = _there(plan, item, units, method, name, records)
            if there:
                rows.append(target_row(name, values, method, tuple(there), tuple(there.values()), plan.steps(item)))
    return rows


def _there(plan: Plan, item: Item, units: str, method: str, goal: str, records: Records) -> dict[int, RunRecord]:
    """Return the runs there are, by seed."""
    keys = {seed: plan.cell(item, units, method, goal, seed).key for seed in plan.seeds_of(item)}
    return {seed: records[key] for seed, key in keys.items() if key in records}


@dataclass(frozen=True)
class Curves:
    """A utility over the steps of the runs of one method, for one user. Runs that broke down are left out."""

    user: str
    method: str
    seeds: tuple[int, ...]  # [S]
    steps: np.ndarray  # [G + 1]
    utility: np.ndarray  # [S, G + 1] of the archive's best, or the mean of the policies just trained
    records: tuple[RunRecord, ...] = ()  # [S]
    buffer: np.ndarray | None = None  # [S, G + 1] mean of the performance buffer, where that is the item's subject
    bounded: np.ndarray | None = None  # [S, G + 1] and of its members within the bounds; NaN without any

    @property
    def last(self) -> np.ndarray:  # [S]
        """The last values [S]."""
        return self.utility[:, -1]

    @property
    def course(self) -> np.ndarray:  # [G + 1]
        """Mean over the seeds."""
        return np.asarray(self.utility.mean(axis=0))


def curves(plan: Plan, item: Item, units: str, records: Records) -> list[Curves]:
    """Return the curves of each user and method that has a run."""
    found = []
    for user, weights in plan.user_weights(item, units).items():
        for method in plan.methods(item, units):
            there = _there(plan, item, units, method, user, records)
            whole = {seed: record for seed, record in there.items() if record.fault is None}
            if whole:
                found.append(curves_of(user, method, whole, weights, item, plan.steps(item)))
    return found


def curves_of(
    user: str, method: str, runs: Mapping[int, RunRecord], weights: Sequence[float], item: Item, steps: int
) -> Curves:
    """Return the curve of at least one run, none of which broke down."""
    some = tuple(runs.values())
    buffer = bounded = None
    if item.kind == "greatest utility":
        utility = np.stack([greatest_utility(run, weights, steps) for run in some])
    else:
        utility = np.stack([offspring_utility(run, weights, steps) for run in some])
        buffer = np.stack([buffer_utility(run, weights, steps) for run in some])
        bounded = np.stack([buffer_utility(run, weights, steps, bounded=True) for run in some])
    return Curves(user, method, tuple(runs), some[0].steps[: utility.shape[1]], utility, some, buffer, bounded)


def advantage(one: Curves, other: Curves) -> Difference | None:
    """Return how much more the first has at the end, on the seeds of both; None if they share no seed."""
    pairs = [
        one.last[one.seeds.index(seed)] - other.last[other.seeds.index(seed)]
        for seed in one.seeds
        if seed in other.seeds
    ]
    return difference(pairs) if pairs else None


def curve_pairs(rows: Sequence[Curves]) -> Iterator[tuple[Curves, Curves, Difference]]:
    """Yield for each user with runs of both the interactive method, PGMORL's highest-ending row, and the advantage."""
    for user in dict.fromkeys(row.user for row in rows):
        ours = [row for row in rows if row.user == user and row.method == "interactive"]
        theirs = [row for row in rows if row.user == user and row.method != "interactive"]
        if ours and theirs:
            best = max(theirs, key=lambda row: float(row.last.mean()))
            found = advantage(ours[0], best)
            if found:
                yield ours[0], best, found


def final_policies(plan: Plan, item: Item, units: str, records: Records) -> dict[str, Finals]:
    """Return the final policies of each user for whom both methods have all their runs: pooling is over all seeds."""
    found = {}
    seeds = plan.seeds_of(item)
    for user, weights in plan.user_weights(item, units).items():
        interactive, pgmorl = (
            [run for run in _there(plan, item, units, method, user, records).values() if run.fault is None]
            for method in METHODS
        )
        if len(interactive) == len(pgmorl) == len(seeds):
            found[user] = finals(interactive, pgmorl, weights, plan.steps(item))
    return found

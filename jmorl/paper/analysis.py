"""Analysis of records: the numbers that the tables and figures show.

Letters: S runs, G generations, N policies, M objectives.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from envs import make
from jmorl.config import Config
from jmorl.decision.navigation import run_enautilus
from jmorl.decision.utility import UtilityUser, linear_utility
from jmorl.experiments.record import RunRecord
from jmorl.paper.drift import untrained
from jmorl.search.bounds import within
from jmorl.search.pareto import non_dominated
from jmorl.search.policy import Policy, values_of
from jmorl.units import measured_in

ENAUTILUS_ITERATIONS, ENAUTILUS_POINTS = 3, 3  # the paper's


def generations_within(record: RunRecord, steps: int) -> int:
    """Count the generations of a run, the warm-up included, within a smaller or equal budget of steps."""
    iteration = Config.model_validate(record.config).steps_per_iteration
    before = record.steps[:-1] // iteration
    return 1 + int((before < steps // iteration).sum())


def seconds_within(record: RunRecord, steps: int) -> float:
    """Return the seconds that a run takes within a smaller or equal budget of steps; compilation not counted."""
    return float(record.seconds[generations_within(record, steps) - 1])


def greatest_utility(record: RunRecord, weights: Sequence[float], steps: int) -> np.ndarray:  # [G + 1]
    """Return the greatest utility in the archive after each generation (the paper's U_max)."""
    utilities = record.values @ np.array(weights)
    fronts = [generation.front for generation in record.generations[: generations_within(record, steps)]]
    return np.array([utilities[list(front)].max() for front in fronts])


def offspring_utility(record: RunRecord, weights: Sequence[float], steps: int) -> np.ndarray:  # [G + 1]
    """Return the mean utility of the policies just trained, in each generation. No bounds filter or sort them."""
    utilities, born = record.values @ np.array(weights), record.born
    trained = ~untrained(record)
    return np.array([utilities[(born == g) & trained].mean() for g in range(generations_within(record, steps))])


def buffer_utility(record: RunRecord, weights: Sequence[float], steps: int, bounded: bool = False) -> np.ndarray:
    """Return the mean utility of the performance buffer after each generation [G + 1], which the authors measure.

    With the scale "range" the bounds decide how the interactive method's buffer is sorted, so that it is not the same
    kind of set for every method. `bounded`: of its members within the bounds only, as the authors take it for the
    interactive method; NaN where there are none.
    """
    utilities = record.values @ np.array(weights)
    means = []
    for number in range(generations_within(record, steps)):
        ids = np.array(record.generations[number].buffer)
        if bounded:
            ids = ids[within(record.values[ids], record.bounds(number))]
        means.append(utilities[ids].mean() if len(ids) else np.nan)
    return np.array(means)


@dataclass(frozen=True)
class Finals:
    """Final policies of one user: where each interactive run ended, and where E-NAUTILUS led on the pooled archives."""

    interactive: np.ndarray  # [S, M]
    kept: np.ndarray  # [S] bool: not dominated by another final policy of either method
    enautilus: np.ndarray  # [M]
    enautilus_kept: bool
    pooled: np.ndarray  # [N, M] PGMORL's archives, Pareto-filtered
    runs: tuple[RunRecord, ...]  # [S] the interactive ones
    sources: tuple[RunRecord, ...]  # whose archives are pooled

    @property
    def everything(self) -> np.ndarray:  # [S + 1, M]
        """The policies of both methods."""
        return np.vstack([self.interactive, self.enautilus])


def finals(
    interactive: Sequence[RunRecord], pgmorl: Sequence[RunRecord], weights: Sequence[float], steps: int
) -> Finals:
    """Compare the final policies of a user with these weights, of runs that have ended."""
    pooled = pooled_front(pgmorl, steps)
    chosen = np.stack([record.values[record.chosen] for record in interactive if record.chosen is not None])
    navigated = pooled[_enautilus(pooled, pgmorl[0], weights)]
    both = non_dominated_or_equal(np.vstack([chosen, navigated]))
    return Finals(chosen, both[:-1], navigated, bool(both[-1]), pooled, tuple(interactive), tuple(pgmorl))


def pooled_front(records: Sequence[RunRecord], steps: int) -> np.ndarray:  # [N, M]
    """Return the non-dominated values of all archives together, as they were after `steps`."""
    last = [record.generations[generations_within(record, steps) - 1] for record in records]
    pooled = np.vstack([record.values[list(each.front)] for record, each in zip(records, last, strict=True)])
    return pooled[non_dominated(pooled)]


def non_dominated_or_equal(values: np.ndarray) -> np.ndarray:  # [N] bool
    """Return which vectors [N, M] no other dominates; equal ones do not dominate each other."""
    as_good = (values[:, None] >= values[None]).all(axis=2)
    better = (values[:, None] > values[None]).any(axis=2)
    return np.asarray(~(as_good & better).any(axis=0))


def _enautilus(front: np.ndarray, record: RunRecord, weights: Sequence[float]) -> int:
    """Return the row of the front [N, M] that a user with these weights is led to, in 3 iterations of 3 points."""
    nothing = np.zeros(front.shape[1])
    policies = tuple(Policy(row, 0, None, nothing, z, nothing, nothing, None) for row, z in enumerate(front))
    config = Config.model_validate(record.config)
    objectives = measured_in(config.evaluation.units, make(config.env).objectives)
    user = UtilityUser(linear_utility(weights))
    chosen = run_enautilus(policies, objectives, user.choose_point, ENAUTILUS_ITERATIONS, ENAUTILUS_POINTS, 0)
    assert np.array_equal(values_of(policies)[chosen.id], front[chosen.id])
    return chosen.id

"""Drift: how units that move during a run change its results, and the successes of runs to a target.

Letters: N policies, M objectives.
"""

from collections.abc import Sequence

import numpy as np

from jmorl.config import Config
from jmorl.experiments.record import RunRecord
from jmorl.experiments.targets import TargetRow
from jmorl.search.bounds import within


def untrained(record: RunRecord) -> np.ndarray:  # [N] bool
    """Return which policies were scored before the warm-up, as is done in paper units: they come first."""
    agents = Config.model_validate(record.config).population.agents
    number = max(int((record.born == 0).sum()) - agents, 0)
    return np.arange(len(record.policies)) < number


def in_warm_up_units(record: RunRecord) -> np.ndarray:  # [N, M]
    """Return all scores as they would be with the sigma after the warm-up; in raw units as they are.

    A score is a mean discounted return over the sigma it was scored with, so that the return over the warm-up's is what
    it would be there, but for rewards that were clipped. Where a record has no discounted returns, a score's sigma is
    taken to be that at the end of its generation.
    """
    if all(None in generation.sigma for generation in record.generations):
        return record.values
    sigma = np.array([generation.sigma for generation in record.generations], float)  # [G + 1, M]
    scored_with = record.values * sigma[record.born] / sigma[0]
    known = [policy.discounted for policy in record.policies]
    return np.array([scored_with[row] if each is None else np.array(each) / sigma[0] for row, each in enumerate(known)])


def reached_without_drift(record: RunRecord, target: Sequence[float], generation: int) -> bool:
    """Say whether a trained policy found by then is as good as the target in the units after the warm-up."""
    found = (record.born <= generation) & ~untrained(record)
    return bool(within(in_warm_up_units(record)[found], np.array(target)).any())


def sigma_at(record: RunRecord, generation: int) -> np.ndarray:  # [M]
    """Return sigma after a generation, in paper units."""
    return np.array(record.generations[generation].sigma, float)


def common_generation(records: Sequence[RunRecord]) -> int:
    """Return the last generation that all of these runs have: after it sigma is compared at equally many steps."""
    return min(len(record.generations) for record in records) - 1


def drifted(row: TargetRow) -> int:
    """Count the successes that no trained policy found by then has in the units after the warm-up."""
    return sum(not reached_without_drift(record, row.values, hit.generation) for record, hit in row.hits)


def at_the_start(row: TargetRow) -> int:
    """Count the successes with generation 0, before anything was asked or selected."""
    return sum(hit.generation == 0 for _, hit in row.hits)


def by_untrained(row: TargetRow) -> int:
    """Count the successes of policies that were never trained."""
    return sum(bool(untrained(record)[list(hit.policies)].all()) for record, hit in row.hits)


def prevented(row: TargetRow) -> int:
    """Count the runs that never arrived and have a trained policy that would do in the units after the warm-up."""
    return sum(reached_without_drift(record, row.values, len(record.generations)) for record in row.late)

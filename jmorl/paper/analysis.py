"""From the records of runs to what tables and figures show.

Letters: S runs, G generations, N policies, M objectives.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from envs import make
from jmorl.config import Config
from jmorl.decision.navigation import run_enautilus
from jmorl.decision.utility import UtilityUser, linear_utility
from jmorl.paper.record import RunRecord
from jmorl.search.bounds import within
from jmorl.search.pareto import non_dominated
from jmorl.search.policy import Policy, values_of
from jmorl.units import measured_in

ENAUTILUS_ITERATIONS, ENAUTILUS_POINTS = 3, 3  # the paper's


@dataclass(frozen=True)
class Reached:
    """When and how a run reached a target first."""

    generation: int
    steps: int
    seconds: float  # compilation not counted
    policy: int  # id: of those that reached it, the one that clears it by most in its tightest objective
    without_drift: bool  # whether it had reached it in the units after the warm-up, too


def reached(record: RunRecord, target: Sequence[float]) -> Reached | None:
    """The first generation whose archive has a policy at least as good as the target in every objective."""
    for number, generation in enumerate(record.generations):
        ids = np.array(generation.front)
        values = record.values[ids]
        inside = within(values, np.array(target))
        if inside.any():
            margins = np.where(inside, (values - target).min(axis=1), -np.inf)
            policy = int(ids[np.argmax(margins)])
            drift = drift_of(record, record.policies[policy].generation)
            undrifted = bool((record.values[policy] * drift >= target).all())
            return Reached(number, generation.steps, float(record.seconds[number]), policy, undrifted)
    return None


def drift_of(record: RunRecord, generation: int) -> np.ndarray:  # [M]
    """By how much sigma has grown since the warm-up. A score divides by it, so that this takes the growth out again.

    One in raw units. The correction is one of scale only: what was clipped stays so.
    """
    sigma = record.generations[generation].sigma
    if None in sigma:
        return np.ones(len(sigma))
    first = np.array(record.generations[0].sigma, float)
    return np.array(np.array(sigma, float) / first)


def steps_within(config: Config, steps: int) -> int:
    """How many steps a run really makes with a budget of `steps`: its last generation is a whole one."""
    budget, warm_up = steps // config.steps_per_iteration, config.population.warmup_iterations
    generations = -(-max(budget - warm_up, 0) // config.population.iterations)
    return (warm_up + generations * config.population.iterations) * config.steps_per_iteration


def generations_within(record: RunRecord, steps: int) -> int:
    """How many generations, the warm-up included, the run has within a smaller or equal budget of steps."""
    iteration = Config.model_validate(record.config).steps_per_iteration
    before = record.steps[:-1] // iteration
    return 1 + int((before < steps // iteration).sum())


def greatest_utility(record: RunRecord, weights: Sequence[float], steps: int) -> np.ndarray:  # [G + 1]
    """Of the archive, after each generation (the paper's U_max)."""
    utilities = record.values @ np.array(weights)
    fronts = [generation.front for generation in record.generations[: generations_within(record, steps)]]
    return np.array([utilities[list(front)].max() for front in fronts])


def mean_utility(record: RunRecord, weights: Sequence[float], steps: int, bounded: bool = False) -> np.ndarray:
    """Of the performance buffer, after each generation [G + 1]: the same set for every method.

    `bounded`: of its members within the bounds only, as the authors take it for the interactive method, which favours
    that by construction; NaN where there are none.
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


def finals(
    interactive: Sequence[RunRecord], pgmorl: Sequence[RunRecord], weights: Sequence[float], steps: int
) -> Finals:
    """Compare the final policies of a user with these weights."""
    pooled = pooled_front(pgmorl, steps)
    chosen = np.stack([record.values[record.chosen] for record in interactive])
    navigated = pooled[_enautilus(pooled, pgmorl[0], weights)]
    both = non_dominated_or_equal(np.vstack([chosen, navigated]))
    return Finals(chosen, both[:-1], navigated, bool(both[-1]), pooled)


def pooled_front(records: Sequence[RunRecord], steps: int) -> np.ndarray:  # [N, M]
    """What is not dominated of all archives as they were after so many steps."""
    last = [record.generations[generations_within(record, steps) - 1] for record in records]
    pooled = np.vstack([record.values[list(each.front)] for record, each in zip(records, last, strict=True)])
    return pooled[non_dominated(pooled)]


def non_dominated_or_equal(values: np.ndarray) -> np.ndarray:  # [N] bool
    """Which vectors [N, M] no other dominates; equal ones do not dominate each other."""
    as_good = (values[:, None] >= values[None]).all(axis=2)
    better = (values[:, None] > values[None]).any(axis=2)
    return np.asarray(~(as_good & better).any(axis=0))


def _enautilus(front: np.ndarray, record: RunRecord, weights: Sequence[float]) -> int:
    """The row of the front [N, M] that a user with these weights is led to, in 3 iterations of 3 points."""
    nothing = np.zeros(front.shape[1])
    policies = tuple(Policy(row, 0, None, nothing, z, nothing, nothing, None) for row, z in enumerate(front))
    config = Config.model_validate(record.config)
    objectives = measured_in(config.evaluation.units, make(config.env).objectives)
    user = UtilityUser(linear_utility(weights))
    chosen = run_enautilus(policies, objectives, user.choose_point, ENAUTILUS_ITERATIONS, ENAUTILUS_POINTS, 0)
    assert np.array_equal(values_of(policies)[chosen.id], front[chosen.id])
    return chosen.id


@dataclass(frozen=True)
class Mechanism:
    """Why a search gets on or not: medians and means over the generations of runs, the warm-up left out."""

    candidates: float  # median number of policies that could be continued
    alone: float  # share of generations with nothing but the choice to continue
    repeated: float  # share of questions answered with the choice before; NaN without questions
    predicted_gain: float  # mean over offspring and objectives, in units of the archive's final range
    realised_gain: float


def mechanism(records: Sequence[RunRecord]) -> Mechanism:
    """Over all generations of the runs."""
    candidates = [generation.candidates for record in records for generation in record.generations[1:]]
    repeated: list[bool] = []
    predicted: list[float] = []
    realised: list[float] = []
    for record in records:
        chosen = [question.chosen for question in record.questions]
        repeated += [one == other for one, other in zip(chosen, chosen[1:], strict=False)]
        front = record.values[list(record.generations[-1].front)]
        span = np.where(np.ptp(front, axis=0) > 0, np.ptp(front, axis=0), 1.0)
        for policy in record.policies:
            if policy.predicted is not None and policy.parent is not None:
                before = record.values[policy.parent]
                predicted.append(float(((np.array(policy.predicted) - before) / span).mean()))
                realised.append(float(((np.array(policy.values) - before) / span).mean()))
    return Mechanism(
        float(np.median(candidates)) if candidates else np.nan,
        float(np.mean(np.array(candidates) <= 1)) if candidates else np.nan,
        float(np.mean(repeated)) if repeated else np.nan,
        float(np.mean(predicted)) if predicted else np.nan,
        float(np.mean(realised)) if realised else np.nan,
    )


def questions_asked(records: Sequence[RunRecord]) -> float:
    """Mean over runs, the final question included."""
    return float(np.mean([len(record.questions) for record in records]))


def seconds_between_questions(records: Sequence[RunRecord]) -> float:
    """Median time a person would have waited from an answer to the next question: one generation."""
    return float(np.median([each.seconds for record in records for each in record.generations[1:]] or [np.nan]))

"""How a search is doing after a generation: one row of the metrics file."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from jmorl.search.bounds import within
from jmorl.search.pareto import expected_utility, hypervolume, sparsity
from jmorl.search.policy import Policy, values_of
from jmorl.search.scaling import Scale

Utility = Callable[[np.ndarray], np.ndarray | None]  # [N, M] -> [N], or None


@dataclass(frozen=True)
class FrontMetrics:
    """Quality of a front in raw units."""

    front_size: int
    hypervolume: float  # above the run's reference point; of a large front approximate, see `pareto.hypervolume`
    expected_utility: float  # mean over an even grid of linear weights
    sparsity: float


@dataclass(frozen=True)
class UtilityMetrics:
    """What the decision maker's utility says; None for one without a utility.

    The population of the paper's equations 6 and 7 is the performance buffer, for every method.
    """

    utility_max: float | None  # of the archive
    utility_mean: float | None  # of the whole buffer
    utility_mean_within_bounds: float | None  # of its members within the bounds, as the paper's interactive arm


@dataclass(frozen=True)
class PredictionMetrics:
    """How good the prediction model was, in units of the archive's range; None in the warm-up."""

    prediction_error: float | None  # mean absolute difference of predicted and realised values
    realized_change: float | None  # that of parents and children: the error of predicting no change


def front_metrics(values: np.ndarray, reference: np.ndarray, weights: np.ndarray) -> FrontMetrics:
    """Metrics of the front [N, M] with reference point [M] and the grid of weights [W, M]."""
    return FrontMetrics(
        len(values), hypervolume(values, reference), expected_utility(values, weights), sparsity(values)
    )


def utility_metrics(
    utility: Utility, archive: Sequence[Policy], buffer: Sequence[Policy], bounds: np.ndarray
) -> UtilityMetrics:
    """Metrics of archive and buffer, at least one policy each, under a utility."""
    best, all_utilities = utility(values_of(archive)), utility(values_of(buffer))
    if best is None or all_utilities is None:
        return UtilityMetrics(None, None, None)
    inside = all_utilities[within(values_of(buffer), bounds)]
    return UtilityMetrics(float(best.max()), float(all_utilities.mean()), float(inside.mean()) if len(inside) else None)


def prediction_metrics(parents: Sequence[Policy], offspring: Sequence[Policy], scale: Scale) -> PredictionMetrics:
    """Metrics of the predictions of a generation's offspring [P], in the archive's scale."""
    if not parents:
        return PredictionMetrics(None, None)
    realized = values_of(offspring)
    predicted = np.stack([child.predicted for child in offspring if child.predicted is not None])
    return PredictionMetrics(
        float((np.abs(predicted - realized) / scale.span).mean()),
        float((np.abs(values_of(parents) - realized) / scale.span).mean()),
    )

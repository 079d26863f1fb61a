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
    below_reference: int  # members that are not above the reference point, and so add nothing to the hypervolume


def front_metrics(values: np.ndarray, reference: np.ndarray, weights: np.ndarray) -> FrontMetrics:
    """Metrics of the front [N, M] with reference point [M] and the grid of weights [W, M]."""
    return FrontMetrics(
        len(values),
        hypervolume(values, reference),
        expected_utility(values, weights),
        sparsity(values),
        int((values <= reference).any(axis=1).sum()),
    )


def utility_metrics(utility: Utility, population: Sequence[Policy], bounds: np.ndarray) -> dict[str, float | None]:
    """Return the mean utility of a population, at least one policy, and of its members within the bounds [M].

    None for a decision maker without a utility, and where no member is within the bounds.
    """
    utilities = utility(values_of(population))
    if utilities is None:
        return {"utility_mean": None, "utility_mean_within_bounds": None}
    inside = utilities[within(values_of(population), bounds)]
    return {
        "utility_mean": float(utilities.mean()),
        "utility_mean_within_bounds": float(inside.mean()) if len(inside) else None,
    }


def prediction_metrics(parents: Sequence[Policy], offspring: Sequence[Policy], scale: Scale) -> dict[str, float | None]:
    """Return how far predictions of a generation's offspring [P] were off, in the archive's scale; None in the warm-up.

    `prediction_error` is the mean absolute difference of predicted and realised values, `realized_change` that of
    parents and children: the error of predicting no change. `interval_coverage` is the share of values in their
    intervals; None without intervals.
    """
    if not parents:
        return {"prediction_error": None, "realized_change": None, "interval_coverage": None}
    realized = values_of(offspring)
    predicted = np.stack([child.predicted for child in offspring if child.predicted is not None])
    return {
        "prediction_error": float((np.abs(predicted - realized) / scale.span).mean()),
        "realized_change": float((np.abs(values_of(parents) - realized) / scale.span).mean()),
        "interval_coverage": coverage(offspring),
    }


def coverage(offspring: Sequence[Policy]) -> float | None:
    """Return the share of the offspring's values that lie in the intervals of their predictions; None without any."""
    known = [child for child in offspring if child.interval is not None]
    if not known:
        return None
    values, ends = values_of(known), np.stack([child.interval for child in known if child.interval is not None])
    return float(((ends[:, 0] <= values) & (values <= ends[:, 1])).mean())

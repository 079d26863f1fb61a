"""The scale in which the search calculates, so that none of its constants depends on units."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from jmorl.search.bounds import within

FEW = 5  # values whose spread says nothing
HUGE = 1e300  # too large to calculate with
REFERENCE_MARGIN = 0.1  # of the range, below the worst: neither extremes nor the middle dominate a gain


@dataclass(frozen=True)
class Scale:
    """An affine map of objective vectors, each objective on its own."""

    origin: np.ndarray  # [M] is mapped to 0
    span: np.ndarray  # [M] > 0, is mapped to 1

    def apply(self, values: np.ndarray) -> np.ndarray:
        """Objective vectors [..., M] in this scale."""
        return (values - self.origin) / self.span

    def invert(self, scaled: np.ndarray) -> np.ndarray:
        """Scaled vectors [..., M] in the objectives' own units."""
        return scaled * self.span + self.origin


def range_scale(values: np.ndarray) -> Scale:
    """Return the scale that maps the vectors [N, M], N >= 1, to [0, 1]; an objective without range keeps its unit."""
    origin, best = values.min(axis=0), values.max(axis=0)
    return Scale(origin, np.where(best > origin, best - origin, 1.0))


def core(values: np.ndarray) -> np.ndarray:
    """Which of the vectors [N, M] are not far out in any objective, [N].

    Far out: more than three interquartile ranges beyond the quartiles (Tukey 1977), or not finite. Of few vectors, all
    that are finite are core, and so they are where each is far out in something.
    """
    near = finite(values)
    if near.sum() < FEW:
        return near
    low, high = np.quantile(values[near], [0.25, 0.75], axis=0)
    reach = np.where(high > low, 3 * (high - low), np.inf)
    within_reach = near & ((values >= low - reach) & (values <= high + reach)).all(axis=1)
    return within_reach if within_reach.any() else near


def finite(values: np.ndarray) -> np.ndarray:
    """Which of the vectors [N, M] can be calculated with, [N]."""
    return (np.abs(values) < HUGE).all(axis=1)


def core_scale(values: np.ndarray) -> Scale:
    """Return `range_scale` of the vectors [N, M] that are core, so that one far out does not make all others alike."""
    return range_scale(values[core(values)])


def search_scale(
    values: np.ndarray,  # [N, M] of the archive, N >= 1
    bounds: np.ndarray,  # [M] -inf before a first choice
    reference: np.ndarray,  # [M]
    kind: Literal["range", "none"],
) -> Scale:
    """Return the scale of a generation.

    "range": that of the archive members within the bounds if there are two, else of the whole archive.
    "none": values less the reference point, in their own units, as in the paper.
    """
    if kind == "none":
        return Scale(reference, np.ones_like(reference))
    inside = values[within(values, bounds)]
    return range_scale(inside if len(inside) >= 2 else values)

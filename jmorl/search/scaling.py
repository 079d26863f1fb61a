"""The scale in which the search calculates, so that none of its constants depends on units."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from jmorl.search.bounds import within

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

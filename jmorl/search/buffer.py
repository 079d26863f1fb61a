"""Good policies in every direction, dominated ones included: where the next parents come from."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jmorl.search.archive import refuse_unusable
from jmorl.search.policy import Policy, values_of
from jmorl.search.scaling import Scale
from jmorl.search.weights import finest_divisions, simplex_grid


@dataclass(frozen=True)
class PerformanceBuffer:
    """The best policies of each direction from the origin of the scale (Xu et al. 2020)."""

    bins: int  # most directions
    size: int  # most policies in a direction
    members: tuple[Policy, ...] = ()  # in the order they came

    def offer(self, policies: Sequence[Policy], scale: Scale) -> "PerformanceBuffer":
        """Return the buffer with the policies added, and all of them sorted anew into bins under this scale.

        A bin keeps the `size` farthest from the origin, where values below the origin count as on it; ties
        go to the earlier. Raises ValueError if a policy's values are not one finite number per objective.
        """
        union = (*self.members, *(policy for policy in policies if policy not in self.members))
        if not union:
            return self
        refuse_unusable(union)
        points = np.maximum(scale.apply(values_of(union)), 0.0)
        kept = _best_of_bins(direction_bins(points, self.bins), np.linalg.norm(points, axis=1), self.size)
        return PerformanceBuffer(self.bins, self.size, tuple(union[index] for index in kept))


def direction_bins(points: np.ndarray, bins: int) -> np.ndarray:
    """Return the bin of each point [N, M] >= 0 seen from zero, [N]; zero itself is in bin 0.

    Two objectives: equal angles. More: the nearest by angle of an even grid of directions, as many as fit
    into `bins`, but no fewer than M.
    """
    if points.shape[1] == 2:
        angles = np.arctan2(points[:, 1], points[:, 0])
        return np.minimum((angles / (np.pi / 2) * bins).astype(int), bins - 1)
    directions = simplex_grid(points.shape[1], finest_divisions(points.shape[1], bins))
    return np.argmax(points @ (directions / np.linalg.norm(directions, axis=1, keepdims=True)).T, axis=1)


def _best_of_bins(bins: np.ndarray, norms: np.ndarray, size: int) -> np.ndarray:
    """Ascending indices of the `size` largest norms in each bin."""
    order = np.lexsort((-norms, bins))  # stable: ties keep their order
    starts = np.searchsorted(bins[order], bins[order])
    return np.sort(order[np.arange(len(order)) - starts < size])

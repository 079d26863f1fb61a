"""Which policies are trained next, with which weights (Xu et al. 2020).

Letters: Q pairs of candidate and weights, N members of the front, M objectives. All values in one scale.
"""

from dataclasses import dataclass

import numpy as np

from jmorl.search.gains import covered, estimated_gains, measured_gain, planar_gains, solid_limits
from jmorl.search.pareto import hypervolume, non_dominated, sparsity

CHUNK = 2**18  # most numbers in an array of intermediate results
EXACT_OBJECTIVES = 3  # with more, to compare all pairs exactly would take minutes
ROUGH, FINE = 256, 2048  # directions of an estimate for all pairs, and of a better one for some of them
SCREENED, MEASURED = 1024, 32  # pairs with a better estimate in each slot, and those whose scores are measured


@dataclass(frozen=True)
class Task:
    """Train this candidate with these weights; what the prediction model expects of it."""

    candidate: int
    weight: int
    predicted: np.ndarray  # [M]


def select_tasks(
    predictions: np.ndarray,  # [C, W, M] of each candidate trained with each of the weights
    front: np.ndarray,  # [N, M] N may be zero
    reference: np.ndarray,  # [M]
    count: int,
    sparsity_weight: float,
    generator: np.random.Generator,
) -> list[Task]:
    """`count` tasks, chosen one after the other to make the predicted front best.

    Each is the pair not yet taken with the largest `HV(F + {z}) - sparsity_weight * sparsity(F + {z})`, where z
    is its prediction and F the front with the predictions chosen before; both over the non-dominated subset.
    Ties go to the first in one random order of all pairs. Once all pairs are taken they are used again, in
    the order of their choice. There must be a candidate and a weight.

    With more than three objectives gains are estimated first, and the pairs with the best estimates compared.
    """
    weights, objectives = predictions.shape[1:]
    points = predictions.reshape(-1, objectives)
    order = generator.permutation(len(points))
    taken = order[_greedy(points[order], front[non_dominated(front)], reference, count, sparsity_weight)]
    pairs = [int(taken[slot % len(taken)]) for slot in range(count)]
    return [Task(pair // weights, pair % weights, points[pair]) for pair in pairs]


def _greedy(
    points: np.ndarray,  # [Q, M]
    front: np.ndarray,  # [N, M] non-dominated
    reference: np.ndarray,  # [M]
    count: int,
    sparsity_weight: float,
) -> list[int]:
    """Return indices of the points that are best to add to the front, one after the other; each at most once."""
    gains = _first_gains(points, front, reference)
    idle = covered(points, front)
    taken: list[int] = []
    while len(taken) < min(count, len(points)):
        slot = _Slot(points, front, reference, sparsity_weight, idle, taken, gains)
        best = slot.exact_best() if points.shape[1] <= EXACT_OBJECTIVES else slot.likely_best()
        taken.append(best)
        if not idle[best]:
            idle |= covered(points, points[[best]])
            front = np.vstack([front[(front > points[best]).any(axis=1)], points[best]])
    return taken


def _first_gains(points: np.ndarray, front: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Upper limits of the gains of all points, or, with many objectives, rough estimates, [Q]."""
    match points.shape[1]:
        case 2:
            return planar_gains(points, front, reference)
        case 3:
            return solid_limits(points, front, reference)
    return estimated_gains(points, front, reference, ROUGH)


class _Slot:
    """One choice among the points, given the front so far.

    `gains` [Q] and `losses` [Q] are limits or estimates before they are measured. The gains are shared with the
    slots that follow: none grows as the front does.
    """

    def __init__(
        self,
        points: np.ndarray,  # [Q, M]
        front: np.ndarray,  # [N, M] non-dominated
        reference: np.ndarray,  # [M]
        sparsity_weight: float,
        idle: np.ndarray,  # [Q] bool, covered: they leave the front as it is, without gain or loss
        taken: list[int],
        gains: np.ndarray,  # [Q]
    ):
        self.points, self.front, self.reference = points, front, reference
        self.sparsity_weight = sparsity_weight
        self.idle, self.taken, self.gains = idle, taken, gains
        self.sparsity = sparsity(front)
        self.losses = np.zeros(len(points))
        self.losses[~idle] = sparsity_weight * (sparsity_limits(points[~idle], front) - self.sparsity)

    def exact_best(self) -> int:
        """Return the point with the largest score, the first of equal ones.

        What has the largest limit is measured, until that has been measured already (Minoux 1978).
        """
        volume = hypervolume(self.front, self.reference)
        loss_known, gain_known = self.idle.copy(), self.idle.copy()
        if self.points.shape[1] == 2:
            self.gains[~self.idle] = planar_gains(self.points[~self.idle], self.front, self.reference)
            gain_known[:] = True
        scores = self._scores()
        while True:
            best = int(np.argmax(scores))
            if not loss_known[best]:
                self.losses[best] = self._loss(best)
                loss_known[best] = True
            elif not gain_known[best]:
                extended = np.vstack([self.front, self.points[best]])
                self.gains[best] = hypervolume(extended, self.reference) - volume
                gain_known[best] = True
            else:
                return best
            scores[best] = self.gains[best] - self.losses[best]

    def likely_best(self) -> int:
        """Return the best of the points that are measured, which are those with the best estimates."""
        screened = self._leading(SCREENED)
        self.gains[screened] = estimated_gains(self.points[screened], self.front, self.reference, FINE)
        measured = self._leading(MEASURED)
        scores = np.where(self.idle, self._scores(), -np.inf)
        for index in measured:
            gain = measured_gain(self.points[index], self.front, self.reference)
            scores[index] = gain - self._loss(index)
        return int(np.argmax(scores))

    def _scores(self) -> np.ndarray:  # [Q]
        scores = np.where(self.idle, 0.0, self.gains - self.losses)
        scores[self.taken] = -np.inf
        return scores

    def _leading(self, count: int) -> np.ndarray:
        """Return indices of the `count` points with the largest scores that are not idle."""
        others = np.flatnonzero(~self.idle)
        if count >= len(others):
            return others
        return others[np.argpartition(-self._scores()[others], count)[:count]]

    def _loss(self, index: int) -> float:
        with_it = sparsities_with(self.points[[index]], self.front)[0]
        return float(self.sparsity_weight * (with_it - self.sparsity))


def sparsity_limits(points: np.ndarray, front: np.ndarray) -> np.ndarray:
    """Lower limits of `sparsities_with`, [Q], much faster.

    In each objective, of the gaps between the point and all members from the worst that it does not beat upwards: a
    beaten member that is left out makes one gap of two, and the sum of squares larger.
    """
    squares, total = np.zeros(len(points)), 0.0
    most = len(front) - 1
    if most < 0:
        return squares
    for objective, values in enumerate(points.T):
        members = front[np.argsort(front[:, objective])]
        column = members[:, objective]
        below = np.append(0.0, np.cumsum(np.diff(column) ** 2))  # [N] squares of the gaps below each member
        lowest = _first_not_beaten(points, members)
        place = np.maximum(np.searchsorted(column, values), lowest)
        over, under = np.minimum(place, most), np.maximum(place - 1, 0)
        upwards = (column[over] - values) ** 2 + below[most] - below[over]
        downwards = (values - column[under]) ** 2 + below[under] - below[np.minimum(lowest, most)]
        squares += np.where(place <= most, upwards, 0.0) + np.where(place > lowest, downwards, 0.0)
        total += below[most]
    return np.maximum(squares - 1e-9 * total, 0.0) / len(front)  # less than any rounding


def _first_not_beaten(points: np.ndarray, members: np.ndarray) -> np.ndarray:
    """Return how many of the members [N, M], in their order, each of the points [Q, M] beats before one it does not."""
    beaten = np.zeros(len(points), int)
    going_on = np.arange(len(points))
    for member in members:
        going_on = going_on[(member <= points[going_on]).all(axis=1)]
        if not len(going_on):
            break
        beaten[going_on] += 1
    return beaten


def sparsities_with(points: np.ndarray, front: np.ndarray) -> np.ndarray:
    """Sparsity of the front [N, M], non-dominated, with each one of the points [Q, M], none of them covered; [Q]."""
    rows = max(1, CHUNK // (len(front) + 1))
    parts = [_sparsities_with(points[start : start + rows], front) for start in range(0, len(points), rows)]
    return np.concatenate([np.zeros(0), *parts])


def _sparsities_with(points: np.ndarray, front: np.ndarray) -> np.ndarray:
    beaten = np.ones((len(points), len(front)), bool)
    for members, values in zip(front.T, points.T, strict=True):
        beaten &= members <= values[:, None]
    squares = np.zeros(len(points))
    for members, values in zip(front.T, points.T, strict=True):
        # a beaten member moved onto the point that beats it leaves no gap of its own
        column = np.concatenate([np.where(beaten, values[:, None], members), values[:, None]], axis=1)
        column.sort(axis=1)
        squares += (np.diff(column, axis=1) ** 2).sum(axis=1)
    return squares / np.maximum((~beaten).sum(axis=1), 1)

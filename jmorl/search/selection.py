"""Which policies are trained next, with which weights (Xu et al. 2020).

Letters: Q pairs of candidate and weights, N members of the front, M objectives. All values in one scale.
"""

from dataclasses import dataclass

import numpy as np

from jmorl.search.pareto import hypervolume, non_dominated, sparsity

CHUNK = 2**18  # most numbers in an array of intermediate results


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
    """Indices of the points that are best to add to the front, one after the other; each at most once.

    A gain of hypervolume never grows as the front does, so those of earlier slots are upper limits, and a
    point whose limit does not win need not be measured again (Minoux 1978).
    """
    gains = gain_limits(points, front, reference)
    covered = _covered(points, front)
    taken: list[int] = []
    while len(taken) < min(count, len(points)):
        adding = np.flatnonzero(~covered)  # the others leave the front as it is: no gain, no loss
        stale = ~covered
        losses = np.zeros(len(points))
        losses[adding] = sparsity_weight * (sparsities_with(points[adding], front) - sparsity(front))
        if points.shape[1] == 2:
            gains[adding] = planar_gains(points[adding], front, reference)
            stale[:] = False
        scores = np.where(covered, 0.0, gains - losses)
        scores[taken] = -np.inf
        best = int(np.argmax(scores))
        volume = hypervolume(front, reference)
        while stale[best]:
            gains[best] = hypervolume(np.vstack([front, points[best]]), reference) - volume
            scores[best] = gains[best] - losses[best]
            stale[best] = False
            best = int(np.argmax(scores))
        taken.append(best)
        if not covered[best]:
            covered |= _covered(points, points[[best]])
            front = np.vstack([front[(front > points[best]).any(axis=1)], points[best]])
    return taken


def _covered(points: np.ndarray, front: np.ndarray) -> np.ndarray:
    """Which of the points [Q, M] have a member of the front [N, M] at least as good in every objective, [Q]."""
    covered = np.zeros(len(points), bool)
    for member in front:
        covered |= (member >= points).all(axis=1)
    return covered


def gain_limits(points: np.ndarray, front: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Upper limits of the hypervolume that each of the points [Q, M] adds to the front [N, M], [Q].

    A point's own box, less its largest overlap with the box of one member.
    """
    overlap = np.zeros(len(points))
    for member in front:
        overlap = np.maximum(overlap, _box(np.minimum(points, member), reference))
    return _box(points, reference) - overlap


def _box(points: np.ndarray, reference: np.ndarray) -> np.ndarray:
    return np.maximum(points - reference, 0.0).prod(axis=-1)


def planar_gains(points: np.ndarray, front: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Area that each of the points [Q, 2], none of them covered, adds to the front [N, 2], non-dominated; [Q]."""
    front = front[np.argsort(front[:, 0])]
    # the beaten members are those from `first` up to, not including, `after`
    first = np.searchsorted(-front[:, 1], -points[:, 1])
    after = np.searchsorted(front[:, 0], points[:, 0], side="right")
    steps = np.maximum(front - reference, 0.0)
    left = np.append(0.0, steps[:, 0])  # where each step of the staircase begins; the last one has height 0
    height = np.append(steps[:, 1], 0.0)
    area = np.append(0.0, np.cumsum(np.diff(left) * steps[:, 1]))  # left of where each step begins
    x, y = np.maximum(points - reference, 0.0).T
    replaced = area[after] - area[first] + (x - left[after]) * height[after]
    return (x - left[first]) * y - replaced


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

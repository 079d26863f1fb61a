"""The hypervolume that points would add to a front: of one point, and of all at once.

Letters: Q points, N members of the front, M objectives, D directions. All values in one scale.
"""

import math
from functools import lru_cache

import numpy as np

from jmorl.search.pareto import exact_is_quick, hypervolume, non_dominated

DIRECTIONS = 256  # of an estimate from a point itself
ROWS = 128  # points that are estimated at a time: their numbers stay in the processor's cache


def covered(points: np.ndarray, front: np.ndarray) -> np.ndarray:
    """Which of the points [Q, M] have a member of the front [N, M] at least as good in every objective, [Q]."""
    covered = np.zeros(len(points), bool)
    columns = np.ascontiguousarray(points.T)
    for member in front:
        covering = np.ones(len(points), bool)
        for column, value in zip(columns, member, strict=True):
            covering &= column <= value
        covered |= covering
    return covered


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


def solid_gains(points: np.ndarray, front: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Volume that each of the points [Q, 3] adds to the front [N, 3]; [Q].

    Between the heights of two successive members the front is a staircase, and a point adds an area to it.
    """
    gains = np.zeros(len(points))
    heights = np.unique(np.maximum(front[:, 2], reference[2]))
    for bottom, top in zip([reference[2], *heights], [*heights, np.inf], strict=True):
        staircase = front[front[:, 2] >= top, :2]
        staircase = staircase[non_dominated(staircase)]
        rising = np.flatnonzero(points[:, 2] > bottom)
        rising = rising[~covered(points[rising, :2], staircase)]
        thickness = np.minimum(points[rising, 2], top) - bottom
        gains[rising] += thickness * planar_gains(points[rising, :2], staircase, reference[:2])
    return gains


def solid_limits(points: np.ndarray, front: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Return upper limits [Q] of the volume that each of the points [Q, 3] adds to the front [N, 3].

    They are the volumes, and more than any rounding.
    """
    size = hypervolume(front, reference) + np.maximum(points - reference, 0.0).prod(axis=1)
    return solid_gains(points, front, reference) + 1e-12 * size


def estimated_gains(points: np.ndarray, front: np.ndarray, reference: np.ndarray, count: int) -> np.ndarray:
    """Estimates of the hypervolume that each of the points [Q, M] adds to the front [N, M]; [Q].

    From the reference point, along `count` fixed directions: how much farther a point's box reaches than those of the
    members (Deng and Zhang 2019).
    """
    above, members = np.maximum(points - reference, 0.0), np.maximum(front - reference, 0.0)
    unit = np.vstack([above, members]).max(axis=0, initial=np.finfo(float).tiny)  # powers neither vanish nor overflow
    inverse = 1 / directions(points.shape[1], count)
    so_far = _combined(members / unit, inverse, np.minimum).max(axis=0, initial=0.0)
    so_far = _power(so_far, len(unit))
    gains = np.zeros(len(points))
    for start in range(0, len(points), ROWS):
        reach = _combined(above[start : start + ROWS] / unit, inverse, np.minimum)
        gains[start : start + ROWS] = np.maximum(_power(reach, len(unit)) - so_far, 0.0).mean(axis=1)
    return gains * _content(unit)


def measured_gain(point: np.ndarray, front: np.ndarray, reference: np.ndarray) -> float:
    """Return the hypervolume that a point [M] adds to the front [N, M]: its box less what members dominate of that.

    Where the exact volume would take long it is estimated from the point downwards, along fixed directions: how far
    it is to what a member dominates. That is much closer than `estimated_gains`, and takes much longer.
    """
    box = point - reference
    if (box <= 0).any():
        return 0.0
    inside = np.minimum(front, point) - reference
    inside = inside[(inside > 0).all(axis=1)]
    inside = inside[non_dominated(inside)]
    if exact_is_quick(*inside.shape):
        return float(box.prod()) - hypervolume(inside, np.zeros_like(box))
    inverse = 1 / directions(len(box), DIRECTIONS)
    reach = _combined(1 - inside / box, inverse, np.maximum).min(axis=0)
    reach = np.minimum(reach, inverse.min(axis=1))  # the reference ends it, too
    return float(_power(reach, len(box)).mean() * _content(box))


@lru_cache
def directions(objectives: int, count: int) -> np.ndarray:
    """`count` fixed directions [D, M], spread at random over the positive part of the sphere of radius sqrt(M)."""
    drawn = np.abs(np.random.default_rng(0).normal(size=(count, objectives)))
    return drawn * np.sqrt(objectives) / np.linalg.norm(drawn, axis=1, keepdims=True)


def _combined(edges: np.ndarray, inverse: np.ndarray, combine: np.ufunc) -> np.ndarray:
    """Return how far it is along the directions to a side of boxes with the edges [Q, M], [Q, D].

    The directions are given inverse [D, M]; `np.minimum` is for the first of the sides, `np.maximum` for the last.
    """
    distance = edges[:, 0, None] * inverse[:, 0]
    other = np.empty_like(distance)
    for edge, each in zip(edges.T[1:], inverse.T[1:], strict=True):
        np.multiply(edge[:, None], each, out=other)
        combine(distance, other, out=distance)
    return distance


def _power(reach: np.ndarray, exponent: int) -> np.ndarray:
    """By multiplication, many times as fast as `**`."""
    power = reach.copy()
    for _ in range(exponent - 1):
        np.multiply(power, reach, out=power)
    return power


def _content(edges: np.ndarray) -> float:
    """Return the volume of a star-shaped body in a box with edges [M], per mean of its reach to the power of M.

    The reach is along `directions`, in the box scaled to one.
    """
    m = len(edges)
    return float(edges.prod() * math.exp(m / 2 * math.log(math.pi * m / 4) + math.log(2 / m) - math.lgamma(m / 2)))

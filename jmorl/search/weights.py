"""Weights spread over the simplex. Every row is non-negative and sums to one."""

from itertools import combinations
from math import comb

import numpy as np

MOST_WEIGHTS = 100  # that a policy may be trained with; the time of a selection grows with their number
LARGE_GRID = 10_000


def candidate_grid(objectives: int, divisions: int) -> np.ndarray:
    """Return the grid of so many divisions, or, where that has over a hundred weights, the finest that has not, [W, M].

    The corners are always in it.
    """
    return simplex_grid(objectives, min(divisions, finest_divisions(objectives, MOST_WEIGHTS)))


def finest_divisions(objectives: int, most: int) -> int:
    """Return the most divisions, from 1, whose grid has `most` weights or fewer; for two objectives or more."""
    divisions = 1
    while _grid_size(objectives, divisions + 1) <= most:
        divisions += 1
    return divisions


def simplex_grid(objectives: int, divisions: int) -> np.ndarray:
    """All weights that are multiples of 1 / divisions, [W, M], in lexicographic order (Das and Dennis 1998)."""
    return _grid_steps(objectives, divisions) / divisions


def evenly_spaced_weights(objectives: int, count: int) -> np.ndarray:
    """`count` weights spread evenly over the simplex, [count, M].

    One weight is the centre. Two objectives: from (0, 1) to (1, 0) in equal steps. More: the corners first,
    then always the grid point farthest from those chosen (Gonzalez 1985), ties to the first.
    """
    if count == 1 or objectives == 1:
        return np.full((count, objectives), 1 / objectives)
    if objectives == 2:
        return simplex_grid(2, count - 1)
    steps = _spread_steps(objectives, count)  # integers: distances, and so ties, are exact
    whole = int(steps[0].sum())
    chosen = list(whole * np.eye(objectives, dtype=int))[:count]
    distances = np.min([((steps - each) ** 2).sum(axis=1) for each in chosen], axis=0)
    while len(chosen) < count:
        chosen.append(steps[np.argmax(distances)])
        distances = np.minimum(distances, ((steps - chosen[-1]) ** 2).sum(axis=1))
    return np.array(chosen) / whole


def _spread_steps(objectives: int, count: int) -> np.ndarray:
    """Return a grid, as integers, with at least ten times `count` weights and the centre."""
    divisions = objectives  # and multiples of it: then the centre is a grid point
    while _grid_size(objectives, divisions) < 10 * count:
        divisions += objectives
    if _grid_size(objectives, divisions) <= max(LARGE_GRID, 100 * count):  # with many objectives it may be billions
        return _grid_steps(objectives, divisions)
    divisions = 1
    while _grid_size(objectives, divisions) < 10 * count:
        divisions += 1
    return np.vstack([objectives * _grid_steps(objectives, divisions), np.full(objectives, divisions)])


def _grid_size(objectives: int, divisions: int) -> int:
    return comb(divisions + objectives - 1, objectives - 1)


def _grid_steps(objectives: int, divisions: int) -> np.ndarray:
    """All rows of M non-negative integers with sum `divisions`, [W, M]."""
    # a row is a way to place M - 1 bars among the divisions: the gaps between bars are its entries
    places = divisions + objectives - 1
    bars = np.array(list(combinations(range(places), objectives - 1)), dtype=int)
    return np.diff(bars, axis=1, prepend=-1, append=places) - 1

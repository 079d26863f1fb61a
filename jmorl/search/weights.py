"""Weights spread over the simplex. Every row is non-negative and sums to one."""

from itertools import combinations
from math import comb

import numpy as np


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
    # multiples of M, so that the centre is a grid point
    divisions = objectives
    while comb(divisions + objectives - 1, objectives - 1) < 10 * count:
        divisions += objectives
    steps = _grid_steps(objectives, divisions)  # integers: distances, and so ties, are exact
    chosen = list(divisions * np.eye(objectives, dtype=int))[:count]
    distances = np.min([((steps - each) ** 2).sum(axis=1) for each in chosen], axis=0)
    while len(chosen) < count:
        chosen.append(steps[np.argmax(distances)])
        distances = np.minimum(distances, ((steps - chosen[-1]) ** 2).sum(axis=1))
    return np.array(chosen) / divisions


def _grid_steps(objectives: int, divisions: int) -> np.ndarray:
    """All rows of M non-negative integers with sum `divisions`, [W, M]."""
    # a row is a way to place M - 1 bars among the divisions: the gaps between bars are its entries
    places = divisions + objectives - 1
    bars = np.array(list(combinations(range(places), objectives - 1)), dtype=int)
    return np.diff(bars, axis=1, prepend=-1, append=places) - 1

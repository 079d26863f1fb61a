"""Weights are on the simplex, different, complete and evenly spread."""

from itertools import product
from math import comb

import numpy as np
import pytest

from jmorl.search.weights import candidate_grid, evenly_spaced_weights, simplex_grid


@pytest.mark.parametrize(("objectives", "divisions"), [(1, 4), (2, 10), (3, 4), (4, 3), (5, 2)])
def test_grid_is_all_multiples_in_order(objectives: int, divisions: int) -> None:
    steps = [row for row in product(range(divisions + 1), repeat=objectives) if sum(row) == divisions]
    grid = simplex_grid(objectives, divisions)
    assert len(grid) == comb(divisions + objectives - 1, objectives - 1)
    np.testing.assert_array_equal(grid, np.array(steps) / divisions)


@pytest.mark.parametrize(("objectives", "count"), [(2, 11), (3, 66)])
def test_candidates_of_few_objectives_are_the_grid_itself(objectives: int, count: int) -> None:
    grid = candidate_grid(objectives, 10)
    np.testing.assert_array_equal(grid, simplex_grid(objectives, 10))
    assert len(grid) == count


@pytest.mark.parametrize("divisions", [10, 2**32 - 1])
@pytest.mark.parametrize("objectives", [2, 3, 4, 5, 8, 13, 31])
def test_candidates_are_at_most_a_hundred_and_have_the_corners(objectives: int, divisions: int) -> None:
    grid = candidate_grid(objectives, divisions)
    assert objectives <= len(grid) <= 100
    assert {tuple(corner) for corner in np.eye(objectives)} <= {tuple(weight) for weight in grid}
    steps = round(1 / grid[grid > 0].min())
    assert steps == divisions or comb(steps + objectives, objectives - 1) > 100


@pytest.mark.parametrize("objectives", [2, 3, 4, 6, 10, 31])
@pytest.mark.parametrize("count", [1, 2, 3, 5, 6, 12, 40])
def test_spread_weights_are_different_and_on_the_simplex(objectives: int, count: int) -> None:
    weights = evenly_spaced_weights(objectives, count)
    assert weights.shape == (count, objectives)
    assert (weights >= 0).all()
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, rtol=1e-14)
    assert len(np.unique(weights, axis=0)) == count


def test_two_objectives_are_equal_steps_from_end_to_end() -> None:
    np.testing.assert_allclose(evenly_spaced_weights(2, 6)[:, 0], np.linspace(0, 1, 6), rtol=1e-15)


@pytest.mark.parametrize("objectives", [1, 2, 3, 5])
def test_one_weight_is_equal(objectives: int) -> None:
    np.testing.assert_array_equal(evenly_spaced_weights(objectives, 1), np.full((1, objectives), 1 / objectives))


def test_more_objectives_start_with_the_corners_and_the_centre() -> None:
    np.testing.assert_array_equal(evenly_spaced_weights(4, 2), np.eye(4)[:2])
    for objectives in (3, 12, 20):
        centre = np.full(objectives, 1 / objectives)
        np.testing.assert_allclose(evenly_spaced_weights(objectives, objectives + 1), [*np.eye(objectives), centre])


@pytest.mark.parametrize(("objectives", "count"), [(3, 6), (3, 20), (4, 12)])
def test_no_direction_is_left_out(objectives: int, count: int) -> None:
    """The farthest-point rule: no weight is farther from the chosen than the chosen are from each other."""
    weights = evenly_spaced_weights(objectives, count)
    everywhere = np.random.default_rng(0).dirichlet(np.ones(objectives), size=2000)
    apart = min(np.linalg.norm(a - b) for i, a in enumerate(weights) for b in weights[:i])
    farthest = np.linalg.norm(everywhere[:, None] - weights, axis=2).min(axis=1).max()
    assert farthest <= 1.05 * apart

"""Neighbours on a front, what lies between them, and the families that these make."""

import hypothesis.extra.numpy as arrays
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from jmorl.search import families as module
from jmorl.search.families import below_line, families, largest_gap, neighbours
from jmorl.search.pareto import farthest_first

COORDINATES = st.integers(0, 20).map(float)


def by_definition(values):
    """Pairs with no third vector in the ball between them, one by one."""
    found = []
    for i in range(len(values)):
        for j in range(i + 1, len(values)):
            centre, radius = (values[i] + values[j]) / 2, np.linalg.norm(values[i] - values[j]) / 2
            others = np.delete(values, [i, j], axis=0)
            if (np.linalg.norm(others - centre, axis=1) > radius - 1e-9).all():
                found.append([i, j])
    return np.array(found).reshape(-1, 2)


@given(st.integers(1, 12), st.integers(0, 2**31))
def test_on_a_front_of_two_objectives_neighbours_are_next_to_each_other(count, seed):
    steps = np.random.default_rng(seed).uniform(0.01, 1, size=(2, count))
    values = np.stack([steps[0].cumsum(), -steps[1].cumsum()], axis=1)
    shuffled = np.random.default_rng(seed).permutation(count)
    places = np.argsort(shuffled)
    expected = sorted(sorted(pair) for pair in zip(places[:-1].tolist(), places[1:].tolist(), strict=True))
    assert sorted(neighbours(values[shuffled]).tolist()) == expected


@pytest.mark.parametrize("at_once", [1, 2**22])
@pytest.mark.parametrize("objectives", [2, 3, 5])
def test_neighbours_are_as_defined(monkeypatch, objectives, at_once):
    monkeypatch.setattr(module, "AT_ONCE", at_once)
    values = np.random.default_rng(objectives).normal(size=(25, objectives))
    np.testing.assert_array_equal(neighbours(values), by_definition(values))


def test_below_the_line():
    first, second = np.array([0.0, 1.0]), np.array([1.0, 0.0])
    assert below_line(first, second, np.array([0.4, 0.4])) == pytest.approx(0.1)
    assert below_line(first, second, np.array([0.7, 0.7])) == pytest.approx(-0.2)
    assert below_line(first, second, np.array([0.25, 0.75])) == pytest.approx(0)
    assert below_line(first, second, np.array([-0.5, 1.0])) == pytest.approx(0.5)  # wherever on the line


def test_families_are_what_links_hold_together():
    assert families(6, [(4, 1), (1, 0), (3, 5)]) == [[0, 1, 4], [2], [3, 5]]
    assert families(2, []) == [[0], [1]]


@given(arrays.arrays(float, st.tuples(st.integers(2, 8), st.just(2)), elements=COORDINATES, unique=True))
def test_the_largest_gap_is_the_widest_step_that_cannot_be_avoided(values):
    gap = largest_gap(values)
    distances = np.linalg.norm(values[:, None] - values[None], axis=2)
    assert len(families(len(values), np.argwhere(distances <= gap + 1e-9).tolist())) == 1
    assert len(families(len(values), np.argwhere(distances < gap - 1e-9).tolist())) > 1


def test_the_largest_gap_of_a_line_is_between_neighbours():
    assert largest_gap(np.array([[0.0, 0], [1, 0], [5, 0], [6, 0]])) == 4
    assert largest_gap(np.array([[3.0, 3]])) == 0


def test_the_farthest_comes_first():
    values = np.array([[0.0, 0], [10, 0], [4, 0], [5, 0]])
    assert farthest_first(values, np.array([[0.0, 0]]), 3) == [1, 3, 2]
    assert farthest_first(values, np.array([[5.0, 0]]), 9) == [0, 1, 2, 3]

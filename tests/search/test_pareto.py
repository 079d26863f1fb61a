"""Dominance, hypervolume, sparsity and expected utility against independent arithmetic."""

import pickle
from itertools import combinations

import moocore
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from jmorl.search.pareto import exact_is_quick, expected_utility, hypervolume, non_dominated, sparsity

# small integers: duplicates, ties and dominated vectors abound, and all arithmetic is exact
vector_sets = st.integers(1, 4).flatmap(
    lambda m: arrays(float, st.tuples(st.integers(0, 8), st.just(m)), elements=st.integers(-3, 5).map(float))
)


def non_dominated_by_definition(values: np.ndarray) -> list[bool]:
    return [
        not any((other >= z).all() and (other > z).any() for other in values)
        and not any((earlier == z).all() for earlier in values[:index])
        for index, z in enumerate(values)
    ]


def union_of_boxes(values: np.ndarray, reference: np.ndarray) -> float:
    """Hypervolume by inclusion and exclusion."""
    corners = np.maximum(values - reference, 0.0)
    return sum(
        (-1) ** (size + 1) * corners[list(subset)].min(axis=0).prod()
        for size in range(1, len(corners) + 1)
        for subset in combinations(range(len(corners)), size)
    )


@given(vector_sets)
def test_non_dominated_is_the_definition(values: np.ndarray) -> None:
    assert non_dominated(values).tolist() == non_dominated_by_definition(values)


def test_equal_vectors_keep_the_first() -> None:
    assert non_dominated(np.array([[0.0, 1.0], [1.0, 0.0], [0.0, 1.0], [-0.0, 1.0]])).tolist() == [1, 1, 0, 0]


def test_no_vectors() -> None:
    nothing = np.zeros((0, 3))
    assert non_dominated(nothing).shape == (0,)
    assert hypervolume(nothing, np.zeros(3)) == 0.0
    assert sparsity(nothing) == 0.0


@given(vector_sets)
def test_hypervolume_is_the_union_of_boxes(values: np.ndarray) -> None:
    reference = np.full(values.shape[1], -1.0)
    assert hypervolume(values, reference) == union_of_boxes(values, reference)


def test_vectors_not_above_the_reference_add_no_hypervolume() -> None:
    reference = np.array([0.0, 0.0, 0.0])
    values = np.array([[2.0, 3.0, 4.0], [9.0, 9.0, 0.0], [9.0, -1.0, 9.0]])
    assert hypervolume(values, reference) == 24.0
    assert hypervolume(values[1:], reference) == 0.0


@given(vector_sets)
def test_dominated_vectors_change_neither_hypervolume_nor_sparsity(values: np.ndarray) -> None:
    front = values[non_dominated(values)]
    reference = np.full(values.shape[1], -4.0)
    assert hypervolume(values, reference) == hypervolume(front, reference)
    assert sparsity(values) == sparsity(front)


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ([[0, 4], [1, 2], [3, 0]], ((1 + 4) + (4 + 4)) / 2),
        ([[3, 0], [0, 4], [1, 2], [0, 0], [1, 2]], ((1 + 4) + (4 + 4)) / 2),
        # sorted in each objective on its own: gaps 1, 1 | 1, 3 | 2, 1
        ([[0, 1, 5], [1, 4, 3], [2, 0, 2 + 4]], ((1 + 1) + (1 + 9) + (4 + 1)) / 2),
        ([[1, 2, 3]], 0.0),
    ],
)
def test_sparsity_by_hand(values: list[list[float]], expected: float) -> None:
    assert sparsity(np.array(values, dtype=float)) == expected


def test_expected_utility_by_hand() -> None:
    values = np.array([[1.0, 0.0], [0.0, 2.0], [-5.0, -5.0]])
    weights = np.array([[1.0, 0.0], [0.5, 0.5], [0.0, 1.0]])
    assert expected_utility(values, weights) == (1.0 + 1.0 + 2.0) / 3


@given(vector_sets.filter(len))
def test_expected_utility_is_that_of_the_front(values: np.ndarray) -> None:
    weights = np.random.default_rng(0).dirichlet(np.ones(values.shape[1]), size=20)
    front = values[non_dominated(values)]
    one_by_one = np.mean([max(float(z @ w) for z in values) for w in weights])
    assert expected_utility(values, weights) == pytest.approx(one_by_one, rel=1e-12, abs=1e-12)
    assert expected_utility(front, weights) == pytest.approx(one_by_one, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize(("objectives", "count"), [(5, 300), (6, 150), (7, 60), (8, 40)])
def test_a_large_hypervolume_is_approximate_and_always_the_same(objectives: int, count: int) -> None:
    directions = np.abs(np.random.default_rng(0).normal(size=(count, objectives)))
    values, reference = directions / np.linalg.norm(directions, axis=1, keepdims=True), np.full(objectives, -0.1)
    assert not exact_is_quick(count, objectives)
    found = hypervolume(values, reference)
    assert found == hypervolume(values, reference)
    assert found == pytest.approx(moocore.hypervolume(values.copy(), ref=reference, maximise=True), rel=0.01)


def test_the_vectors_of_a_hypervolume_stay_as_they_are() -> None:
    """Moocore takes what was unpickled for a copy of its own."""
    values = pickle.loads(pickle.dumps(np.array([[1.0, 2.0], [2.0, 1.0]])))
    assert hypervolume(values, np.zeros(2)) == 3.0
    np.testing.assert_array_equal(values, [[1.0, 2.0], [2.0, 1.0]])

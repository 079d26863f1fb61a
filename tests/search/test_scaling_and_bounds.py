"""Scales and bounds: what they map to what, and that units do not matter."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from jmorl.search.bounds import MOST_WIDENINGS, lower_bounds, widened_bounds, within
from jmorl.search.scaling import range_scale, search_scale

finite = st.floats(-1e4, 1e4)
vector_sets = st.integers(1, 4).flatmap(
    lambda m: arrays(float, st.tuples(st.integers(1, 8), st.just(m)), elements=finite)
)
vectors = arrays(float, 3, elements=finite)
amounts = arrays(float, 3, elements=st.floats(0, 1e4))

ANYWHERE = np.full(2, -np.inf)
REFERENCE = np.array([-10.0, -20.0])


def test_range_becomes_zero_to_one() -> None:
    values = np.array([[-10.0, 3.0, 7.0], [30.0, 5.0, 7.0], [0.0, 4.0, 7.0]])
    np.testing.assert_allclose(range_scale(values).apply(values), [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.25, 0.5, 0.0]])


@given(vector_sets)
def test_scaled_values_lie_in_the_unit_box_and_come_back(values: np.ndarray) -> None:
    scale = range_scale(values)
    scaled = scale.apply(values)
    assert (scaled >= 0).all() and (scaled <= 1).all()
    np.testing.assert_allclose(scale.invert(scaled), values, rtol=1e-9, atol=1e-9)


def test_one_vector_or_an_equal_range_keeps_its_unit() -> None:
    np.testing.assert_array_equal(range_scale(np.array([[3.0, 4.0, 5.0]])).apply(np.array([4.0, 2.0, 5.0])), [1, -2, 0])


def test_search_scale_is_the_range_within_the_bounds() -> None:
    values = np.array([[0.0, 9.0], [4.0, 5.0], [6.0, 3.0], [9.0, 0.0]])
    scale = search_scale(values, np.array([3.0, 2.0]), REFERENCE, "range")
    np.testing.assert_array_equal(scale.apply(values), [[-2, 3], [0, 1], [1, 0], [2.5, -1.5]])


@pytest.mark.parametrize("bounds", [ANYWHERE, np.array([5.0, 1.0]), np.array([99.0, 99.0])])
def test_search_scale_is_the_whole_range_with_fewer_than_two_within(bounds: np.ndarray) -> None:
    values = np.array([[0.0, 9.0], [4.0, 5.0], [6.0, 3.0], [9.0, 0.0]])
    np.testing.assert_array_equal(search_scale(values, bounds, REFERENCE, "range").apply(values), values / 9)


def test_unscaled_search_is_relative_to_the_reference_point() -> None:
    values = np.array([[0.0, 9.0], [4.0, 5.0]])
    scale = search_scale(values, np.array([3.0, 2.0]), REFERENCE, "none")
    np.testing.assert_array_equal(scale.apply(values), [[10, 29], [14, 25]])


def test_bounds_by_hand() -> None:
    bounds = lower_bounds(np.array([-100.0, 4.0, 0.0]), 0.1, np.array([1.0, 9.0, 5.0]))
    np.testing.assert_allclose(bounds, [-101.0, 3.4, 0.0])


@given(vectors, st.floats(0, 10), amounts)
def test_bounds_never_exclude_the_choice(preferred: np.ndarray, delta: float, unit: np.ndarray) -> None:
    assert (lower_bounds(preferred, delta, unit) <= preferred).all()
    assert within(preferred[None], lower_bounds(preferred, delta, unit)).all()


@given(vectors, st.floats(0, 10), st.floats(0, 10), amounts, amounts)
def test_more_slack_never_raises_a_bound(
    preferred: np.ndarray, delta: float, more: float, unit: np.ndarray, larger: np.ndarray
) -> None:
    bounds = lower_bounds(preferred, delta, unit)
    assert (lower_bounds(preferred, delta + more, unit) <= bounds).all()
    assert (lower_bounds(preferred, delta, unit + larger) <= bounds).all()


@given(vectors, amounts, arrays(float, 3, elements=st.floats(1e-3, 1e3)))
def test_bounds_with_a_unit_do_not_depend_on_units(preferred: np.ndarray, unit: np.ndarray, factor: np.ndarray) -> None:
    bounds = lower_bounds(preferred, 0.1, unit)
    rescaled = lower_bounds(factor * preferred, 0.1, factor * unit)
    np.testing.assert_allclose(rescaled, factor * bounds, rtol=1e-9, atol=1e-12)


@given(vectors, st.floats(0, 10), amounts, arrays(float, (5, 3), elements=st.floats(-1e3, 1e3)))
def test_bounds_that_need_not_give_way_are_the_papers(
    preferred: np.ndarray, delta: float, unit: np.ndarray, values: np.ndarray
) -> None:
    bounds = widened_bounds(preferred, delta, unit, np.zeros(3), values, 0)
    np.testing.assert_array_equal(bounds.lower, lower_bounds(preferred, delta, unit))
    assert bounds.widenings == 0


def test_bounds_give_way_until_enough_lie_within() -> None:
    preferred, unit = np.array([100.0, -4.0]), np.array([100.0, 4.0])  # so the slack is 0.1 times these
    values = np.array([[100.0, -4.0], [81.0, -4.7], [65.0, -4.0], [-500.0, 0.0]])
    for least, widenings in ((1, 0), (2, 1), (3, 2), (4, 6), (5, 7)):
        bounds = widened_bounds(preferred, 0.1, unit, np.zeros(2), values, least)
        assert bounds.widenings == widenings
        np.testing.assert_allclose(bounds.lower, preferred - 2**widenings * 0.1 * unit)


def test_slack_may_have_a_least_that_does_not_depend_on_where_zero_lies() -> None:
    unit, least = np.array([10.0, 10.0]), np.array([0.5, 0.5])
    bounds = widened_bounds(np.array([0.0, -1000.0]), 0.1, unit, least, np.zeros((0, 2)), 0)
    np.testing.assert_allclose(bounds.lower, [-0.5, -1010.0])


def test_bounds_that_give_way_stop_at_a_limit_less_their_slack_at_first() -> None:
    preferred, unit = np.array([100.0, -4.0]), np.array([100.0, 4.0])  # so the slack is 10 and 0.4
    values = np.array([[65.0, -4.5], [65.0, -5.5], [-500.0, 0.0]])
    free = widened_bounds(preferred, 0.1, unit, np.zeros(2), values, 1)
    np.testing.assert_allclose(free.lower, [60, -5.6])
    bounds = widened_bounds(preferred, 0.1, unit, np.zeros(2), values, 1, (-np.inf, -4.3))
    np.testing.assert_allclose(bounds.lower, [60, -4.7])
    assert bounds.widenings == free.widenings == 2


def test_towards_a_limit_bounds_give_way_at_once() -> None:
    preferred, unit, values = np.array([100.0, -4.0]), np.array([100.0, 4.0]), np.array([[100.0, -4.0]])
    for limit, lower in ((-3.9, -4.4), (-4.0, -4.4), (-5.0, -5.4), (-6.7, -7.1), (-50.0, -7.2)):
        bounds = widened_bounds(preferred, 0.1, unit, np.zeros(2), values, 1, (-np.inf, limit))
        np.testing.assert_allclose(bounds.lower, [90, lower])
        assert bounds.widenings == 0


def test_no_limit_at_all_changes_nothing() -> None:
    preferred, unit, values = np.array([100.0, -4.0]), np.array([100.0, 4.0]), np.array([[65.0, -4.0]])
    free = widened_bounds(preferred, 0.1, unit, np.zeros(2), values, 1)
    bounds = widened_bounds(preferred, 0.1, unit, np.zeros(2), values, 1, (-np.inf, -np.inf))
    np.testing.assert_array_equal(bounds.lower, free.lower)
    assert bounds.widenings == free.widenings > 0


@given(vectors, amounts, vectors, arrays(float, (5, 3), elements=finite), st.integers(0, 5))
def test_bounds_stay_above_limits_and_never_exclude_the_choice(
    preferred: np.ndarray, slack: np.ndarray, limits: np.ndarray, values: np.ndarray, least: int
) -> None:
    bounds = widened_bounds(preferred, 0.0, slack, slack, values, least, limits.tolist())
    assert within(preferred[None], bounds.lower).all() and (bounds.lower <= preferred - slack).all()
    assert (bounds.lower >= np.minimum(limits, preferred) - slack).all()
    if bounds.widenings < MOST_WIDENINGS:
        assert within(values, bounds.lower).sum() >= least


def test_within_needs_every_objective() -> None:
    values = np.array([[1.0, 1.0, 1.0], [1.0, 0.9, 2.0], [5.0, 5.0, 5.0]])
    assert within(values, np.ones(3)).tolist() == [True, False, True]
    assert within(values, np.full(3, -np.inf)).all()
    assert within(np.zeros((0, 3)), np.ones(3)).shape == (0,)

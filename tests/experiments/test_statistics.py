"""Few runs and time-outs: means, intervals and censoring."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from jmorl.experiments.statistics import Times, difference, interval, saved

STEPS = st.one_of(st.none(), st.integers(1, 40).map(lambda g: g * 0.24))


def kaplan_meier_area(times, events, horizon):
    """The area under the product-limit curve up to the horizon, step by step."""
    area, survival, before = 0.0, 1.0, 0.0
    for time in sorted({t for t, event in zip(times, events, strict=True) if event}):
        area += survival * (time - before)
        at_risk = sum(t >= time for t in times)
        died = sum(t == time and event for t, event in zip(times, events, strict=True))
        survival, before = survival * (1 - died / at_risk), time
    return area + survival * (horizon - before)


@given(st.lists(STEPS, min_size=1, max_size=8))
def test_the_restricted_mean_is_the_area_under_the_kaplan_meier_curve(reached):
    times = Times(tuple(reached), 10.0)
    expected = kaplan_meier_area(times.restricted, [each is not None for each in reached], 10.0)
    assert times.restricted_mean.mean == pytest.approx(expected)
    assert times.successes == sum(each is not None for each in reached)


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=6))
def test_an_interval_holds_its_mean_and_lies_within_the_values(values):
    found = interval(values)
    slack = 1e-9 * (1 + max(map(abs, values)))
    assert min(values) - slack <= found.low <= found.mean + slack
    assert found.mean - slack <= found.high <= max(values) + slack


def test_equal_values_and_single_ones_have_no_width():
    for values in ([3.0], [3.0, 3.0, 3.0]):
        found = interval(values)
        assert (found.mean, found.low, found.high) == (3.0, 3.0, 3.0)


def test_an_interval_of_many_values_is_nearly_the_normal_one():
    values = np.random.default_rng(0).normal(5, 2, 400)
    found = interval(values)
    half = 1.96 * values.std() / 20
    assert found.low == pytest.approx(values.mean() - half, abs=0.03)
    assert found.high == pytest.approx(values.mean() + half, abs=0.03)


def test_the_interval_of_the_same_values_is_always_the_same():
    assert interval([1.0, 2.0, 4.0, 9.0]) == interval([1.0, 2.0, 4.0, 9.0])


def test_what_is_saved_is_paired_and_counts_time_outs_at_the_budget():
    found = saved(Times((1.0, None), 10.0), Times((4.0, 9.0), 10.0))
    assert found.mean == pytest.approx((3.0 - 1.0) / 2)
    assert not found.clear
    assert not saved(Times((1.0, 2.0), 10.0), Times((None, None), 10.0)).clear  # two say little
    assert saved(Times((1.0, 2.0, 1.0), 10.0), Times((None, None, 9.0), 10.0)).clear


def test_a_paired_difference_has_a_t_interval_wider_than_the_bootstraps():
    values = [1.0, 3.0, 2.0]
    found = difference(values)
    assert (found.mean, found.count, found.agreeing) == (2.0, 3, 3)
    assert found.high - found.mean == pytest.approx(4.302653 / np.sqrt(3), rel=1e-5)
    assert found.low < interval(values).low and not found.clear
    assert found.certainty == "not clearly, though all 3 seeds agree"
    assert difference([1.0, -3.0, 2.5]).certainty == "not clearly"
    assert difference([2.0, 2.1, 2.2]).certainty == "clearly"


@pytest.mark.parametrize("count", [3, 5])
def test_the_t_interval_covers_the_mean_as_often_as_it_says(count):
    random = np.random.default_rng(1)
    covered = [d.low <= 0 <= d.high for d in (difference(random.normal(size=count)) for _ in range(2000))]
    assert np.mean(covered) == pytest.approx(0.95, abs=0.015)

"""Few runs and time-outs: means, intervals and censoring."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from jmorl.paper.statistics import Times, interval, saved

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
    assert not found.excludes_zero
    assert not saved(Times((1.0, 2.0), 10.0), Times((None, None), 10.0)).excludes_zero  # two say little
    assert saved(Times((1.0, 2.0, 1.0), 10.0), Times((None, None, 9.0), 10.0)).excludes_zero

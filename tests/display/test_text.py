"""Numbers as people read them."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from jmorl.display.text import duration, number, number_format, plural, short_count


@given(st.floats(1e-4, 1e7), st.integers(2, 5), st.floats(-1e3, 1e3))
def test_the_range_is_shown_with_as_many_digits_as_asked_for(extent, digits, offset):
    fmt = number_format(np.array([0.0, extent, extent / 3]) + offset, digits)
    decimals = int(fmt.strip(".f"))
    leading = math.floor(math.log10(np.ptp(np.array([0.0, extent]) + offset)))
    assert decimals == max(digits - 1 - leading, 0)


@pytest.mark.parametrize(
    ("values", "value", "shown"),
    [
        ([-66.25, -70.0, -100.0], -66.28, "-66.3"),
        ([-66.25], -66.28, "-66.3"),
        ([0.0, 0.0], 0.0, "0.00"),
        ([np.nan, 5.0, np.nan, 5.5], 5.0, "5.000"),
        ([-66.25, -66.5, -67.0, -66.75, -66.0, -999.0], -66.25, "-66.25"),  # the last is far out
        ([np.nan], 1.0, "1.00"),
        ([3e12], 3e12, "3e+12"),
        ([2e-9, 5e-9], 2e-9, "2e-09"),
    ],
)
def test_formats_of_columns(values, value, shown):
    assert f"{value:{number_format(np.array(values))}}" == shown


@pytest.mark.parametrize(
    ("value", "text"), [(0.0, "0"), (-56.1349, "-56.13"), (909429.3, "909429"), (0.012346, "0.01235")]
)
def test_numbers_that_stand_alone(value, text):
    assert number(value) == text


@pytest.mark.parametrize(
    ("count", "text"),
    [
        (0, "0"),
        (999, "999"),
        (999.6, "1.00 k"),
        (1000, "1.00 k"),
        (9_994, "9.99 k"),
        (9_996, "10.0 k"),
        (23_456, "23.5 k"),
        (99_960, "100 k"),
        (240_000, "240 k"),
        (999_600, "1.00 M"),
        (2_640_000, "2.64 M"),
        (7.5e9, "7.50 G"),
    ],
)
def test_short_counts(count, text):
    assert short_count(count) == text


@given(st.floats(1, 1e11))
def test_a_short_count_is_right_to_half_a_percent(count):
    digits, _, prefix = short_count(count).partition(" ")
    size = {"": 1, "k": 1e3, "M": 1e6, "G": 1e9}[prefix]
    assert float(digits) * size == pytest.approx(count, rel=0.0051) or count < 100


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0.04, "0.0 s"),
        (9.94, "9.9 s"),
        (9.96, "10 s"),
        (59.4, "59 s"),
        (59.6, "1 min 0 s"),
        (200, "3 min 20 s"),
        (3599.6, "1 h 0 min"),
        (7500, "2 h 5 min"),
    ],
)
def test_durations(seconds, text):
    assert duration(seconds) == text


def test_plurals():
    assert [plural(1, "policy"), plural(2, "policy"), plural(0, "step")] == ["1 policy", "2 policies", "0 steps"]

"""The box: what a policy's output stands for in an environment's own units, and what is no box."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from envs.actions import action_box

INF = np.inf


@pytest.mark.parametrize(
    ("low", "high"), [(5, 35), (0, 1), (0.0, 1000.0), (-0.001, 0.001), (-3e38, 3e38), (7, np.float64(7.0001))]
)
def test_minus_one_is_the_low_end_zero_the_middle_and_beyond_one_is_one(low, high):
    box = action_box(low, high, 1)
    action = box.action(jnp.array([[-1], [0], [0.5], [1], [2]], jnp.float32))
    middle, quarter = (low + high) / 2, 0.25 * low + 0.75 * high
    np.testing.assert_allclose(action[:, 0], [low, middle, quarter, high, high], rtol=1e-6)
    assert (action[0], action[3]) == (np.float32(low), np.float32(high))
    assert action.dtype == jnp.float32


def test_each_component_is_its_own():
    box = action_box((0.0, -INF, -INF, 0.0, -2.0), (10.0, INF, 1.0, INF, 3.0), 5)
    outputs = jnp.array([[0.5] * 5, [-4.0] * 5, [4.0] * 5])
    expected = [[7.5, 0.5, 0.5, 0.5, 1.75], [0, -4, -4, 0, -2], [10, 4, 1, 4, 3]]
    np.testing.assert_array_equal(box.action(outputs), expected)
    low, high = box.normalized_bounds
    np.testing.assert_array_equal(low, [-1, -INF, -INF, 0, -1])
    np.testing.assert_array_equal(high, [1, INF, 1, INF, 1])


def test_of_the_box_from_minus_one_to_one_nothing_changes_but_what_is_clipped():
    outputs = np.random.default_rng(0).normal(size=(1000, 2)).astype(np.float32)
    action = jax.jit(action_box(-1.0, 1.0, 2).action)(outputs)
    np.testing.assert_array_equal(action, np.clip(outputs, -1, 1))


def test_numpy_computes_the_same():
    box, outputs = action_box(-0.3, 17.0, 2), np.linspace(-2, 2, 50, dtype=np.float32).reshape(-1, 2)
    np.testing.assert_allclose(box.action(outputs, np), box.action(outputs), rtol=1e-6, atol=1e-6)
    assert box.action(outputs, np).dtype == np.float32


@pytest.mark.parametrize(
    ("low", "high"),
    [(-2, 3), np.float32([-2, 3]), ([-2, -2], [3, 3]), (np.full(2, -2.0), jnp.full(2, 3.0)), ((-2, -2), 3)],
)
def test_bounds_are_numbers_of_any_kind(low, high):
    box = action_box(low, high, 2)
    for field, expected in {"low": -2, "high": 3, "centre": 0.5, "half_width": 2.5}.items():
        value = getattr(box, field)
        assert value.dtype == np.float32
        np.testing.assert_array_equal(value, [expected, expected])


@pytest.mark.parametrize(
    ("low", "high", "message"),
    [
        (1, -1, "^action_low 1 is not below action_high -1 in component 0$"),
        (1, 1, "^action_low 1 is not below action_high 1 in component 0$"),
        ((0, 3), (1, 3), "^action_low 3 is not below action_high 3 in component 1$"),
        (1, 1 + 1e-9, "^action_low 1 is not below action_high 1 in component 0$"),  # as float32
        (INF, INF, "^action_low inf is not below action_high inf"),
        (np.nan, 1, r"^action_low is not a number \(NaN\); -inf and inf leave a side open$"),
        (0, (1, np.nan), r"^action_high is not a number \(NaN\)"),
        ("low", 1, "^action_low is 'low', not a number, or one for each of 2 components$"),
        (None, 1, "^action_low is None, not a number"),
        (0, (1, (2, 3)), "^action_high is .*, not a number"),
        (-1, 1j, "^action_high is 1j, not a number"),
        (-1, (1, 1, 1), r"^action_high has shape \(3,\), not \(\) or \(2,\)$"),
        ([[-1, -1]], 1, r"^action_low has shape \(1, 2\), not"),
    ],
)
def test_what_is_no_box_is_named_with_its_bound_and_component(low, high, message):
    with pytest.raises(ValueError, match=message):
        action_box(low, high, 2)


def test_one_component_needs_no_number():
    with pytest.raises(ValueError, match="^action_low 2 is not below action_high 1$"):
        action_box(2, 1, 1)

"""What a picture shows of a set of policies."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from jmorl.display.limits import around, hopeful, inside
from jmorl.search.scaling import core

VECTORS = arrays(float, st.tuples(st.integers(1, 12), st.integers(1, 3)), elements=st.floats(-100, 100))


@given(VECTORS)
def test_units_and_origin_decide_nothing(values):
    # Powers of two and small integers, so that no rounding comes in.
    assert (core(np.round(values)) == core(np.round(values) * 4 + 8)).all()
    assert (hopeful(np.round(values)) == hopeful(np.round(values) * 4)).all()


@given(VECTORS)
def test_most_vectors_stay(values):
    for column in values.T[:, :, None]:
        assert core(column).sum() >= len(values) / 2  # at most a quarter lies beyond each quartile
        assert hopeful(column)[column.argmax()]


def test_only_what_is_far_out_is_left_out():
    values = np.array([[-70.0, -40], [-72, -41], [-75, -42], [-77, -43], [-80, -44], [-999, 0]])
    assert core(values).tolist() == [True] * 5 + [False]
    assert core(values[:4]).all()
    assert core(values[[0, 1, 5]]).all()  # too few to say


def test_equal_values_make_none_of_the_others_far_out():
    assert core(np.array([[1.0], [1], [1], [1], [1], [7]])).all()
    far = np.repeat([[0.0, 1, 2, 3, 4, 5, 6, 7]], 8, axis=0).T + 1e6 * np.eye(8)  # each in an objective of its own
    assert core(far).all()


def test_hopeless_is_only_what_is_far_below():
    values = np.concatenate([np.linspace(0, 9, 19), [-100.0]])[:, None]
    assert hopeful(values).tolist() == [True] * 19 + [False]
    assert hopeful(-values).all()
    assert hopeful(np.array([[3.0, 4.0]])).all()


@given(VECTORS)
def test_limits_leave_room(values):
    limits = around(values)
    assert inside(values, limits).all()
    assert (limits[0] < values.min(axis=0)).all() and (limits[1] > values.max(axis=0)).all()

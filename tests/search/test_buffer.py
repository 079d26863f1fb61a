"""The performance buffer keeps the best of each direction, whatever was binned before."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from jmorl.search.buffer import PerformanceBuffer, direction_bins
from jmorl.search.policy import Policy
from jmorl.search.scaling import Scale
from jmorl.search.weights import simplex_grid
from tests.search.policies import policies, policy

offers = (
    st.integers(2, 4)
    .flatmap(lambda m: arrays(float, st.tuples(st.integers(1, 20), st.just(m)), elements=st.floats(-2, 4)))
    .map(policies)
)


def unit_scale(objectives: int) -> Scale:
    return Scale(np.zeros(objectives), np.ones(objectives))


def ids(buffer: PerformanceBuffer) -> list[int]:
    return [member.id for member in buffer.members]


def test_equal_angles_in_two_objectives() -> None:
    degrees = np.array([0.0, 10.0, 22.0, 23.0, 44.0, 46.0, 80.0, 90.0])
    points = np.stack([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))], axis=1)
    assert direction_bins(7 * points, 4).tolist() == [0, 0, 0, 1, 1, 2, 3, 3]


@pytest.mark.parametrize(
    ("objectives", "bins", "divisions"), [(3, 1, 1), (3, 10, 3), (3, 100, 12), (4, 1, 1), (4, 100, 6), (5, 10, 1)]
)
def test_directions_in_more_objectives(objectives: int, bins: int, divisions: int) -> None:
    """The finest even grid that fits into `bins`, or the axes; all points on a ray are in one bin."""
    directions = simplex_grid(objectives, divisions)
    points = np.random.default_rng(0).exponential(size=(3000, objectives))
    found = direction_bins(np.concatenate([directions, points]), bins)
    assert len(set(found[: len(directions)])) == len(set(found)) == len(directions)
    np.testing.assert_array_equal(direction_bins(0.01 * points, bins), found[len(directions) :])


def test_nearest_by_angle_not_by_distance() -> None:
    """With three directions in three objectives, a point belongs to its largest component."""
    points = np.random.default_rng(1).exponential(size=(200, 3)) * 50
    largest = direction_bins(np.eye(3), 3)[np.argmax(points, axis=1)]
    np.testing.assert_array_equal(direction_bins(points, 3), largest)


@given(offers, st.integers(1, 6), st.integers(1, 3))
def test_keeps_the_best_of_each_direction(offered: list[Policy], bins: int, size: int) -> None:
    objectives = len(offered[0].values)
    buffer = PerformanceBuffer(bins, size).offer(offered, unit_scale(objectives))
    points = np.maximum([each.values for each in offered], 0.0)
    norms = [float(np.linalg.norm(point)) for point in points]
    found = direction_bins(points, bins)
    for each, norm, where in zip(offered, norms, found, strict=True):
        rivals = [
            other.id
            for other, other_norm, there in zip(offered, norms, found, strict=True)
            if there == where and (other_norm > norm or (other_norm == norm and other.id < each.id))
        ]
        assert (each in buffer.members) == (len(rivals) < size)


@given(offers, st.integers(1, 6), st.integers(1, 3))
def test_members_are_the_offered_records_in_their_order(offered: list[Policy], bins: int, size: int) -> None:
    scale = unit_scale(len(offered[0].values))
    buffer = PerformanceBuffer(bins, size).offer(offered, scale)
    assert all(any(member is each for each in offered) for member in buffer.members)
    assert ids(buffer) == sorted(ids(buffer))
    assert ids(buffer.offer(offered, scale)) == ids(buffer)
    assert ids(buffer.offer([], scale)) == ids(buffer)


@given(offers, st.integers(0, 20))
def test_one_by_one_is_all_at_once_under_one_scale(offered: list[Policy], cut: int) -> None:
    scale = unit_scale(len(offered[0].values))
    at_once = PerformanceBuffer(5, 2).offer(offered, scale)
    in_parts = PerformanceBuffer(5, 2).offer(offered[:cut], scale).offer(offered[cut:], scale)
    assert ids(in_parts) == ids(at_once)


def test_a_new_scale_bins_everything_anew() -> None:
    offered = policies([[10.0, 0.1], [9.0, 0.9], [8.0, 0.2]])
    coarse = PerformanceBuffer(2, 2).offer(offered, unit_scale(2))
    assert ids(coarse) == [0, 1]
    late = policy(3, [8.0, 0.5])
    # with the second objective stretched, 1 and 3 lie in the other bin and leave room for 0
    stretched = coarse.offer([late], Scale(np.zeros(2), np.array([10.0, 0.4])))
    assert ids(stretched) == [0, 1, 3]


def test_values_below_the_origin_count_as_on_it() -> None:
    offered = policies([[-5.0, -7.0], [0.0, 0.0], [3.0, -9.0], [2.0, 0.0]])
    assert ids(PerformanceBuffer(10, 2).offer(offered, unit_scale(2))) == [2, 3]
    assert ids(PerformanceBuffer(10, 9).offer(offered, unit_scale(2))) == [0, 1, 2, 3]


def test_dominated_policies_are_kept() -> None:
    offered = policies([[1.0, 1.0], [2.0, 2.0], [3.0, 3.0]])
    assert ids(PerformanceBuffer(100, 2).offer(offered, unit_scale(2))) == [1, 2]


def test_unusable_values_are_refused_by_name() -> None:
    with pytest.raises(ValueError, match="policy 4 has values"):
        PerformanceBuffer(10, 2).offer([policy(4, [np.nan, 1.0])], unit_scale(2))

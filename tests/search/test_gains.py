"""What points add to a front, against differences of moocore's exact hypervolume."""

import moocore
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from jmorl.search import gains
from jmorl.search.gains import covered, estimated_gains, measured_gain, planar_gains, solid_gains, solid_limits
from jmorl.search.pareto import non_dominated

# multiples of 1/4: hypervolumes are exact
quarters = st.integers(-1, 8).map(lambda n: n / 4)
Problem = tuple[np.ndarray, np.ndarray, np.ndarray]


@st.composite
def problems(draw: st.DrawFn, objectives: st.SearchStrategy[int]) -> Problem:
    """Points [Q, M], a front [N, M] that covers none of them, and a reference point [M]."""
    m = draw(objectives)
    points = draw(arrays(float, st.tuples(st.integers(1, 9), st.just(m)), elements=quarters))
    front = draw(arrays(float, st.tuples(st.integers(0, 7), st.just(m)), elements=quarters))
    front = front[non_dominated(front)]
    beneath = (front[None] >= points[:, None]).all(axis=2).any(axis=1)
    np.testing.assert_array_equal(covered(points, front), beneath)
    return points[~beneath], front, draw(arrays(float, m, elements=quarters))


def differences(points: np.ndarray, front: np.ndarray, reference: np.ndarray) -> list[float]:
    """The gains by definition."""
    return [volume(np.vstack([front, point]), reference) - volume(front, reference) for point in points]


def volume(values: np.ndarray, reference: np.ndarray) -> float:
    return float(moocore.hypervolume(values.copy(), ref=reference, maximise=True))


def random_problem(objectives: int, members: int, seed: int = 0) -> Problem:
    generator = np.random.default_rng(seed)
    directions = np.abs(generator.normal(size=(members, objectives)))
    front = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    points = front[:20] * generator.uniform(1.0, 1.3, size=(20, 1))
    return points, front, np.full(objectives, -0.1)


@given(problems(st.just(2)))
def test_planar_gains_are_the_differences(problem: Problem) -> None:
    np.testing.assert_array_equal(planar_gains(*problem), differences(*problem))


@given(problems(st.just(3)))
def test_solid_gains_are_the_differences(problem: Problem) -> None:
    np.testing.assert_array_equal(solid_gains(*problem), differences(*problem))
    assert (solid_limits(*problem) >= differences(*problem)).all()


def test_solid_limits_cover_rounding_and_no_more() -> None:
    points, front, reference = random_problem(3, 200)
    limits, exact = solid_limits(points, front, reference), differences(points, front, reference)
    assert (limits >= exact).all()
    np.testing.assert_allclose(limits, exact, rtol=1e-7)


@given(problems(st.integers(2, 6)))
def test_a_measured_gain_is_the_difference(problem: Problem) -> None:
    points, front, reference = problem
    measured = [measured_gain(point, front, reference) for point in points]
    np.testing.assert_allclose(measured, differences(*problem), atol=1e-12)


@pytest.mark.parametrize(("objectives", "members"), [(2, 20), (4, 60), (6, 60), (8, 40)])
def test_where_exact_takes_long_a_gain_is_estimated(
    objectives: int, members: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    points, front, reference = random_problem(objectives, members)
    monkeypatch.setattr(gains, "exact_is_quick", lambda *_: False)
    monkeypatch.setattr(gains, "DIRECTIONS", 20_000)
    estimates = [measured_gain(point, front, reference) for point in points]
    np.testing.assert_allclose(estimates, differences(points, front, reference), rtol=0.1)


@pytest.mark.parametrize(("objectives", "members"), [(2, 20), (4, 60), (6, 60), (8, 40)])
def test_estimates_of_all_come_near_the_differences(objectives: int, members: int) -> None:
    points, front, reference = random_problem(objectives, members)
    exact = np.array(differences(points, front, reference))
    estimates = estimated_gains(points, front, reference, 200_000)
    np.testing.assert_allclose(estimates, exact, rtol=0.15, atol=0.02 * exact.max())


def test_estimates_do_not_depend_on_units() -> None:
    points, front, reference = random_problem(8, 40)
    units = 10.0 ** np.arange(-20, 20, 5)
    scaled = estimated_gains(points * units, front * units, reference * units, 256)
    np.testing.assert_allclose(scaled / units.prod(), estimated_gains(points, front, reference, 256), rtol=1e-9)
    one = measured_gain(points[0] * units, front * units, reference * units)
    np.testing.assert_allclose(one / units.prod(), measured_gain(points[0], front, reference), rtol=1e-9)


@pytest.mark.parametrize("objectives", [2, 5, 31])
def test_a_point_alone_gains_its_box_and_one_below_the_reference_nothing(objectives: int) -> None:
    nothing, reference = np.zeros((0, objectives)), np.zeros(objectives)
    point = np.linspace(0.5, 1.5, objectives)
    assert measured_gain(point, nothing, reference) == pytest.approx(point.prod())
    estimate = estimated_gains(np.stack([point, -point]), nothing, reference, 2048)
    assert estimate[1] == 0.0 and measured_gain(-point, nothing, reference) == 0.0
    assert np.isfinite(estimate[0]) and estimate[0] > 0

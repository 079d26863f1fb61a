"""The prediction model: which records it uses, what it makes of them, and that units do not matter."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from jmorl.search.prediction import Records, neighbourhoods, predict
from jmorl.search.scaling import Scale, range_scale
from jmorl.search.weights import simplex_grid


def records_of(parents: np.ndarray, weights: np.ndarray, children: np.ndarray) -> Records:
    """Records of tasks [R, M] of which nothing was predicted."""
    return Records.empty(parents.shape[1]).add(parents, weights, children)


def random_records(generator: np.random.Generator, count: int, objectives: int, spread: float = 1.0) -> Records:
    grid = simplex_grid(objectives, 4)
    parents = spread * generator.uniform(size=(count, objectives))
    weights = grid[generator.integers(len(grid), size=count)]
    return records_of(parents, weights, parents + 0.1 * generator.normal(size=parents.shape))


def importance_by_doubling(candidate: np.ndarray, records: Records) -> np.ndarray:
    """The rule as it is stated: double tau and sigma until there are enough different weights."""
    tau, sigma = 0.1, 0.03
    enough = min(4, len({tuple(weight) for weight in records.weights}))
    while True:
        near = (np.abs(records.parents - candidate) < tau).all(axis=1)
        different = len({tuple(weight) for weight in records.weights[near]})
        if near.all() or (different >= enough and enough == 4):
            distances = np.linalg.norm(records.parents - candidate, axis=1)
            return np.where(near, np.exp(-(distances**2) / (2 * sigma**2)), 0.0)
        tau, sigma = 2 * tau, 2 * sigma


@given(st.integers(0, 2**32 - 1), st.integers(1, 12), st.integers(2, 4), st.sampled_from([0.1, 1.0, 300.0]))
def test_neighbourhoods_follow_the_rule(seed: int, count: int, objectives: int, spread: float) -> None:
    generator = np.random.default_rng(seed)
    records = random_records(generator, count, objectives, spread)
    candidates = spread * generator.uniform(size=(5, objectives))
    importance, nearest = neighbourhoods(candidates, records)
    for column, candidate in enumerate(candidates):
        found = np.zeros(count)
        found[nearest[:, column]] = importance[:, column]
        np.testing.assert_allclose(found, importance_by_doubling(candidate, records), rtol=1e-9)


def test_many_records_of_one_weight_are_not_enough() -> None:
    """The ten nearest records share their weights, so farther ones with other weights count too."""
    near, far = np.full((10, 2), 0.01), np.full((3, 2), 0.35)
    weights = np.array([[0.5, 0.5]] * 10 + [[0.1, 0.9], [0.2, 0.8], [0.3, 0.7]])
    records = records_of(np.concatenate([near, far]), weights, np.zeros((13, 2)))
    importance, _ = neighbourhoods(np.zeros((1, 2)), records)
    assert (importance > 0).all() and len(importance) == 13
    assert (neighbourhoods(np.zeros((1, 2)), records_of(near, weights[:10], near))[0] > 0.8).all()


@pytest.mark.parametrize("distance", [1e3, 1e9, 1e100])
def test_records_far_away_are_reached(distance: float) -> None:
    records = random_records(np.random.default_rng(0), 8, 3)
    predicted = predict(np.full((2, 3), distance), simplex_grid(3, 2), records)
    assert np.isfinite(predicted.expected).all() and np.isfinite(predicted.spread).all()


@pytest.mark.parametrize("objectives", [2, 3])
def test_without_records_nothing_changes(objectives: int) -> None:
    candidates = np.random.default_rng(0).uniform(size=(4, objectives))
    weights = simplex_grid(objectives, 3)
    predicted = predict(candidates, weights, Records.empty(objectives)).expected
    np.testing.assert_array_equal(predicted, np.broadcast_to(candidates[:, None], (4, len(weights), objectives)))


def test_one_record_is_what_is_expected_everywhere() -> None:
    record = records_of(np.array([[0.2, 0.3]]), np.array([[0.5, 0.5]]), np.array([[0.25, 0.2]]))
    predicted = predict(np.array([[0.2, 0.3], [9.0, -4.0]]), simplex_grid(2, 2), record).expected
    change = predicted - np.array([[[0.2, 0.3]], [[9.0, -4.0]]])
    np.testing.assert_allclose(change, np.broadcast_to([0.05, -0.1], (2, 3, 2)), atol=1e-9)


@pytest.mark.parametrize("objectives", [2, 3])
def test_a_planted_response_is_recovered(objectives: int) -> None:
    """Each objective responds to its own weight along its own curve; all parents are near each other."""
    generator = np.random.default_rng(1)
    grid = simplex_grid(objectives, 10)
    size, steepness = np.array([0.3, 0.15, 0.2])[:objectives], np.array([6.0, 4.0, 8.0])[:objectives]

    def response(weights: np.ndarray) -> np.ndarray:
        return size * np.tanh(steepness * (weights - 0.4) / 2) + 0.05

    parents = 0.5 + generator.uniform(-0.04, 0.04, size=(40, objectives))
    weights = grid[generator.integers(len(grid), size=40)]
    candidates = 0.5 + generator.uniform(-0.02, 0.02, size=(6, objectives))
    predicted = predict(candidates, grid, records_of(parents, weights, parents + response(weights))).expected
    np.testing.assert_allclose(predicted, candidates[:, None] + response(grid), atol=2e-3)


@pytest.mark.parametrize("objectives", [2, 3])
def test_a_candidate_and_a_weight_do_not_depend_on_their_company(objectives: int) -> None:
    generator = np.random.default_rng(2)
    records = random_records(generator, 30, objectives)
    candidates, grid = generator.uniform(size=(7, objectives)), simplex_grid(objectives, 5)
    together = predict(candidates, grid, records).expected
    for c, w in [(0, 0), (3, 2), (6, len(grid) - 1)]:
        alone = predict(candidates[[c]], grid[[w]], records).expected
        np.testing.assert_allclose(together[c, w], alone[0, 0], rtol=1e-6, atol=1e-8)


def test_records_are_kept_raw_and_units_do_not_matter() -> None:
    generator = np.random.default_rng(3)
    raw = random_records(generator, 30, 3)
    candidates, grid = generator.uniform(size=(5, 3)), simplex_grid(3, 4)
    units = Scale(np.array([7.0, -3.0, 100.0]), np.array([0.001, 20.0, 1000.0]))  # from other units to these

    def predicted_in_own_units(candidates: np.ndarray, records: Records) -> np.ndarray:
        scale = range_scale(records.parents)
        return scale.invert(predict(scale.apply(candidates), grid, records.scaled(scale)).expected)

    expected = predicted_in_own_units(candidates, raw)
    other = records_of(units.invert(raw.parents), raw.weights, units.invert(raw.children))
    found = units.apply(predicted_in_own_units(units.invert(candidates), other))
    np.testing.assert_allclose(found, expected, atol=1e-5)


def test_records_grow_row_by_row() -> None:
    parents, weights, children = np.arange(18.0).reshape(3, 2, 3)
    records = Records.empty(3).add(parents, weights, children).add(parents[:1], weights[:1], children[:1])
    for grown, rows in [(records.parents, parents), (records.weights, weights), (records.children, children)]:
        np.testing.assert_array_equal(grown, [*rows, rows[0]])


@pytest.mark.parametrize("noise", [0.01, 0.1])
def test_the_spread_is_that_of_what_comes(noise: float) -> None:
    """With many near records it is their noise about the curve, whatever the curve."""
    generator = np.random.default_rng(4)
    parents, weights = 0.5 + generator.uniform(-0.01, 0.01, (400, 2)), simplex_grid(2, 10)[np.arange(400) % 11]
    changes = 0.2 * np.tanh(weights - 0.5) + generator.normal(0, noise, (400, 2))
    spread = predict(np.full((1, 2), 0.5), simplex_grid(2, 10), records_of(parents, weights, parents + changes)).spread
    np.testing.assert_allclose(spread, noise, rtol=0.15)


def test_far_from_all_records_the_spread_is_their_usual_change() -> None:
    parents = np.zeros((1, 2))
    spread = predict(np.full((1, 2), 9.0), simplex_grid(2, 2), records_of(parents, parents + 0.5, parents + 0.3)).spread
    np.testing.assert_allclose(spread, 0.3 * np.sqrt(2 / 3 * 3 / 2), rtol=1e-6)


@pytest.mark.parametrize("size", [0.3, 1.0, 4.0])
def test_intervals_hold_what_they_promise_whatever_the_spread_is_worth(size: float) -> None:
    """Surprises of another size than assumed, and not centred: the last ones say how wide an interval must be."""
    generator = np.random.default_rng(5)
    records, held = Records.empty(2), []
    for generation in range(200):
        low, high = records.interval_ends()
        nothing = np.zeros((6, 2))
        surprises = size * (generator.normal(size=(6, 2)) - 0.5)
        if generation > 6:
            held.append(((low <= surprises) & (surprises <= high)).mean())
        records = records.add(nothing, nothing, nothing, surprises)
    assert 0.75 <= np.mean(held) <= 0.85


def test_intervals_before_there_are_surprises_are_those_of_a_normal_distribution() -> None:
    ends = records_of(*np.zeros((3, 5, 2))).interval_ends()
    np.testing.assert_allclose(ends, [[-1.28155] * 2, [1.28155] * 2], atol=1e-4)

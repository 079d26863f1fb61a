"""The exact front: laws of an optimum, and its episodes replayed in MO-Gymnasium's own environment."""

import math
from pathlib import Path

import numpy as np
import pytest
from mo_gymnasium.envs.continuous_mountain_car.continuous_mountain_car import MOContinuousMountainCar

from benchmarks.car_values import ENVIRONMENT, Grid, optimal_values
from benchmarks.exact_front import Episodes, greedy_episodes
from benchmarks.trajectory_polish import least_fuel_forces, played_return, polished_return

GRID = Grid(201, 141)
STARTS = np.linspace(-0.6, -0.4, 8)
ON_TIME = np.array([0.2, 0.4, 0.6, 0.8])
WEIGHTS = np.stack([ON_TIME, 1 - ON_TIME], axis=1)


@pytest.fixture(scope="module")
def values() -> np.ndarray:  # [W, I, J]
    return optimal_values(WEIGHTS, GRID, cache=None)


@pytest.fixture(scope="module")
def episodes(values: np.ndarray) -> Episodes:
    return greedy_episodes(values, WEIGHTS, STARTS)


def replay(forces: np.ndarray, start: float) -> tuple[np.ndarray, bool]:
    """The vector return [2] of forces [N] in MO-Gymnasium, coasting on afterwards, and whether the car arrived."""
    environment = MOContinuousMountainCar()
    environment.state = np.array([start, 0.0], np.float32)
    total = np.zeros(2)
    for force in (*forces, 0.0, 0.0):
        _, reward, terminated, _, _ = environment.step(np.array([force], np.float32))
        total += reward
        if terminated:
            return total, True
    return total, False


def pumping_return(start: float, strength: float) -> np.ndarray:  # [2]
    """The (time, fuel) of pushing with constant strength where the car already goes, in plain Python."""
    position, velocity, steps, limit = start, 0.0, 0, 999
    while steps < limit:
        force = math.copysign(strength, velocity)
        velocity = velocity + 0.0015 * force - 0.0025 * math.cos(3 * position)
        velocity = max(-0.07, min(0.07, velocity))
        position = max(-1.2, min(0.6, position + velocity))
        if position == -1.2:
            velocity = max(0.0, velocity)
        steps += 1
        if position >= 0.45 and velocity >= 0:
            return np.array([1 - steps, -steps * strength**2])
    return np.array([-steps, -steps * strength**2])


def test_values_are_convex_in_the_weight(values: np.ndarray) -> None:
    """At every state the value is a maximum, over policies, of functions linear in the weight."""
    chord = (values[:-2] + values[2:]) / 2
    assert (values[1:-1] <= chord + 0.01).all()
    assert (values[1:-1] < chord - 0.01).mean() > 0.5  # and not merely linear


def test_more_weight_on_time_buys_time_with_fuel(episodes: Episodes) -> None:
    time, fuel = episodes.returns.mean(axis=1).T
    assert (np.diff(time) > 0).all()
    assert (np.diff(fuel) < 0).all()


def test_each_weight_prefers_its_own_policy(episodes: Episodes) -> None:
    utilities = WEIGHTS @ episodes.returns.mean(axis=1).T  # [W, W] weight by policy
    assert (utilities.argmax(axis=1) == np.arange(len(WEIGHTS))).all()


def test_every_episode_terminates(episodes: Episodes) -> None:
    """A step costs one unit of time unless it terminates: only then are there fewer units than steps."""
    assert (episodes.steps < 999).all()
    assert (episodes.returns[..., 0] == 1 - episodes.steps).all()


def test_returns_equal_a_replay_in_mo_gymnasium(episodes: Episodes) -> None:
    for w in range(len(WEIGHTS)):
        for s, start in enumerate(STARTS):
            returns, arrived = replay(episodes.forces[w, : episodes.steps[w, s], s], start)
            assert arrived
            # Rounding may carry a car across the flag's edge one step sooner or later.
            assert returns == pytest.approx(episodes.returns[w, s], abs=1.0)
    exact = [
        replay(episodes.forces[1, : episodes.steps[1, s], s], start)[0] == pytest.approx(episodes.returns[1, s], 1e-4)
        for s, start in enumerate(STARTS)
    ]
    assert np.mean(exact) >= 0.75


def test_no_simple_policy_does_better(episodes: Episodes) -> None:
    utility = np.einsum("wsm,wm->ws", episodes.returns, WEIGHTS)
    for s, start in enumerate(STARTS):
        pumped = np.stack([pumping_return(start, strength) for strength in np.linspace(0.2, 1.0, 81)])
        best = (pumped @ WEIGHTS.T).max(axis=0)
        assert (best < utility[:, s]).all()
        assert (best > 2 * utility[:, s]).all()  # a rival all the same: not moving at all costs 999 units of time


def test_value_promises_what_the_episode_keeps(values: np.ndarray, episodes: Episodes) -> None:
    row = np.interp(STARTS, np.linspace(-1.2, 0.6, GRID.positions), np.arange(GRID.positions))
    at_rest = values[:, row.round().astype(int), GRID.velocities // 2]
    utility = np.einsum("wsm,wm->ws", episodes.returns, WEIGHTS)
    assert at_rest.mean(axis=1) == pytest.approx(utility.mean(axis=1), rel=0.01)


def test_polishing_gains_little_and_only_gains(episodes: Episodes) -> None:
    for w in (0, 2):
        weight = WEIGHTS[w]
        forces = episodes.forces[w, : episodes.steps[w, 3], 3]
        polished = polished_return(ENVIRONMENT, forces, STARTS[3], weight) @ weight
        utility = episodes.returns[w, 3] @ weight
        assert 0 < polished - utility < 0.01 * abs(utility)


def test_polishing_finds_back_a_spoilt_episode(episodes: Episodes) -> None:
    """The optimum reached does not depend on where the search began."""
    forces = episodes.forces[1, : episodes.steps[1, 0], 0]
    spoilt = np.clip(forces + 0.1 * np.sin(np.arange(len(forces))), -1, 1)
    fuel = [(least_fuel_forces(ENVIRONMENT, first, STARTS[0], len(forces)) ** 2).sum() for first in (forces, spoilt)]
    assert fuel[1] == pytest.approx(fuel[0], rel=1e-4)


def test_an_episode_that_ends_too_soon_cannot_be_polished() -> None:
    assert played_return(ENVIRONMENT, np.zeros(10), -0.5) is None
    with pytest.raises(ValueError, match="does not terminate within its 10 steps"):
        polished_return(ENVIRONMENT, np.zeros(10), -0.5, WEIGHTS[0])


def test_a_stored_solution_is_the_solution(tmp_path: Path) -> None:
    small = Grid(61, 41)
    fresh = optimal_values(WEIGHTS[:2], small, cache=None)
    assert (optimal_values(WEIGHTS[:2], small, tmp_path) == fresh).all()
    for file in tmp_path.iterdir():
        np.save(file, np.load(file) + 1)
    assert (optimal_values(WEIGHTS[:2], small, tmp_path) == fresh + 1).all()  # nothing is solved again


@pytest.mark.parametrize(
    ("weights", "complaint"),
    [([0.5, 0.5], r"\[W, 2\]"), ([[0.01, 0.99]], "at least 2% on time"), ([[1.1, -0.1]], "negative")],
)
def test_weights_without_an_exact_answer_are_refused(weights: list, complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        optimal_values(np.array(weights), GRID, cache=None)

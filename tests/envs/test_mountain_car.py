"""The mountain car against MO-Gymnasium's, one step from each of many states, walls and goal edge included."""

from typing import Any

import gymnasium
import jax
import jax.numpy as jnp
import mo_gymnasium
import numpy as np
import pytest
import scipy.stats

import envs
from envs.mountain_car import GOAL_POSITION, LEFT_WALL, MAX_SPEED, RIGHT_WALL, CarState

ID = "mo-mountaincarcontinuous-v0"
STATES = 10_000


@pytest.fixture(scope="module")
def cases():
    """Positions, velocities and actions in float32: the whole range, and the edges where cases differ."""
    generator = np.random.default_rng(0)
    position = generator.uniform(LEFT_WALL, RIGHT_WALL, STATES)
    velocity = generator.uniform(-MAX_SPEED, MAX_SPEED, STATES)
    action = generator.uniform(-1.5, 1.5, STATES)
    quarter = STATES // 4
    position[:quarter] = LEFT_WALL + generator.uniform(0, 0.05, quarter)  # against the left wall
    velocity[:quarter] = -np.abs(velocity[:quarter])
    position[quarter : 2 * quarter] = GOAL_POSITION + generator.uniform(-0.07, 0.01, quarter)  # around the goal
    return tuple(array.astype(np.float32) for array in (position, velocity, action))


@pytest.fixture(scope="module")
def reference(cases):
    """MO-Gymnasium's answers from the same states."""
    real: Any = mo_gymnasium.make(ID).unwrapped
    real.reset(seed=0)
    rows = []
    for position, velocity, action in zip(*cases, strict=True):
        real.state = np.array([position, velocity], np.float32)
        observation, reward, terminated, truncated, _ = real.step(np.array([action], np.float32))
        rows.append((*observation, *reward, terminated))
    return np.array(rows)


def test_one_step_from_many_states(cases, reference):
    position, velocity, action = map(jnp.asarray, cases)
    car = envs.make(ID)
    result = jax.vmap(car.transition)(CarState(position, velocity), action[:, None])
    # An edge can be met to the last bit on one side only; there a difference of one bit decides the case.
    near_goal = np.abs(reference[:, 0] - GOAL_POSITION) < 1e-6
    near_wall = (np.abs(reference[:, 0] - LEFT_WALL) < 1e-6) & (reference[:, 0] != LEFT_WALL)
    clear = ~near_goal & ~near_wall
    assert clear.mean() > 0.999
    assert reference[clear, 4].any() and (reference[:, 0] == np.float32(LEFT_WALL)).any()
    np.testing.assert_allclose(result.state.position[clear], reference[clear, 0], rtol=0, atol=2e-7)
    np.testing.assert_allclose(result.state.velocity[clear], reference[clear, 1], rtol=0, atol=2e-7)
    np.testing.assert_array_equal(result.terminated[clear], reference[clear, 4].astype(bool))


def test_reward_is_the_environments_own(cases, reference):
    position, velocity, action = map(jnp.asarray, cases)
    result = jax.vmap(envs.make(ID).transition)(CarState(position, velocity), action[:, None])
    expected_time = np.where(result.terminated, 0.0, -1.0)
    np.testing.assert_array_equal(result.reward[:, 0], expected_time)
    inside = np.abs(cases[2]) <= 1  # MO-Gymnasium charges for force that the car does not have
    np.testing.assert_allclose(result.reward[inside, 1], reference[inside, 3], atol=2e-7)
    np.testing.assert_allclose(result.reward[:, 1], -(np.clip(cases[2], -1, 1) ** 2), atol=2e-7)


def test_start_distribution():
    states = jax.vmap(envs.make(ID).initial_state)(jax.random.split(jax.random.key(0), 5000))
    assert scipy.stats.kstest(states.position, scipy.stats.uniform(-0.6, 0.2).cdf).pvalue > 1e-3
    assert (states.velocity == 0).all()


def test_time_limit_is_the_registered_one():
    assert gymnasium.spec("MountainCarContinuous-v0").max_episode_steps == envs.make(ID).time_limit

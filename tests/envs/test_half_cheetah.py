"""The half cheetah against MO-Gymnasium's: steps from the same states, rewards, starts, and how it is chosen."""

from functools import cache
from importlib.resources import files

import gymnasium
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.stats

import envs
from envs.gymnasium import original
from envs.half_cheetah import FRAME_SKIP, TIMESTEP, HalfCheetah
from envs.physics import BodyState

ID = "mo-halfcheetah-v5"
PHYSICS = ["planar", pytest.param("mjx", marks=pytest.mark.slow)]


@pytest.fixture(scope="module")
def real():
    return original(ID).unwrapped


@pytest.fixture(scope="module")
def visited(real):
    """States that random actions lead to, and the action taken at each: qpos [N, 9], qvel [N, 9], action [N, 6]."""
    generator = np.random.default_rng(0)
    rows = []
    for seed in range(8):
        real.reset(seed=seed)
        for _ in range(40):
            action = generator.uniform(-1.0, 1.0, 6)
            rows.append((real.data.qpos.copy(), real.data.qvel.copy(), action))
            real.step(action)
    return tuple(np.stack(column).astype(np.float32) for column in zip(*rows, strict=True))


def steps_of(real, qpos, qvel, action):
    """MO-Gymnasium's observations [N, 17] and rewards [N, 2], one step from each state."""
    rows = []
    for position, velocity, act in zip(qpos, qvel, action, strict=True):
        real.set_state(position.astype(np.float64), velocity.astype(np.float64))
        observation, reward, terminated, truncated, _ = real.step(act)
        assert not terminated and not truncated
        rows.append((observation, reward))
    return tuple(np.stack(column) for column in zip(*rows, strict=True))


@cache
def compiled(physics):
    cheetah = HalfCheetah(physics)
    return jax.jit(jax.vmap(cheetah.transition)), jax.vmap(cheetah.observe)


def transitions(physics, qpos, qvel, action):
    """Our observations, rewards and terminations, one step from each state."""
    transition, observe = compiled(physics)
    states = BodyState(jnp.asarray(qpos), jnp.asarray(qvel))
    result = transition(states, jnp.asarray(action))
    return observe(result.state), result.reward, result.terminated


@pytest.mark.parametrize("physics", PHYSICS)
def test_one_step_from_visited_states(physics, real, visited):
    observation, reward, terminated = transitions(physics, *visited)
    expected_observation, expected_reward = steps_of(real, *visited)
    np.testing.assert_allclose(reward, expected_reward, rtol=1e-4, atol=1e-4)
    np.testing.assert_allclose(observation, expected_observation, rtol=1e-3, atol=1e-3)
    assert np.median(np.abs(observation - expected_observation)) < 1e-5
    assert not terminated.any()


@pytest.mark.parametrize("physics", PHYSICS)
def test_thirty_steps_from_the_same_start(physics, real):
    cheetah = HalfCheetah(physics)
    state, _ = cheetah.reset(jax.random.key(1))
    actions = 0.5 * jnp.sin(0.4 * jnp.arange(30.0)[:, None] + jnp.arange(6.0)[None])
    _, steps = jax.jit(lambda state: jax.lax.scan(cheetah.advance, state, actions))(state)
    real.set_state(*(np.asarray(each, np.float64) for each in (state.physics.qpos, state.physics.qvel)))
    expected = [real.step(np.asarray(action))[:2] for action in actions]
    np.testing.assert_allclose(steps.observation, [observation for observation, _ in expected], atol=5e-3)
    np.testing.assert_allclose(steps.reward, [reward for _, reward in expected], atol=1e-3)


def test_control_is_charged_as_clipped(visited):
    """MO-Gymnasium charges for torque that the motors do not have."""
    qpos, qvel, action = visited
    _, reward, _ = transitions("planar", qpos, qvel, 3 * action)
    _, clipped, _ = transitions("planar", qpos, qvel, np.clip(3 * action, -1, 1))
    np.testing.assert_array_equal(reward, clipped)
    np.testing.assert_allclose(reward[:, 1], -(np.clip(3 * action, -1, 1) ** 2).sum(1), rtol=1e-6)


def test_speed_keeps_its_digits_ten_kilometres_away(real, visited):
    qpos, qvel, action = visited
    far = qpos.copy()
    far[:, 0] = 10_000.0
    observation, reward, _ = transitions("planar", far, qvel, action)
    expected_observation, expected_reward = steps_of(real, far, qvel, action)
    np.testing.assert_allclose(reward[:, 0], expected_reward[:, 0], rtol=1e-4, atol=1e-4)
    np.testing.assert_allclose(observation, expected_observation, rtol=1e-3, atol=1e-3)


def test_starts_are_distributed_as_gymnasiums(real):
    states = jax.vmap(HalfCheetah().initial_state)(jax.random.split(jax.random.key(0), 3000))
    theirs = []
    for seed in range(3000):
        real.reset(seed=seed)
        theirs.append(np.concatenate([real.data.qpos, real.data.qvel]))
    ours = np.concatenate([states.qpos, states.qvel], axis=1)
    for index, (mine, other) in enumerate(zip(ours.T, np.stack(theirs).T, strict=True)):
        assert scipy.stats.ks_2samp(mine, other).pvalue > 1e-4, index
    assert np.abs(np.corrcoef(ours.T) - np.eye(18)).max() < 0.1


def test_sizes_and_times_are_the_models_and_the_registered_ones(real):
    cheetah = HalfCheetah()
    assert (cheetah.model.nq, cheetah.model.nv, cheetah.model.nu) == (9, 9, cheetah.action_size)
    assert (cheetah.model.opt.timestep, real.frame_skip) == (TIMESTEP, FRAME_SKIP)
    assert cheetah.step_seconds == pytest.approx(real.dt)
    np.testing.assert_array_equal(cheetah.model.qpos0, 0)
    assert (cheetah.model.actuator_ctrlrange == [cheetah.action_low, cheetah.action_high]).all()
    assert gymnasium.spec(ID).max_episode_steps == cheetah.time_limit


def test_the_model_is_gymnasiums_file():
    ours = files("envs").joinpath("assets", "half_cheetah.xml").read_bytes()
    assert ours == files("gymnasium").joinpath("envs", "mujoco", "assets", "half_cheetah.xml").read_bytes()


def test_physics_is_an_option_of_the_id():
    for environment in (envs.make(ID, physics="mjx"), envs.make(f"{ID},physics=mjx")):
        assert isinstance(environment, HalfCheetah)
        assert type(environment.physics).__name__ == "MjxPhysics"
    with pytest.raises(ValueError, match="physics must be planar or mjx, not 'bullet'"):
        envs.make(f"{ID},physics=bullet")


@pytest.mark.parametrize("physics", ["planar", "mjx"])
def test_physics_first_used_under_a_trace_outlives_it(physics):
    """Arrays of the physics made while tracing must not belong to the trace."""
    cheetah = HalfCheetah(physics)
    state = cheetah.initial_state(jax.random.key(0))
    shapes = [jax.eval_shape(cheetah.transition, state, jnp.zeros(6)).reward.shape for _ in range(2)]
    assert shapes == [(2,), (2,)]

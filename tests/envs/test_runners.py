"""The runners against MO-Gymnasium's: steps from the same states, rewards, ends, starts, and how physics is chosen."""

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
from envs.half_cheetah import HalfCheetah
from envs.hopper import Hopper, Hopper2
from envs.physics import BodyState
from envs.walker2d import Walker2d

RUNNERS = [HalfCheetah, Walker2d, Hopper, Hopper2]
CHEETAH = HalfCheetah.id
PHYSICS = ["planar", pytest.param("mjx", marks=pytest.mark.slow)]


@pytest.fixture(params=RUNNERS, scope="module", ids=[runner.id for runner in RUNNERS])
def runner(request):
    return request.param


@cache
def real_of(runner):
    return original(runner.id).unwrapped


@pytest.fixture(scope="module")
def real(runner):
    return real_of(runner)


@cache
def visited_by(runner):
    """States that random actions lead to, falls included, and the actions taken: qpos, qvel and action [N, ...]."""
    real, generator = real_of(runner), np.random.default_rng(0)
    rows = []
    for seed in range(8):
        real.reset(seed=seed)
        for _ in range(40):
            action = generator.uniform(-1.0, 1.0, runner.action_size)
            rows.append((real.data.qpos.copy(), real.data.qvel.copy(), action))
            real.step(action)
    return tuple(np.stack(column).astype(np.float32) for column in zip(*rows, strict=True))


@pytest.fixture(scope="module")
def visited(runner):
    return visited_by(runner)


def steps_of(real, qpos, qvel, action):
    """MO-Gymnasium's observations [N, O], rewards [N, M] and ends [N], one step from each state."""
    rows = []
    for position, velocity, act in zip(qpos, qvel, action, strict=True):
        real.set_state(position.astype(np.float64), velocity.astype(np.float64))
        observation, reward, terminated, truncated, _ = real.step(act)
        assert not truncated
        rows.append((observation, reward, terminated))
    return tuple(np.stack(column) for column in zip(*rows, strict=True))


@cache
def compiled(runner, physics):
    environment = runner(physics)
    return jax.jit(jax.vmap(environment.transition)), jax.vmap(environment.observe)


def transitions(runner, physics, qpos, qvel, action):
    """Our observations, rewards and terminations, one step from each state."""
    transition, observe = compiled(runner, physics)
    states = BodyState(jnp.asarray(qpos), jnp.asarray(qvel))
    result = transition(states, jnp.asarray(action))
    return observe(result.state), result.reward, result.terminated


@pytest.mark.parametrize("physics", PHYSICS)
def test_one_step_from_visited_states(runner, physics, real, visited):
    observation, reward, terminated = transitions(runner, physics, *visited)
    expected_observation, expected_reward, ends = steps_of(real, *visited)
    np.testing.assert_allclose(reward, expected_reward, rtol=1e-4, atol=3e-4)
    np.testing.assert_allclose(observation, expected_observation, rtol=1e-3, atol=1e-3)
    assert np.median(np.abs(observation - expected_observation)) < 1e-5
    np.testing.assert_array_equal(terminated, ends)
    assert (0.1 < ends.mean() < 0.9) == (runner is not HalfCheetah)


@pytest.mark.parametrize("physics", PHYSICS)
def test_thirty_steps_from_the_same_start(runner, physics, real):
    environment = runner(physics)
    state, _ = environment.reset(jax.random.key(1))
    actions = 0.5 * jnp.sin(0.4 * jnp.arange(30.0)[:, None] + jnp.arange(float(runner.action_size))[None])
    _, steps = jax.jit(lambda state: jax.lax.scan(environment.advance, state, actions))(state)
    real.set_state(*(np.asarray(each, np.float64) for each in (state.physics.qpos, state.physics.qvel)))
    expected = [real.step(np.asarray(action))[:3] for action in actions]
    observation, reward, terminated = (np.stack(column) for column in zip(*expected, strict=True))
    np.testing.assert_allclose(steps.observation, observation, atol=5e-3)
    np.testing.assert_allclose(steps.reward, reward, atol=1e-3)
    np.testing.assert_array_equal(steps.terminated, terminated)


@pytest.mark.parametrize("runner", RUNNERS[1:], indirect=True)
@pytest.mark.parametrize(
    ("what", "value"),
    [("z", 0.1), ("z", 5.0), ("angle", 0.25), ("angle", -1.5), ("joint", 101.0), ("speed", -130.0)],
)
def test_ends_where_mo_gymnasiums_does(what, value, runner, real):
    """Whatever is out of bounds, also where it is not for the other runner."""
    qpos, qvel = real.model.qpos0.copy(), np.zeros(real.model.nv)
    if what == "speed":
        qvel[-1] = value
    else:
        qpos[{"z": 1, "angle": 2, "joint": -1}[what]] = value
    qpos, qvel = (each.astype(np.float32) for each in (qpos, qvel))
    action = np.zeros((1, runner.action_size), np.float32)
    _, reward, terminated = transitions(runner, "planar", qpos[None], qvel[None], action)
    _, expected, ends = steps_of(real, qpos[None], qvel[None], action)
    np.testing.assert_array_equal(terminated, ends)
    np.testing.assert_allclose(reward, expected, rtol=1e-3, atol=2e-2)


def test_control_is_charged_as_clipped(runner, visited):
    """MO-Gymnasium charges for torque that the motors do not have."""
    qpos, qvel, action = visited
    _, reward, _ = transitions(runner, "planar", qpos, qvel, 3 * action)
    _, clipped, _ = transitions(runner, "planar", qpos, qvel, np.clip(3 * action, -1, 1))
    np.testing.assert_array_equal(reward, clipped)


def test_speed_keeps_its_digits_ten_kilometres_away(runner, real, visited):
    qpos, qvel, action = visited
    far = qpos.copy()
    far[:, 0] = 10_000.0
    observation, reward, _ = transitions(runner, "planar", far, qvel, action)
    expected_observation, expected_reward, _ = steps_of(real, far, qvel, action)
    np.testing.assert_allclose(reward[:, 0], expected_reward[:, 0], rtol=1e-4, atol=3e-4)
    np.testing.assert_allclose(observation, expected_observation, rtol=1e-3, atol=1e-3)


def test_starts_are_distributed_as_gymnasiums(runner, real):
    states = jax.vmap(runner().initial_state)(jax.random.split(jax.random.key(0), 3000))
    theirs = []
    for seed in range(3000):
        real.reset(seed=seed)
        theirs.append(np.concatenate([real.data.qpos, real.data.qvel]))
    ours = np.concatenate([states.qpos, states.qvel], axis=1)
    for index, (mine, other) in enumerate(zip(ours.T, np.stack(theirs).T, strict=True)):
        assert scipy.stats.ks_2samp(mine, other).pvalue > 1e-4, index
    assert np.abs(np.corrcoef(ours.T) - np.eye(len(ours.T))).max() < 0.1


def test_sizes_and_times_are_the_models_and_the_registered_ones(runner, real):
    environment = runner()
    model = environment.model
    assert model.nq == model.nv == (environment.observation_size + 1) / 2
    assert model.nu == environment.action_size
    assert real.frame_skip == environment.frame_skip
    assert environment.step_seconds == pytest.approx(real.dt) == pytest.approx(model.opt.timestep * real.frame_skip)
    np.testing.assert_array_equal(environment.model.qpos0, real.init_qpos)
    assert (environment.model.actuator_ctrlrange == [environment.action_low, environment.action_high]).all()
    assert gymnasium.spec(runner.id).max_episode_steps == environment.time_limit
    assert len(environment.objectives) == real.reward_space.shape[0]


def test_the_model_is_gymnasiums_file(runner):
    name = f"{runner.model_name}.xml"
    ours = files("envs").joinpath("assets", name).read_bytes()
    assert ours == files("gymnasium").joinpath("envs", "mujoco", "assets", name).read_bytes()


def test_every_part_is_drawn(runner):
    environment = runner()
    scene = environment.scene(environment.initial_state(jax.random.key(0)))
    drawn = [shape.part for shape in scene.shapes if shape.part in ("body", "hind", "fore")]
    assert set(drawn) == {"body", "hind", "fore"}
    ends = [end for shape in scene.shapes if shape.part in drawn for end in (shape.start, shape.end)]
    (left, right), (bottom, top) = scene.window.x, scene.window.z
    assert all(left < x < right and bottom < z < top for x, z in ends)


def test_physics_is_an_option_of_the_id():
    for environment in (envs.make(CHEETAH, physics="mjx"), envs.make(f"{CHEETAH},physics=mjx")):
        assert isinstance(environment, HalfCheetah)
        assert type(environment.physics).__name__ == "MjxPhysics"
    with pytest.raises(ValueError, match="physics must be planar or mjx, not 'bullet'"):
        envs.make(f"{CHEETAH},physics=bullet")


@pytest.mark.parametrize("physics", ["planar", "mjx"])
def test_physics_first_used_under_a_trace_outlives_it(physics):
    """Arrays of the physics made while tracing must not belong to the trace."""
    cheetah = HalfCheetah(physics)
    state = cheetah.initial_state(jax.random.key(0))
    shapes = [jax.eval_shape(cheetah.transition, state, jnp.zeros(6)).reward.shape for _ in range(2)]
    assert shapes == [(2,), (2,)]

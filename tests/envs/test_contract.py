"""What every registered environment promises."""

import json
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import envs
from envs.drawing import NoDrawing
from tests.envs.every import EVERY

STEPS = 60


@pytest.fixture(params=EVERY)
def environment(request):
    return envs.make(request.param)


def random_actions(environment, key, count):
    return 1.5 * jax.random.uniform(key, (count, environment.action_size), minval=-1.0)  # beyond the limits, too


@partial(jax.jit, static_argnames=("environment", "steps"))  # once for all tests
def random_episode(environment, key, steps=STEPS):
    reset_key, action_key, step_key = jax.random.split(key, 3)
    start = environment.reset(reset_key)
    inputs = random_actions(environment, action_key, steps), jax.random.split(step_key, steps)

    def act(state, inputs):
        action, key = inputs
        state, step = environment.step(key, state, action)
        return state, (state, step)

    return start, jax.lax.scan(act, start[0], inputs)[1]


def test_shapes_and_types(environment):
    (state, observation), (_, step) = random_episode(environment, jax.random.key(0))
    objectives = len(environment.objectives)
    assert objectives >= 2
    assert observation.shape == (environment.observation_size,)
    assert state.elapsed_steps.dtype == jnp.int32
    assert step.observation.shape == step.final_observation.shape == (STEPS, environment.observation_size)
    assert step.reward.shape == (STEPS, objectives)
    assert step.reward.dtype == observation.dtype == jnp.float32
    assert step.terminated.dtype == step.truncated.dtype == jnp.bool_
    assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(step))


def test_objectives_are_described(environment):
    assert len({objective.name for objective in environment.objectives}) == len(environment.objectives)
    assert all(objective.label and objective.unit for objective in environment.objectives)


def test_same_key_same_episode_other_key_another(environment):
    first, again, other = (random_episode(environment, jax.random.key(seed)) for seed in (1, 1, 2))
    for left, right in zip(jax.tree.leaves(first), jax.tree.leaves(again), strict=True):
        np.testing.assert_array_equal(left, right)
    assert not np.array_equal(first[1][1].observation, other[1][1].observation)


def test_vmap_equals_a_loop(environment):
    """Step by step from the same states: what is chaotic may drift apart over an episode."""
    (start, _), (states, _) = random_episode(environment, jax.random.key(3))
    before = jax.tree.map(lambda first, after: jnp.concatenate([first[None], after[:-1]]), start, states)
    actions = random_actions(environment, jax.random.key(4), STEPS)
    inputs = jax.random.split(jax.random.key(5), STEPS), before, actions
    together = jax.jit(jax.vmap(environment.step))(*inputs)
    alone = jax.jit(lambda inputs: jax.lax.map(lambda each: environment.step(*each), inputs))(inputs)
    for left, right in zip(jax.tree.leaves(together), jax.tree.leaves(alone), strict=True):
        np.testing.assert_allclose(left, right, rtol=1e-3, atol=1e-3)


def test_truncates_exactly_at_the_time_limit(environment):
    state, _ = environment.reset(jax.random.key(4))
    action = jnp.zeros(environment.action_size)
    step = jax.jit(environment.step)
    for elapsed, expected in ((environment.time_limit - 2, False), (environment.time_limit - 1, True)):
        almost = state.replace(elapsed_steps=jnp.array(elapsed, jnp.int32))
        after, result = step(jax.random.key(5), almost, action)
        assert not result.terminated
        assert result.truncated == expected
        assert after.elapsed_steps == (0 if expected else elapsed + 1)


def test_an_ending_resets_in_the_same_step_and_keeps_the_final_observation(environment):
    state, _ = environment.reset(jax.random.key(6))
    ending = state.replace(elapsed_steps=jnp.array(environment.time_limit - 1, jnp.int32))
    action = jnp.full(environment.action_size, 0.5)

    def ways(key, state, ending):
        return environment.advance(state, action), environment.reset(key), environment.step(key, ending, action)

    (_, continued), (fresh, fresh_observation), (after, step) = jax.jit(ways)(jax.random.key(7), state, ending)
    np.testing.assert_array_equal(step.observation, fresh_observation)
    np.testing.assert_array_equal(step.final_observation, continued.final_observation)
    assert not np.array_equal(step.final_observation, step.observation)
    for left, right in zip(jax.tree.leaves(after), jax.tree.leaves(fresh), strict=True):
        np.testing.assert_array_equal(left, right)


def test_no_step_crosses_an_episode(environment):
    """Following elapsed steps: each is one more than the last, or zero exactly after an ending."""
    _, (states, steps) = random_episode(environment, jax.random.key(8), environment.time_limit + 50)
    ended = np.asarray(steps.terminated | steps.truncated)
    assert ended.any()
    before = np.concatenate([[0], states.elapsed_steps[:-1]])
    np.testing.assert_array_equal(states.elapsed_steps, np.where(ended, 0, before + 1))


def test_actions_are_clipped(environment):
    state, _ = environment.reset(jax.random.key(9))
    limit = jnp.broadcast_to(jnp.asarray(environment.action_high), environment.action_size)
    advance = jax.jit(environment.advance)
    _, at_limit = advance(state, limit)
    _, beyond = advance(state, 3 * limit)
    for left, right in zip(at_limit, beyond, strict=True):
        np.testing.assert_array_equal(left, right)


def test_a_drawing_is_finite_or_refused_by_name(environment):
    (start, _), _ = random_episode(environment, jax.random.key(10))
    state = jax.device_get(start.physics)
    if type(environment).scene is envs.Environment.scene:
        with pytest.raises(NoDrawing, match=environment.id):
            environment.scene(state)
    else:
        scene = environment.scene(state)
        assert json.loads(json.dumps(scene.to_json(), allow_nan=False))["shapes"]
        assert scene.window.x[0] < scene.window.x[1] and scene.window.z[0] < scene.window.z[1]

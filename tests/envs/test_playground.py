"""MuJoCo Playground's own environments: those whose models come with the package. `make test-slow` installs it."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import envs
from envs.adapted import Adapted

pytest.importorskip("mujoco_playground")


@pytest.mark.parametrize(
    ("id", "message"),
    [
        ("playground:cheetah-run", "Playground has no 'cheetah-run'; it has AcrobotSwingup, .*mean 'CheetahRun'?"),
        (
            "playground:CheetahRun,colour=red",
            "there is no option 'colour'; the options there are: objectives, time_limit, .*sim_dt",
        ),
        ("playground:WalkerWalk,objectives=walk/control", "no term 'walk'.*the terms there are: move, stand, standing"),
        (
            "playground:PointMass,episode_length=50",
            "there is no option 'episode_length'; the options there are: objectives, time_limit",
        ),
        ("playground:PointMass,time_limit=", "time_limit must be a whole number above zero, not ''"),
        ("playground:PointMass,sim_dt=fast", "Playground refuses it: "),
    ],
)
def test_what_is_wrong_is_named(id, message):
    with pytest.raises(ValueError, match=message):
        envs.make(id)


@pytest.mark.slow
def test_the_terms_of_a_task_are_objectives():
    environment = envs.make("playground:PointMass,objectives=near:near_target/small_control/all:reward,time_limit=2")
    assert isinstance(environment, Adapted)
    assert [objective.name for objective in environment.objectives] == ["near", "small_control", "all"]
    assert environment.step_seconds == environment.theirs.dt and environment.time_limit == 2
    keys = jax.random.split(jax.random.key(0), 3)
    state, first = jax.vmap(environment.reset)(keys)
    actions = jnp.full((3, environment.action_size), 0.5)
    step = jax.jit(jax.vmap(environment.step))
    for _ in range(2):
        state, result = step(keys, state, actions)
    near, small, whole = result.reward.T
    np.testing.assert_allclose(near * small, whole, rtol=1e-5)  # theirs is the product
    assert result.truncated.all() and not result.terminated.any()
    assert first.shape == (3, environment.observation_size)
    np.testing.assert_array_equal(result.observation, jax.vmap(environment.reset)(keys)[1])  # the next episode's

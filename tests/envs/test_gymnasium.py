"""The adapter: Gymnasium's own checker, and the same episode as without it."""

from typing import Any

import gymnasium
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env

import envs
from envs.gymnasium import GymnasiumEnvironment
from tests.envs.every import EVERY
from tests.probes import UnevenBox


class Scalarized(gymnasium.RewardWrapper):
    """The checker wants a scalar reward."""

    def reward(self, reward):
        return float(reward.sum())


@pytest.mark.parametrize("name", EVERY)
@pytest.mark.filterwarnings("ignore:.*is different from the unwrapped version:UserWarning")
@pytest.mark.filterwarnings("ignore:.*Box observation space m.*is -?infinity:UserWarning")
@pytest.mark.filterwarnings("ignore:.*we recommend using a symmetric and normalized space:UserWarning")
def test_passes_gymnasiums_checker(name):
    check_env(Scalarized(GymnasiumEnvironment(envs.make(name))), skip_render_check=True)


@pytest.mark.parametrize("name", EVERY)
def test_an_episode_is_the_environments_own(name):
    adapted, original = GymnasiumEnvironment(envs.make(name)), envs.make(name)
    observation, _ = adapted.reset(seed=3)
    key = jax.random.key(int(np.random.Generator(np.random.PCG64(3)).integers(2**32)))
    state, expected = jax.jit(original.reset)(key)
    np.testing.assert_array_equal(observation, expected)
    advance = jax.jit(original.advance)
    ended = False
    for index in range(original.time_limit):
        action = np.full(original.action_size, np.sin(index / 7), np.float32)
        state, step = advance(state, jnp.asarray(action))
        observation, reward, terminated, truncated, _ = adapted.step(action)
        np.testing.assert_array_equal(observation, step.final_observation)
        np.testing.assert_array_equal(reward, step.reward)
        assert reward in adapted.reward_space
        ended = terminated or truncated
        assert (terminated, truncated) == (bool(step.terminated), bool(step.truncated))
        if ended:
            break
    assert ended


def test_a_step_before_the_first_reset_is_refused():
    with pytest.raises(ResetNeeded):
        GymnasiumEnvironment(envs.make(envs.ids()[0])).step(np.zeros(1))


def test_the_action_space_is_the_box():
    space: Any = GymnasiumEnvironment(UnevenBox()).action_space
    np.testing.assert_array_equal(space.low, np.float32([5, -0.5]))
    np.testing.assert_array_equal(space.high, np.float32([35, np.inf]))
    assert space.dtype == np.float32

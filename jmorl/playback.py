"""One episode of a stored policy, recorded so that it can be seen."""

from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

import envs
from envs.core import Environment
from envs.drawing import Scene
from jmorl.storage.policy_file import StoredPolicy


class PlaybackError(ValueError):
    """A playback that cannot be made as asked for."""


@dataclass(frozen=True)
class Recording:
    """T steps of an episode, from its start state."""

    environment: Environment[Any]
    policy: StoredPolicy
    states: Any  # physics states, every leaf [T + 1, ...]
    totals: np.ndarray  # [T + 1, M] undiscounted return so far

    @property
    def steps(self) -> int:
        """T."""
        return len(self.totals) - 1

    def scene(self, step: int) -> Scene:
        """The picture after so many steps. Raises NoDrawing if the environment has none."""
        scene: Scene = self.environment.scene(jax.tree.map(lambda leaf: leaf[step], self.states))
        return scene


def record(policy: StoredPolicy, key: jax.Array, most_steps: int | None = None) -> Recording:
    """A deterministic episode from `key`'s start, to its end or for `most_steps`.

    With the same key it is the episode that `jmorl.scoring.evaluate_stored` scores.
    """
    environment = envs.make(policy.header["environment"])
    length = min(most_steps or environment.time_limit, environment.time_limit)

    def act(carry: tuple[Any, jax.Array], _: None) -> tuple[tuple[Any, jax.Array], tuple[Any, jax.Array, jax.Array]]:
        state, observation = carry
        state, step = environment.advance(state, policy.mean_action(observation, jnp))
        return (state, step.observation), (state.physics, step.reward, step.terminated | step.truncated)

    @jax.jit
    def episode(key: jax.Array) -> tuple[Any, tuple[Any, jax.Array, jax.Array]]:
        start = environment.reset(key)
        return start[0].physics, jax.lax.scan(act, start, None, length=length)[1]

    first, (states, rewards, endings) = jax.device_get(episode(key))
    steps = int(np.argmax(endings)) + 1 if endings.any() else length
    states = jax.tree.map(lambda start, after: np.concatenate([start[None], after[:steps]]), first, states)
    totals = np.concatenate([np.zeros((1, rewards.shape[1])), np.cumsum(rewards[:steps], axis=0, dtype=np.float64)])
    return Recording(environment, policy, states, totals)

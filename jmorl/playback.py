"""One episode of a stored policy, recorded so that it can be seen."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from envs.core import Environment
from envs.drawing import Scene
from jmorl.learning.execution import result_of
from jmorl.storage.policy_file import StoredPolicy, policy_environment


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

    With the same key it is the episode that `jmorl.evaluation.evaluate_stored` scores. Policies of one environment
    share a compiled program. Raises PolicyFileError if that environment cannot be made here.
    """
    environment, episode = _program(policy.header["environment"], most_steps)
    first, (states, rewards, endings) = result_of(episode, _arrays(policy), key)
    steps = int(np.argmax(endings)) + 1 if endings.any() else len(endings)
    states = jax.tree.map(lambda start, after: np.concatenate([start[None], after[:steps]]), first, states)
    totals = np.concatenate([np.zeros((1, rewards.shape[1])), np.cumsum(rewards[:steps], axis=0, dtype=np.float64)])
    return Recording(environment, policy, states, totals)


@lru_cache(maxsize=4)
def _program(environment_id: str, most_steps: int | None) -> tuple[Environment[Any], Callable[..., Any]]:
    """An environment, and the episode in it of a policy given by its arrays, from the start of a key."""
    environment = policy_environment(environment_id)
    length = min(most_steps or environment.time_limit, environment.time_limit)

    @jax.jit
    def episode(arrays: dict[str, Any], key: jax.Array) -> tuple[Any, tuple[Any, jax.Array, jax.Array]]:
        policy = StoredPolicy(log_std=np.empty(0), **arrays)

        def act(
            carry: tuple[Any, jax.Array], _: None
        ) -> tuple[tuple[Any, jax.Array], tuple[Any, jax.Array, jax.Array]]:
            state, observation = carry
            state, step = environment.advance(state, policy.mean_action(observation, jnp))
            return (state, step.observation), (state.physics, step.reward, step.terminated | step.truncated)

        start = environment.reset(key)
        return start[0].physics, jax.lax.scan(act, start, None, length=length)[1]

    return environment, episode


def _arrays(policy: StoredPolicy) -> dict[str, Any]:
    """What decides about an action."""
    return {
        "header": {"network": {name: policy.header["network"][name] for name in ("variance_floor", "clip")}},
        "layers": policy.layers,
        "observation_mean": policy.observation_mean,
        "observation_variance": policy.observation_variance,
    }

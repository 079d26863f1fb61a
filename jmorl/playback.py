"""One episode of a stored policy, recorded so that it can be seen."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from envs.core import Environment
from envs.drawing import Scene
from jmorl.learning.execution import result_of
from jmorl.storage.policy_file import StoredPolicy, policy_environment

CHUNK = 1000  # steps that are computed at once, at most


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

    @property
    def readings(self) -> np.ndarray:  # [T + 1, M]
        """The totals as people say them."""
        columns = zip(self.environment.objectives, self.totals.T, strict=True)
        return np.stack([objective.read.so_far(column) for objective, column in columns], axis=1)

    def scene(self, step: int) -> Scene:
        """Return the picture after so many steps. Raises NoDrawing if the environment has none."""
        scene: Scene = self.environment.scene(jax.tree.map(lambda leaf: leaf[step], self.states))
        return scene


def record(policy: StoredPolicy, key: jax.Array, most_steps: int | None = None) -> Recording:
    """Return a deterministic episode from `key`'s start, to its end or for `most_steps`.

    With the same key it is the episode that `jmorl.evaluation.evaluate_stored` scores. Policies of one environment
    share compiled programs. Raises PolicyFileError if that environment cannot be made here.
    """
    programs = _programs(policy.header["environment"], most_steps)
    arrays = policy.arrays()
    episode = result_of(programs.start, key)
    first = episode[0].physics
    chunks = []
    for _ in range(programs.chunks):  # not in one program: the time limit may be far beyond the end
        episode, chunk = result_of(programs.go_on, arrays, episode)
        chunks.append(chunk)
        if chunks[-1][2].any():
            break
    states, rewards, endings = jax.tree.map(lambda *parts: np.concatenate(parts)[: programs.length], *chunks)
    steps = int(np.argmax(endings)) + 1 if endings.any() else len(endings)
    states = jax.tree.map(lambda start, after: np.concatenate([start[None], after[:steps]]), first, states)
    totals = np.concatenate([np.zeros((1, rewards.shape[1])), np.cumsum(rewards[:steps], axis=0, dtype=np.float64)])
    return Recording(programs.environment, policy, states, totals)


class _Programs(NamedTuple):
    """An environment, and the episodes in it of policies given by their arrays."""

    environment: Environment[Any]
    length: int  # steps of an episode at most
    chunks: int  # calls of `go_on` that this takes
    start: Callable[..., Any]  # from a key to the state of the episode and the first observation
    go_on: Callable[..., Any]  # from there, steps of a policy: where they lead, and what they went through


@lru_cache(maxsize=4)
def _programs(environment_id: str, most_steps: int | None) -> _Programs:
    """Return the programs for one environment, compiled when they are first called."""
    environment = policy_environment(environment_id)
    length = int(min(most_steps or environment.time_limit, environment.time_limit))
    chunks = -(-length // CHUNK)

    @jax.jit
    def go_on(arrays: dict[str, Any], episode: tuple[Any, jax.Array]) -> tuple[Any, tuple[Any, jax.Array, jax.Array]]:
        policy = StoredPolicy.of_arrays(arrays)

        def act(
            carry: tuple[Any, jax.Array], _: None
        ) -> tuple[tuple[Any, jax.Array], tuple[Any, jax.Array, jax.Array]]:
            state, observation = carry
            state, step = environment.advance(state, policy.action(observation, jnp))
            return (state, step.observation), (state.physics, step.reward, step.terminated | step.truncated)

        return jax.lax.scan(act, episode, None, length=-(-length // chunks))

    return _Programs(environment, length, chunks, jax.jit(environment.reset), go_on)

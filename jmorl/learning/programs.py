"""Agents vmapped, and their axis sharded over all devices. The only `jit` of the project."""

import time
from collections.abc import Callable
from functools import partial
from typing import Any, Protocol

import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import Mesh, PartitionSpec

from envs.core import Environment
from jmorl.config import Config
from jmorl.learning.checks import check_run
from jmorl.learning.execution import compiled, own_settings, result_of
from jmorl.learning.moppo import MOPPO, Diagnostics, Schedule, TrainState
from jmorl.learning.rollout import EpisodeReturns

AGENTS = "agents"  # the mesh axis


class Programs(Protocol):
    """Training and evaluation of N agents side by side, P of each run, each of them one call.

    Learners cross this boundary as host arrays with a leading N axis, so that the search can store, mix and
    inherit them without touching a device.
    """

    @property
    def devices(self) -> int:
        """How many devices the agents are spread over."""

    def compile(self) -> float:
        """Compile what is to be called. Returns the seconds it took; nothing is traced or compiled a second time."""

    def initialize(self, keys: jax.Array) -> TrainState:
        """A new train state for each key [N]."""

    def train(
        self, train_states: TrainState, weights: np.ndarray, keys: jax.Array, schedule: Schedule
    ) -> tuple[TrainState, Diagnostics]:
        """Train every agent [N, ...] with its weights [N, M] and its key [N]."""

    def evaluate(self, train_states: TrainState, keys: jax.Array) -> EpisodeReturns:
        """Returns [N, episodes, M] of every agent [N, ...], a run's from equal keys: [episodes] of each in turn."""


class CompiledPrograms:
    """The programs for so many runs. Raises NotAsDeclared and DoesNotFit, as `check_run`."""

    def __init__(self, environment: Environment[Any], config: Config, runs: int = 1):
        check_run(environment, config, runs)
        self.runs = runs
        self.agents = runs * config.population.agents
        self.episodes = config.evaluation.episodes
        self._compiled = False
        self.moppo = MOPPO(environment, config.ppo)
        self.devices = device_count(self.agents, jax.device_count())
        mesh = Mesh(np.array(jax.devices()[: self.devices]), (AGENTS,))
        self._initialize = jax.jit(jax.vmap(self.moppo.initial_train_state))
        self._train = _sharded(self.moppo.train, mesh, shared=1)
        sampled, traced = config.evaluation.actions == "sampled", config.evaluation.units == "paper"
        evaluate = _sharded(partial(self.moppo.evaluate, sampled=sampled, traced=traced), mesh)
        each = config.population.agents
        self._evaluate: Any = jax.jit(
            lambda train_states, keys: evaluate(train_states, jnp.repeat(keys.reshape(runs, -1), each, axis=0))
        )

    def compile(self) -> float:
        if self._compiled:
            return 0.0
        started = time.perf_counter()
        keys = jax.random.split(jax.random.key(0), self.agents)
        start_keys = jax.random.split(jax.random.key(0), self.runs * self.episodes)
        with own_settings():
            train_states = jax.eval_shape(jax.vmap(self.moppo.initial_train_state), keys)
        weights = np.zeros((self.agents, len(self.moppo.environment.objectives)), np.float32)
        self._train = compiled(self._train, train_states, weights, keys, schedule_of(0, 0.0))
        self._evaluate = compiled(self._evaluate, train_states, start_keys)
        self._compiled = True
        return time.perf_counter() - started

    def initialize(self, keys: jax.Array) -> TrainState:
        train_states: TrainState = result_of(self._initialize, keys)
        return train_states

    def train(
        self, train_states: TrainState, weights: np.ndarray, keys: jax.Array, schedule: Schedule
    ) -> tuple[TrainState, Diagnostics]:
        trained: tuple[TrainState, Diagnostics] = result_of(self._train, train_states, weights, keys, schedule)
        return trained

    def evaluate(self, train_states: TrainState, keys: jax.Array) -> EpisodeReturns:
        returns: EpisodeReturns = result_of(self._evaluate, train_states, keys)
        return returns


def schedule_of(iterations: int, learning_rate: float) -> Schedule:
    """As the compiled programs take it."""
    return Schedule(np.int32(iterations), np.float32(learning_rate))


def device_count(agents: int, available: int) -> int:
    """How many devices so many agents use: the largest divisor of their number that the machine has."""
    return max(count for count in range(1, min(agents, available) + 1) if agents % count == 0)


def _sharded(function: Callable[..., Any], mesh: Mesh, shared: int = 0) -> Any:
    """`function` of one agent as one compiled call for N: all arguments but the last, `shared` ones have an N axis."""

    def all_agents(*arguments: Any) -> Any:
        own = len(arguments) - shared
        axes = (*[0] * own, *[None] * shared)
        specs = (*[PartitionSpec(AGENTS)] * own, *[PartitionSpec()] * shared)
        batched = jax.vmap(function, in_axes=axes)
        return jax.shard_map(batched, mesh=mesh, in_specs=specs, out_specs=PartitionSpec(AGENTS), check_vma=False)(
            *arguments
        )

    return jax.jit(all_agents)

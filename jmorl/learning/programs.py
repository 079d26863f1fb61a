"""Agents vmapped, and their axis sharded over all devices.

The only `jit` of the project, and the cache of what it made.
"""

import time
from collections.abc import Callable
from functools import lru_cache, partial
from threading import Lock
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import Mesh, PartitionSpec

from envs.core import Environment
from jmorl.learning.check import check_run
from jmorl.learning.execution import compile_for, own_settings, result_of
from jmorl.learning.moppo import MOPPO, Diagnostics, Schedule, TrainState
from jmorl.learning.rollout import EpisodeReturns
from jmorl.learning.settings import LearningConfig

AGENTS = "agents"  # the mesh axis
MOST_KEPT = 16  # programs of so many shapes are kept; those used least recently go first


class Programs:
    """Training and evaluation of N agents side by side, P of each of some runs, each of them one compiled call.

    Train states cross this boundary as host arrays with a leading N axis, so that the search can store, mix and
    inherit them without touching a device. Get them from `compiled`, so that nothing is compiled twice. Raises
    NotAsDeclared and DoesNotFit, as `check_run` does; every call raises ComputationFailed.
    """

    def __init__(self, environment: Environment[Any], config: LearningConfig, runs: int = 1):
        check_run(environment, config, runs=runs)
        self.runs = runs
        self.agents = runs * config.agents
        self.episodes = config.evaluation.episodes
        self._compiling = Lock()
        self._compiled = False
        self._iteration_seconds: float | None = None
        self.moppo = MOPPO(environment, config.ppo)
        self.devices = device_count(self.agents, jax.device_count())  # that share the agents
        mesh = Mesh(np.array(jax.devices()[: self.devices]), (AGENTS,))
        self._initialize = jax.jit(jax.vmap(self.moppo.initial_train_state))
        self._train = _sharded(self.moppo.train, mesh, shared=1)
        sampled, traced = config.evaluation.actions == "sampled", config.evaluation.units == "paper"
        evaluate = _sharded(partial(self.moppo.evaluate, sampled=sampled, traced=traced), mesh)
        each = config.agents
        self._evaluate: Any = jax.jit(
            lambda train_states, keys: evaluate(train_states, jnp.repeat(keys.reshape(runs, -1), each, axis=0))
        )

    def compile(self) -> float:
        """Compile what is to be called, if it is not. Returns the seconds it took; nothing is traced a second time."""
        with self._compiling:
            if self._compiled:
                return 0.0
            started = time.perf_counter()
            keys = jax.random.split(jax.random.key(0), self.agents)
            start_keys = jax.random.split(jax.random.key(0), self.runs * self.episodes)
            with own_settings():
                train_states = jax.eval_shape(jax.vmap(self.moppo.initial_train_state), keys)
            weights = np.zeros((self.agents, len(self.moppo.environment.objectives)), np.float32)
            schedule = Schedule(np.int32(0), np.float32(0))
            self._train = compile_for(self._train, train_states, weights, keys, schedule)
            self._evaluate = compile_for(self._evaluate, train_states, start_keys)
            self._compiled = True
            return time.perf_counter() - started

    def iteration_seconds(self) -> float:
        """Return how long an iteration of all agents takes: of one, which is made the first time, after `compile`."""
        with self._compiling:
            if self._iteration_seconds is None:
                keys = jax.random.split(jax.random.key(0), self.agents)
                train_states = jax.device_get(self.initialize(keys))
                weights = np.ones((self.agents, len(self.moppo.environment.objectives)), np.float32)
                started = time.perf_counter()
                self.train(train_states, weights, keys, Schedule(np.int32(1), np.float32(0)))
                self._iteration_seconds = time.perf_counter() - started
            return self._iteration_seconds

    def initialize(self, keys: jax.Array) -> TrainState:
        """Return a new train state for each key [N]."""
        train_states: TrainState = result_of(self._initialize, keys)
        return train_states

    def train(
        self, train_states: TrainState, weights: np.ndarray, keys: jax.Array, schedule: Schedule
    ) -> tuple[TrainState, Diagnostics]:
        """Train every agent [N, ...] with its weights [N, M] and its key [N]."""
        trained: tuple[TrainState, Diagnostics] = result_of(self._train, train_states, weights, keys, schedule)
        return trained

    def evaluate(self, train_states: TrainState, keys: jax.Array) -> EpisodeReturns:
        """Return the returns [N, episodes, M] of every agent [N, ...], a run's from equal keys.

        `keys` has [episodes] of each run in turn.
        """
        returns: EpisodeReturns = result_of(self._evaluate, train_states, keys)
        return returns


def compiled(environment: Environment[Any], config: LearningConfig, runs: int = 1) -> Programs:
    """Return the programs for an environment and settings: always the same, which the process compiles once."""
    return _programs(_Itself(environment), config, runs)


class _Itself:
    """An environment that equals itself alone, whatever equality its class defines."""

    def __init__(self, environment: Environment[Any]):
        self.environment = environment

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Itself) and self.environment is other.environment

    def __hash__(self) -> int:
        return id(self.environment)


@lru_cache(MOST_KEPT)
def _programs(of: _Itself, config: LearningConfig, runs: int) -> Programs:
    return Programs(of.environment, config, runs)


def device_count(agents: int, available: int) -> int:
    """How many devices so many agents use: the largest divisor of their number that the machine has."""
    return max(count for count in range(1, min(agents, available) + 1) if agents % count == 0)


def _sharded(function: Callable[..., Any], mesh: Mesh, shared: int = 0) -> Any:
    """Compile `function` of one agent for N: all arguments have an N axis, but for the last `shared` ones."""

    def all_agents(*arguments: Any) -> Any:
        own = len(arguments) - shared
        axes = (*[0] * own, *[None] * shared)
        specs = (*[PartitionSpec(AGENTS)] * own, *[PartitionSpec()] * shared)
        batched = jax.vmap(function, in_axes=axes)
        return jax.shard_map(batched, mesh=mesh, in_specs=specs, out_specs=PartitionSpec(AGENTS), check_vma=False)(
            *arguments
        )

    return jax.jit(all_agents)

"""The population: agents vmapped, and their axis sharded over all devices. The only `jit` of the project."""

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import jax
import numpy as np
from jax.sharding import Mesh, PartitionSpec

from envs.core import Environment
from envs.declared import check_environment
from jmorl.config import Config
from jmorl.learning.moppo import FAULTS, MOPPO, Diagnostics, Learner, Schedule
from jmorl.learning.rollout import EpisodeReturns

AGENTS = "agents"  # the mesh axis


class TrainingFault(RuntimeError):
    """Numbers stopped being finite in training. The message names agents and causes."""


class Population:
    """P agents trained and evaluated side by side, each call one compiled program.

    Learners cross this boundary as host arrays with a leading P axis, so that the search can store, mix and
    inherit them without touching a device. Raises NotAsDeclared for an environment that is not what it says.
    """

    def __init__(self, environment: Environment[Any], config: Config):
        check_environment(environment)
        self.size = config.population.agents
        self._compiled = False
        self.moppo = MOPPO(environment, config.ppo)
        self.devices = jax.devices()[: device_count(self.size, jax.device_count())]
        mesh = Mesh(np.array(self.devices), (AGENTS,))
        self._initialize = jax.jit(jax.vmap(self.moppo.initial_learner))
        self._train = _sharded(self.moppo.train, mesh)
        sampled, traced = config.evaluation.actions == "sampled", config.evaluation.units == "paper"
        self._evaluate = _sharded(partial(self.moppo.evaluate, sampled=sampled, traced=traced), mesh)

    def compile(self, start_keys: jax.Array) -> float:
        """Compile both calls, for evaluation from as many start keys [episodes]. Returns the seconds it took.

        What is called afterwards are these programs: nothing is traced or compiled again, not by this method either.
        """
        if self._compiled:
            return 0.0
        started = time.perf_counter()
        keys = jax.random.split(start_keys[0], self.size)
        learners = jax.eval_shape(jax.vmap(self.moppo.initial_learner), keys)
        weights = np.zeros((self.size, len(self.moppo.environment.objectives)), np.float32)
        self._train = self._train.lower(learners, weights, keys, _schedule(0, 0.0)).compile()
        self._evaluate = self._evaluate.lower(learners, start_keys).compile()
        self._compiled = True
        return time.perf_counter() - started

    def initialize(self, key: jax.Array) -> Learner:
        """P new learners [P, ...]."""
        return jax.device_get(self._initialize(jax.random.split(key, self.size)))

    def train(
        self, learners: Learner, weights: np.ndarray, key: jax.Array, iterations: int, learning_rate: float
    ) -> tuple[Learner, Diagnostics]:
        """Train every learner [P, ...] with its weights [P, M] for `iterations` PPO iterations at one
        learning rate.

        Raises TrainingFault, naming agents, causes and iterations, if any number stopped being finite.
        """
        keys = jax.random.split(key, self.size)
        weights = np.asarray(weights, np.float32)
        learners, diagnostics = jax.device_get(
            self._train(learners, weights, keys, _schedule(iterations, learning_rate))
        )
        _raise_faults(diagnostics)
        return learners, diagnostics

    def evaluate(self, learners: Learner, keys: jax.Array) -> EpisodeReturns:
        """Returns [P, episodes, M] of every learner from the same keys [episodes], with traces for paper units.

        Raises TrainingFault, naming the agents, if a return is not finite.
        """
        returns = jax.device_get(self._evaluate(learners, keys))
        faulty = np.flatnonzero(~np.isfinite(returns.undiscounted).all((1, 2)))
        if len(faulty):
            raise TrainingFault("; ".join(f"agent {agent}: a return is not finite in evaluation" for agent in faulty))
        return returns


def device_count(agents: int, available: int) -> int:
    """How many devices a population uses: the largest divisor of its size that the machine has."""
    return max(count for count in range(1, min(agents, available) + 1) if agents % count == 0)


def _schedule(iterations: int, learning_rate: float) -> Schedule:
    return Schedule(np.int32(iterations), np.float32(learning_rate))


def _sharded(function: Callable[..., Any], mesh: Mesh) -> Any:
    """`function` of one agent as one compiled call for all: every argument has a P axis but the last, shared one."""

    def population(*arguments: Any) -> Any:
        axes = (*[0] * (len(arguments) - 1), None)
        specs = (*[PartitionSpec(AGENTS)] * (len(arguments) - 1), PartitionSpec())
        batched = jax.vmap(function, in_axes=axes)
        return jax.shard_map(batched, mesh=mesh, in_specs=specs, out_specs=PartitionSpec(AGENTS), check_vma=False)(
            *arguments
        )

    return jax.jit(population)


def _raise_faults(diagnostics: Diagnostics) -> None:
    faulty = np.flatnonzero(diagnostics.fault)
    if len(faulty):
        lines = [
            f"agent {agent}: {FAULTS[diagnostics.fault[agent]]} is not finite in iteration "
            f"{diagnostics.fault_iteration[agent]}"
            for agent in faulty
        ]
        raise TrainingFault("; ".join(lines))

"""The population of one run: its keys, and whether its numbers are still finite."""

import itertools
from collections.abc import Sequence
from typing import Any

import jax
import numpy as np

from envs.core import Environment, Objective
from jmorl.learning.moppo import Diagnostics, Schedule, TrainState
from jmorl.learning.programs import Programs, compiled
from jmorl.learning.rollout import EpisodeReturns
from jmorl.learning.settings import LearningConfig


class TrainingFault(RuntimeError):
    """Numbers stopped being finite in training. The message names agents and causes."""


class Population:
    """P agents trained and evaluated side by side, each call one compiled program. Train states have a leading P axis.

    Populations of one environment and one `LearningConfig` use the same programs. Raises NotAsDeclared for an
    environment that is not what it says.
    """

    def __init__(self, environment: Environment[Any], config: LearningConfig):
        self.size = config.agents
        self.objectives = environment.objectives
        self.programs: Programs = compiled(environment, config)

    @property
    def devices(self) -> int:
        """How many devices share the agents."""
        return self.programs.devices

    def compile(self) -> float:
        """Compile what is called below. Returns the seconds it took."""
        return self.programs.compile()

    def iteration_seconds(self) -> float:
        """Return how long an iteration of all agents takes, after `compile`."""
        return self.programs.iteration_seconds()

    def initialize(self, key: jax.Array) -> TrainState:
        """Return P new train states [P, ...]."""
        return self.programs.initialize(jax.random.split(key, self.size))

    def train(
        self, train_states: TrainState, weights: np.ndarray, key: jax.Array, iterations: int, learning_rate: float
    ) -> tuple[TrainState, Diagnostics]:
        """Train every agent [P, ...] with its weights [P, M] for some PPO iterations at one learning rate.

        Raises TrainingFault, naming agents, causes and iterations, if any number stopped being finite.
        """
        keys = jax.random.split(key, self.size)
        schedule = Schedule(np.int32(iterations), np.float32(learning_rate))
        train_states, diagnostics = self._train(train_states, np.asarray(weights, np.float32), keys, schedule)
        _raise_faults(diagnostics, self.objectives)
        return train_states, diagnostics

    def evaluate(self, train_states: TrainState, keys: jax.Array) -> EpisodeReturns:
        """Score every agent from the same keys [episodes]: returns [P, episodes, M], with traces for paper units.

        Raises TrainingFault, naming agents and objectives, if a return is not finite.
        """
        returns = self.try_out(train_states, keys)
        faulty = ~np.isfinite(np.asarray(returns.undiscounted)).all(axis=1)  # [P, M]
        if faulty.any():
            names = [objective.name for objective in self.objectives]
            raise TrainingFault(
                "; ".join(
                    f"agent {agent}: the return of {', '.join(itertools.compress(names, faulty[agent]))} is not finite "
                    "in evaluation"
                    for agent in np.flatnonzero(faulty.any(1))
                )
            )
        return returns

    def try_out(self, train_states: TrainState, keys: jax.Array) -> EpisodeReturns:
        """Score every agent as `evaluate` does, also where a return is not finite."""
        return self._evaluate(train_states, keys)

    def _train(
        self, train_states: TrainState, weights: np.ndarray, keys: jax.Array, schedule: Schedule
    ) -> tuple[TrainState, Diagnostics]:
        return self.programs.train(train_states, weights, keys, schedule)

    def _evaluate(self, train_states: TrainState, keys: jax.Array) -> EpisodeReturns:
        return self.programs.evaluate(train_states, keys)


def _raise_faults(diagnostics: Diagnostics, objectives: Sequence[Objective]) -> None:
    faults = [
        f"agent {agent}: {diagnostics.cause(agent, objectives)} is not finite in iteration "
        f"{diagnostics.fault_iteration[agent]}"
        for agent in np.flatnonzero(diagnostics.fault).tolist()
    ]
    if faults:
        raise TrainingFault("; ".join(faults))

"""The population of one run: its keys, and whether its numbers are still finite."""

import itertools
from collections.abc import Sequence
from typing import Any

import jax
import numpy as np

from envs.core import Environment, Objective
from jmorl.config import Config
from jmorl.learning.moppo import Diagnostics, TrainState
from jmorl.learning.programs import CompiledPrograms, Programs, schedule_of
from jmorl.learning.rollout import EpisodeReturns


class TrainingFault(RuntimeError):
    """Numbers stopped being finite in training. The message names agents and causes."""


class Population:
    """P agents trained and evaluated side by side, each call one compiled program.

    The programs are its own, or those that several runs share (`jmorl.learning.stack`). Learners have a leading P axis.
    """

    def __init__(self, environment: Environment[Any], config: Config, programs: Programs | None = None):
        self.size = config.population.agents
        self.objectives = environment.objectives
        self.programs: Programs = programs or CompiledPrograms(environment, config)

    @property
    def devices(self) -> int:
        """How many devices the agents are spread over."""
        return self.programs.devices

    def compile(self) -> float:
        """Compile what is called below. Returns the seconds it took."""
        return self.programs.compile()

    def initialize(self, key: jax.Array) -> TrainState:
        """P new train states [P, ...]."""
        return self.programs.initialize(jax.random.split(key, self.size))

    def train(
        self, train_states: TrainState, weights: np.ndarray, key: jax.Array, iterations: int, learning_rate: float
    ) -> tuple[TrainState, Diagnostics]:
        """Train every agent [P, ...] with its weights [P, M] for `iterations` PPO iterations at one
        learning rate.

        Raises TrainingFault, naming agents, causes and iterations, if any number stopped being finite.
        """
        keys = jax.random.split(key, self.size)
        schedule = schedule_of(iterations, learning_rate)
        train_states, diagnostics = self.programs.train(train_states, np.asarray(weights, np.float32), keys, schedule)
        _raise_faults(diagnostics, self.objectives)
        return train_states, diagnostics

    def evaluate(self, train_states: TrainState, keys: jax.Array) -> EpisodeReturns:
        """Returns [P, episodes, M] of every agent from the same keys [episodes], with traces for paper units.

        Raises TrainingFault, naming agents and objectives, if a return is not finite.
        """
        returns = self.programs.evaluate(train_states, keys)
        faulty: np.ndarray = np.asarray(~np.isfinite(returns.undiscounted).all(1))  # [P, M]
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


def _raise_faults(diagnostics: Diagnostics, objectives: Sequence[Objective]) -> None:
    faults = [
        f"agent {agent}: {diagnostics.cause(agent, objectives)} is not finite in iteration "
        f"{diagnostics.fault_iteration[agent]}"
        for agent in np.flatnonzero(diagnostics.fault).tolist()
    ]
    if faults:
        raise TrainingFault("; ".join(faults))

"""Several runs in one program: runs, with their seeds, as one more axis that is vmapped and sharded.

Each run goes on in a thread of its own with a population of its own, whose calls are made together with the others'.
What a run finds may depend in the last bits on how many share a program, as it does on the machine.
"""

import threading
from collections.abc import Hashable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import partial
from types import TracebackType
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from envs.core import Environment
from jmorl.learning.moppo import Diagnostics, Schedule, TrainState
from jmorl.learning.population import Population
from jmorl.learning.programs import Programs, compiled
from jmorl.learning.rollout import EpisodeReturns
from jmorl.learning.settings import LearningConfig


class Stack:
    """Runs of one environment and one `LearningConfig` that begin together and share every call."""

    def __init__(self, environment: Environment[Any], config: LearningConfig, runs: int):
        self.environment = environment
        self.config = config
        self.runs = runs  # that go on
        self._turn = threading.Condition()
        self._calls: dict[int, _Call] = {}  # of runs that wait, by their number
        self.populations = [StackedPopulation(self, number) for number in range(runs)]

    def programs(self, runs: int) -> Programs:
        """Return the programs for so many of the runs."""
        return compiled(self.environment, self.config, runs)

    def call(self, number: int, call: "_Call") -> Any:
        """Answer the call of a run together with the others': once each of them has made one, or has left."""
        with self._turn:
            self._calls[number] = call
            self._answer_if_complete()
            self._turn.wait_for(lambda: call.answered)
        if call.error:
            raise call.error
        return call.result

    def leave(self) -> None:
        """Wait for one run less: it is over."""
        with self._turn:
            self.runs -= 1
            self._answer_if_complete()

    def _answer_if_complete(self) -> None:
        if not self._calls or len(self._calls) < self.runs:
            return
        calls = [self._calls[number] for number in sorted(self._calls)]
        self._calls.clear()
        for kind in dict.fromkeys(call.kind for call in calls):
            self._answer([call for call in calls if call.kind == kind])
        self._turn.notify_all()

    def _answer(self, calls: Sequence["_Call"]) -> None:
        """Answer calls that are alike as one. What goes wrong goes wrong for each of them."""
        try:
            programs = self.programs(len(calls))
            programs.compile()
            train_states = jax.tree.map(lambda *leaves: np.concatenate(leaves), *(call.train_states for call in calls))
            keys = jnp.concatenate([call.keys for call in calls])
            schedule = calls[0].schedule
            if schedule is None:
                result: Any = programs.evaluate(train_states, keys)
            else:
                weights = np.concatenate([call.weights for call in calls if call.weights is not None])
                result = programs.train(train_states, weights, keys, schedule)
            own = self.config.agents
            for index, call in enumerate(calls):
                call.result = jax.tree.map(partial(_part, start=index * own, stop=(index + 1) * own), result)
        except Exception as error:
            for call in calls:
                call.error = error
        for call in calls:
            call.answered = True


class StackedPopulation(Population, AbstractContextManager["StackedPopulation"]):
    """The population of one run in a stack, to be used in the run's thread; leaving the block leaves the stack."""

    def __init__(self, stack: Stack, number: int):
        super().__init__(stack.environment, stack.config)
        self._stack = stack
        self._number = number
        self._together = self.programs  # of all runs that go on, once they are compiled

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._stack.leave()

    @property
    def devices(self) -> int:
        """How many devices share the agents of all runs."""
        return self._stack.programs(self._stack.runs).devices

    def compile(self) -> float:
        """Compile the programs for all runs that go on. Returns the seconds it took."""
        self._together = self._stack.programs(self._stack.runs)
        return self._together.compile()

    def iteration_seconds(self) -> float:
        """Return how long an iteration of all agents of all runs takes, after `compile`."""
        return self._together.iteration_seconds()

    def _train(
        self, train_states: TrainState, weights: np.ndarray, keys: jax.Array, schedule: Schedule
    ) -> tuple[TrainState, Diagnostics]:
        trained: tuple[TrainState, Diagnostics] = self._stack.call(
            self._number, _Call(train_states, keys, weights, schedule)
        )
        return trained

    def _evaluate(self, train_states: TrainState, keys: jax.Array) -> EpisodeReturns:
        returns: EpisodeReturns = self._stack.call(self._number, _Call(train_states, keys))
        return returns


@dataclass(eq=False)
class _Call:
    """Training, or, without a schedule, evaluation."""

    train_states: TrainState
    keys: jax.Array
    weights: np.ndarray | None = None
    schedule: Schedule | None = None
    result: Any = None
    error: Exception | None = None
    answered: bool = False

    @property
    def kind(self) -> Hashable:
        """Equal for calls that can be made as one."""
        return None if self.schedule is None else tuple(np.asarray(each).item() for each in self.schedule)


def _part(leaf: Any, start: int, stop: int) -> Any:
    return leaf[start:stop]

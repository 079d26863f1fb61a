"""Several runs in one program: runs, with their seeds, as one more axis that is vmapped and sharded.

Each run goes on in a thread of its own and has a seat, which is the programs of its population. What a run finds
may depend in the last bits on how many share a program, as it does on the machine.
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
from jmorl.config import Config
from jmorl.learning.moppo import Diagnostics, Schedule, TrainState
from jmorl.learning.programs import CompiledPrograms
from jmorl.learning.rollout import EpisodeReturns


class Stack:
    """The programs of runs with equal environment, population, PPO and evaluation, for any number of them at a time."""

    def __init__(self, environment: Environment[Any], config: Config):
        self.environment = environment
        self.config = config
        self._programs: dict[int, CompiledPrograms] = {}  # by the number of runs
        self._turn = threading.Condition()
        self._seats = 0  # taken
        self._calls: dict[int, _Call] = {}  # of seats that wait, by their number

    def seats(self, runs: int) -> list["Seat"]:
        """For so many runs that begin together; every one is to be left at its end."""
        if self._seats:
            raise ValueError("the runs before have not left their seats")
        self._seats = runs
        return [Seat(self, number) for number in range(runs)]

    @property
    def devices(self) -> int:
        """How many devices the agents of all seats are spread over."""
        with self._turn:
            return self._programs_of(self._seats).devices

    def compile(self) -> float:
        """Compile the programs for all seats that are taken."""
        with self._turn:
            return self._programs_of(self._seats).compile()

    def initialize(self, keys: jax.Array) -> TrainState:
        """The first train states of one run."""
        with self._turn:
            return self._programs_of(1).initialize(keys)

    def call(self, number: int, call: "_Call") -> Any:
        """Answer the call of a seat together with the others': once each of them has made one, or has left."""
        with self._turn:
            self._calls[number] = call
            self._answer_if_complete()
            self._turn.wait_for(lambda: call.answered)
        if call.error:
            raise call.error
        return call.result

    def leave(self, number: int) -> None:
        """A seat's run is over."""
        with self._turn:
            self._seats -= 1
            self._answer_if_complete()

    def _programs_of(self, runs: int) -> CompiledPrograms:
        if runs not in self._programs:
            self._programs[runs] = CompiledPrograms(self.environment, self.config, runs)
        return self._programs[runs]

    def _answer_if_complete(self) -> None:
        if not self._calls or len(self._calls) < self._seats:
            return
        calls = [self._calls[number] for number in sorted(self._calls)]
        self._calls.clear()
        for kind in dict.fromkeys(call.kind for call in calls):
            self._answer([call for call in calls if call.kind == kind])
        self._turn.notify_all()

    def _answer(self, calls: Sequence["_Call"]) -> None:
        """Calls that are alike, as one. What goes wrong goes wrong for each of them."""
        try:
            programs = self._programs_of(len(calls))
            programs.compile()
            train_states = jax.tree.map(lambda *leaves: np.concatenate(leaves), *(call.train_states for call in calls))
            keys = jnp.concatenate([call.keys for call in calls])
            schedule = calls[0].schedule
            if schedule is None:
                result: Any = programs.evaluate(train_states, keys)
            else:
                weights = np.concatenate([call.weights for call in calls if call.weights is not None])
                result = programs.train(train_states, weights, keys, schedule)
            own = self.config.population.agents
            for index, call in enumerate(calls):
                call.result = jax.tree.map(partial(_part, start=index * own, stop=(index + 1) * own), result)
        except Exception as error:
            for call in calls:
                call.error = error
        for call in calls:
            call.answered = True


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


class Seat(AbstractContextManager["Seat"]):
    """The programs of one run's population, to be called in its thread; at the end of the block the seat is left."""

    def __init__(self, stack: Stack, number: int):
        self._stack = stack
        self._number = number

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._stack.leave(self._number)

    @property
    def devices(self) -> int:
        return self._stack.devices

    def compile(self) -> float:
        return self._stack.compile()

    def initialize(self, keys: jax.Array) -> TrainState:
        return self._stack.initialize(keys)

    def train(
        self, train_states: TrainState, weights: np.ndarray, keys: jax.Array, schedule: Schedule
    ) -> tuple[TrainState, Diagnostics]:
        return self._stack.call(self._number, _Call(train_states, keys, weights, schedule))

    def evaluate(self, train_states: TrainState, keys: jax.Array) -> EpisodeReturns:
        return self._stack.call(self._number, _Call(train_states, keys))


def _part(leaf: Any, start: int, stop: int) -> Any:
    return leaf[start:stop]

"""The contract of a multi-objective environment in pure JAX.

A new environment subclasses `Environment` and writes three pure functions of *one* state:
`initial_state`, `observe` and `transition`. This module adds what every environment shares:
the time limit, the reset within the same step, and the separation of `terminated`,
`truncated` and the final observation. Callers batch with `jax.vmap`. An environment that can be
seen writes a fourth, `scene`, for the host.

Shape letters: O observation size, A action size, M objectives.
"""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar, Generic, NamedTuple, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from flax import struct
from numpy.typing import ArrayLike

from envs.actions import ActionBox, action_box
from envs.drawing import NoDrawing, Scene

PhysicsState = TypeVar("PhysicsState")


@dataclass(frozen=True)
class Reading:
    """How people say a return: in a unit of its own, with a sign of its own, as a sum or as a mean.

    With `less_is_better` the sign is turned: a return of -94.5 `-steps` reads 94.5 steps. With `mean_over`, the number
    of steps that every episode has, it is a mean of the steps: 4,060 `m/s·steps` over 1,000 steps read 4.06 m/s.
    """

    unit: str
    less_is_better: bool = False
    mean_over: int = 1  # 1: the sum over an episode

    @property
    def scale(self) -> float:
        """What a return is multiplied by."""
        return (-1 if self.less_is_better else 1) / self.mean_over

    def of(self, returns: ArrayLike) -> np.ndarray:  # [...]
        """Return undiscounted returns [...] as people say them; never -0."""
        return np.asarray(returns, float) * self.scale + 0.0

    def so_far(self, totals: ArrayLike) -> np.ndarray:  # [T + 1]
        """Return the totals [T + 1] before and after each step of an episode as people say them: means of what was."""
        steps = np.maximum(np.arange(len(np.asarray(totals))), 1)
        return self.of(totals) * (self.mean_over / steps if self.mean_over > 1 else 1)

    def to_return(self, number: float) -> float:
        """Return the undiscounted return that reads so."""
        return number / self.scale + 0.0


@dataclass(frozen=True)
class Objective:
    """One component of the vector reward. Always maximised.

    `label` is the quantity and `unit` what an undiscounted return is measured in. No return is above `highest`, so
    that nothing better is ever promised. `reading` is how people say a return, on the page, at the terminal and in
    plots; without one they say it as it is. Files, settings and reports have returns.
    """

    name: str
    label: str
    unit: str
    highest: float = math.inf
    reading: Reading | None = None

    @property
    def read(self) -> Reading:
        """How people say a return of this objective."""
        return self.reading or Reading(self.unit)


class Transition(NamedTuple):
    """What one application of the dynamics produced, before any time limit or reset."""

    state: Any  # the successor state
    reward: jax.Array  # [M] the environment's own units; numbers of any kind, which become float32
    terminated: jax.typing.ArrayLike  # [] bool, the task itself ended


@struct.dataclass
class EpisodeState(Generic[PhysicsState]):
    """A physics state and how many steps of the current episode lie behind it."""

    physics: PhysicsState
    elapsed_steps: jax.Array  # [] int32


class Step(NamedTuple):
    """One environment step, the reset after an ending included.

    `observation` is where the next action is chosen: the successor, or the first observation of
    the next episode if this one ended. `final_observation` is always the true successor, so a
    truncated step can bootstrap from its value.
    """

    observation: jax.Array  # [O]
    reward: jax.Array  # [M]
    terminated: jax.Array  # [] bool: bootstrap from zero
    truncated: jax.Array  # [] bool: the time limit, and not terminated: bootstrap from final_observation
    final_observation: jax.Array  # [O]


class Environment(ABC, Generic[PhysicsState]):
    """A multi-objective Markov decision process with continuous actions and a time limit.

    Every component of an action lies between `action_low` and `action_high`, in the environment's own units; both are
    a number, or one for each component, and may be infinite. `action_box` is what follows from them.
    An instance holds no state and is hashable by identity, so it can be closed over by `jit`.
    """

    id: ClassVar[str]
    family: ClassVar[str] = "your own"  # whose results may be compared with one another
    objectives: ClassVar[tuple[Objective, ...]]
    observation_size: ClassVar[int]
    action_size: ClassVar[int]
    action_low: ArrayLike = -1.0  # [] or [A]
    action_high: ArrayLike = 1.0  # [] or [A]
    time_limit: ClassVar[int]
    step_seconds: ClassVar[float | None] = None  # simulated time of a step, where steps have a duration

    @property
    def action_box(self) -> ActionBox:
        """The bounds of every component, and how the output of a policy is mapped onto them. Raises ValueError."""
        return action_box(self.action_low, self.action_high, int(self.action_size))

    @abstractmethod
    def initial_state(self, key: jax.Array) -> PhysicsState:
        """Return a state drawn from the start distribution."""

    @abstractmethod
    def observe(self, state: PhysicsState) -> jax.Array:  # [O]
        """Return what the agent sees of a state: numbers of any kind, which become float32."""

    @abstractmethod
    def transition(self, state: PhysicsState, action: jax.Array) -> Transition:
        """Apply the dynamics: state and action [A] within the box to successor, vector reward and termination."""

    def scene(self, state: PhysicsState) -> Scene:
        """Return a state as a picture, on the host. Raises NoDrawing for an environment that has none."""
        raise NoDrawing(f"environment {self.id!r} has no drawing")

    def reset(self, key: jax.Array) -> tuple[EpisodeState[PhysicsState], jax.Array]:
        """Start an episode. Returns its state and first observation [O]."""
        physics = self.initial_state(key)
        return EpisodeState(physics, jnp.zeros((), jnp.int32)), _floats(self.observe(physics))

    def advance(self, state: EpisodeState[PhysicsState], action: jax.Array) -> tuple[EpisodeState[PhysicsState], Step]:
        """One step without reset: an ended episode stays at its final state. For evaluation and playback."""
        physics, reward, terminated = self.transition(state.physics, action)
        terminated = jnp.asarray(terminated)
        elapsed_steps = state.elapsed_steps + 1
        truncated = (elapsed_steps >= self.time_limit) & ~terminated
        observation = _floats(self.observe(physics))
        step = Step(observation, _floats(reward), terminated, truncated, observation)
        return EpisodeState(physics, elapsed_steps), step

    def step(
        self, key: jax.Array, state: EpisodeState[PhysicsState], action: jax.Array
    ) -> tuple[EpisodeState[PhysicsState], Step]:
        """One step; if it ends the episode, the next one starts within the same step, from `key`."""
        continued, step = self.advance(state, action)
        fresh, first_observation = self.reset(key)
        ended = step.terminated | step.truncated
        next_state = jax.tree.map(lambda new, old: jnp.where(ended, new, old), fresh, continued)
        return next_state, step._replace(observation=jnp.where(ended, first_observation, step.final_observation))


def _floats(numbers: ArrayLike) -> jax.Array:
    """Numbers as float32. Wider ones, which JAX has only if it was told so, stay."""
    array = jnp.asarray(numbers)
    wide = jnp.issubdtype(array.dtype, jnp.floating) and array.dtype.itemsize >= 4
    return array.astype(array.dtype if wide else jnp.float32)

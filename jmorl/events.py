"""What a run yields: an event for everything that happens. Whoever watches a run reads these."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from jmorl.decision.protocol import AnyQuestion
from jmorl.search.families import Blending
from jmorl.search.metrics import FrontMetrics
from jmorl.search.policy import Policy
from jmorl.state import RunState


@dataclass(frozen=True)
class Seconds:
    """Where the time of a generation went, waiting for an answer not counted."""

    select: float = 0.0
    train: float = 0.0
    evaluate: float = 0.0

    @property
    def total(self) -> float:
        """The time of the whole generation."""
        return self.select + self.train + self.evaluate


@dataclass(frozen=True)
class Compiled:
    """The programs are compiled; nothing has been trained."""

    seconds: float
    devices: int
    steps_per_second: float  # to expect in training, from one iteration
    steps: int = 0  # that were made before, of a run that goes on


@dataclass(frozen=True)
class Resumed:
    """The run goes on from this state, instead of beginning with a warm-up."""

    state: RunState
    steps: int  # environment steps used for learning before
    bounds: np.ndarray  # [M] in force
    generations_to_question: int | None  # that end before somebody is asked; None: nobody is, before the end


@dataclass(frozen=True)
class Decided:
    """The decision maker has answered."""

    question: AnyQuestion
    answer: Any  # as `question.checked` returns it
    chosen: Policy | None  # what the answer prefers to all others shown; None for an answer that prefers none
    bounds: np.ndarray  # [M] that follow; from a final choice none do, so those in force
    generations_to_question: int | None  # that end before the next question; None: there is none before the end
    seconds: float  # how long the run waited for the answer


@dataclass(frozen=True)
class GenerationFinished:
    """A generation (0: the warm-up) is trained, evaluated and in the archive."""

    state: RunState
    offspring: tuple[Policy, ...]  # in paper units generation 0 begins with the untrained agents
    candidates: int  # policies the search could continue; 0 in the warm-up
    steps: int  # environment steps used for learning so far
    seconds: Seconds
    steps_per_second: float  # of this generation, selection and evaluation included
    # Losses, entropy and KL divergence of the last iteration, means over the agents; None where nothing was trained.
    training: Mapping[str, float | None]
    front: FrontMetrics
    utility_max: float | None  # of the archive; None for a decision maker without a utility
    search: Mapping[str, float | None]  # the method's own metrics
    bounds: np.ndarray  # [M] in force
    generations_to_question: int | None  # that end before the next question; None: there is none before the end


@dataclass(frozen=True)
class Blended(GenerationFinished):
    """A generation that trained nothing: its offspring are blends that joined the front, with confirmed scores."""

    blending: Blending
    before: FrontMetrics


@dataclass(frozen=True)
class RunFinished:
    """The run is over; `chosen` is its result."""

    state: RunState
    chosen: Policy
    reason: Literal["budget", "satisfied", "stopped"]


Event = Compiled | Resumed | Decided | GenerationFinished | RunFinished

"""Where a run stands between two of its events, and how long it still takes."""

from dataclasses import dataclass, replace
from typing import Literal

from jmorl.config import Config
from jmorl.events import Compiled, Decided, Event, GenerationFinished, Resumed, RunFinished

Phase = Literal["compiling", "warm-up", "generation", "blending", "question", "finished"]


@dataclass(frozen=True)
class Timeline:
    """What has happened, what is going on, and since when. Times are seconds of any one clock."""

    config: Config
    since: float  # when the phase began
    phase: Phase = "compiling"
    generation: int = 0  # that is going on, or that a question is about
    silent: int | None = 0  # generations before the next question, the one that is going on included; None: never
    compiled: Compiled | None = None
    decided: Decided | None = None  # the last answer
    resumed: Resumed | None = None  # where the run was taken up
    finished: GenerationFinished | None = None  # the last generation since
    result: RunFinished | None = None

    @property
    def generations(self) -> int:
        """How many generations the budget is good for, the warm-up not counted; a run may end earlier."""
        population = self.config.population
        return -((population.warmup_iterations - self.config.iteration_budget) // population.iterations)

    @property
    def left(self) -> int:
        """How many generations are left, the one that is going on, or is asked about, included."""
        return max(self.generations - self.generation + 1, 0)

    @property
    def generation_steps(self) -> int:
        """Environment steps of one generation."""
        return self.config.population.iterations * self.config.steps_per_iteration

    @property
    def total_steps(self) -> int:
        """Environment steps of a run that does not end early; the budget, rounded up to a generation."""
        return self.warmup_steps + self.generations * self.generation_steps

    def after(self, event: Event, now: float) -> "Timeline":
        """Return the timeline when `event` has just happened."""
        match event:
            case Compiled():
                return replace(self, phase="warm-up", since=now, compiled=event)
            case Resumed():
                return replace(self._next(event), since=now, resumed=event)
            case GenerationFinished():
                return replace(self._next(event), since=now, finished=event)
            case Decided():
                silent = event.generations_to_question
                goes_on = silent != 0 and event.question.purpose != "final" and not event.question.stops(event.answer)
                phase: Phase = "generation" if goes_on else "question"
                return replace(self, phase=phase, since=now, silent=silent, decided=event)
            case RunFinished():
                return replace(self, phase="finished", since=now, result=event)

    @property
    def warmup_steps(self) -> int:
        """Environment steps of the warm-up."""
        return self.config.population.warmup_iterations * self.config.steps_per_iteration

    def generation_seconds(self) -> float | None:
        """How long a generation takes, judged by the last one, or by one iteration; None before that."""
        if self.finished is None:
            return self.generation_steps / self.compiled.steps_per_second if self.compiled else None
        seconds, population = self.finished.seconds, self.config.population
        if self.finished.state.generation:
            return seconds.total
        return seconds.train * population.iterations / population.warmup_iterations + seconds.evaluate

    def steps(self, now: float) -> int:
        """Environment steps so far; within a generation as many as it should have made by now."""
        if self.finished is None:
            made = (now - self.since) * self.compiled.steps_per_second if self.compiled else 0.0
            return self.resumed.steps if self.resumed else min(int(made), self.warmup_steps)
        expected = self.generation_seconds()
        share = min((now - self.since) / expected, 1.0) if self.phase == "generation" and expected else 0.0
        return self.finished.steps + int(share * self.generation_steps)

    def seconds_to_question(self, now: float) -> float | None:
        """How long until the decision maker is asked; None if that is not known or not to come."""
        if self.phase != "generation" or self.silent is None:
            return None
        return self._seconds(now, min(self.silent - 1, self.generations - self.generation))

    def seconds_of_warmup(self, now: float) -> float | None:
        """How long the warm-up still takes; None if that is not known."""
        if self.phase != "warm-up" or not self.compiled:
            return None
        return max(self.warmup_steps / self.compiled.steps_per_second - (now - self.since), 0.0)

    def seconds_to_end(self, now: float) -> float | None:
        """How long until the end, the time for answers not counted; None if that is not known."""
        warmup = self.seconds_of_warmup(now)
        if warmup is not None:
            return warmup + (self._seconds(now, self.generations) or 0.0)
        if self.phase == "blending":
            return None
        left = max(self.generations - self.generation, -1)
        return self._seconds(now, left if self.phase == "generation" else left + 1)

    def _seconds(self, now: float, generations: int) -> float | None:
        """Return the time that the present generation, and so many more, will take."""
        each = self.generation_seconds()
        if each is None:
            return None
        running = max(each - (now - self.since), 0.0) if self.phase == "generation" else 0.0
        return running + generations * each

    def _next(self, event: GenerationFinished | Resumed) -> "Timeline":
        """Return the timeline after a generation has ended."""
        generation, silent = event.state.generation + 1, event.generations_to_question
        over = generation > self.generations
        phase: Phase = "question" if silent == 0 or over else "generation"
        if over and self.config.search.final_blends and not event.state.blendings:
            phase = "blending"
        return replace(self, phase=phase, generation=generation, silent=silent)

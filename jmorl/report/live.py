"""A run on a terminal, redrawn while it computes."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import Self

import numpy as np
from rich.console import Group, RenderableType
from rich.live import Live
from rich.panel import Panel
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from envs.core import Objective
from jmorl.config import Config
from jmorl.display.console import PlainConsole
from jmorl.display.fronts import front_scatter, front_table
from jmorl.display.readings import bounds_in_words, confirmed_in_words, values_in_words, writers_for
from jmorl.display.text import REASONS, duration, number, plural, short_count
from jmorl.events import Event, RunFinished
from jmorl.report.timeline import Timeline
from jmorl.report.watchers import Watcher, show_result
from jmorl.search.policy import values_of

REFRESH_RATE = 4  # per second; a frame takes a few milliseconds
WIDTH = 100  # columns of the panel at most
FACT_LINES = 13  # of the screen that are not for the front
PLOT_LINES = 18  # of the front at most
LEAST_LINES = 9  # less is no plot
LEAST_BAR = 8  # columns, with the gaps beside it; less is no bar


class LiveView(Watcher):
    """A panel that a thread redraws, so that times tick while the run is inside a compiled call.

    While a person at this terminal is asked it is gone; it comes back with the next event. `clock` gives seconds, as
    `time.monotonic` does.
    """

    def __init__(
        self,
        config: Config,
        objectives: tuple[Objective, ...],
        console: PlainConsole,
        clock: Callable[[], float] = time.monotonic,
    ):
        self.config = config
        self.objectives = objectives
        self.console = console
        self.clock = clock
        self.timeline = Timeline(config, since=clock())  # replaced as a whole: the drawing thread reads it
        self._live = self._new()

    def __enter__(self) -> Self:
        self._live.start(refresh=True)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._live.stop()

    @contextmanager
    def asking(self) -> Iterator[None]:
        """Leave the screen alone while somebody is asked on it."""
        if self.config.user.strip() == "terminal":
            self._live.transient = True
            self._live.stop()
        yield

    def show(self, event: Event) -> None:
        """Show what has just happened."""
        self.timeline = self.timeline.after(event, self.clock())
        if not self._live.is_started:
            self._live = self._new()
            self._live.start(refresh=True)
        if isinstance(event, RunFinished):
            self._live.stop()  # the panel stays as it is, above the result
            show_result(self.console, event, self.objectives)
            found = confirmed_in_words(event.chosen, self.objectives)
            if found:
                self.console.print(f"The result is policy {event.chosen.id}: {found}.")

    def _new(self) -> Live:
        """One that has drawn nothing yet: one that was stopped would draw over what came since."""
        return Live(get_renderable=self.panel, console=self.console, refresh_per_second=REFRESH_RATE)

    @property
    def _room(self) -> int:
        """Columns within the panel."""
        return min(self.console.width, WIDTH) - 4

    def panel(self) -> Panel:
        """Return the picture of this moment."""
        timeline, now = self.timeline, self.clock()
        parts: list[RenderableType] = [self._bar(timeline, now), self._facts(timeline, now)]
        if timeline.finished and (len(self.objectives) == 2 or not timeline.result):
            parts += self._front(timeline)  # at the end of a run the table of the result is there anyway
        config = self.config
        title = self.console.render_str(f"{config.method}, {config.env}, user {config.user}, seed {config.seed}")
        return Panel(Group(*parts), title=title, title_align="left", width=self._room + 4)

    def _bar(self, timeline: Timeline, now: float) -> RenderableType:
        """Return what is going on, and how much of the budget is used; without a bar where the screen is too narrow."""
        steps, total = timeline.steps(now), timeline.total_steps
        phase, used = Text(_phase(timeline), "bold"), f"{short_count(steps)} of {short_count(total)} steps"
        if len(phase) + LEAST_BAR + len(used) > self._room:
            return Group(phase, used)
        row = Table.grid(expand=True, padding=(0, 2, 0, 0))
        row.add_column(no_wrap=True)
        row.add_column(ratio=1)
        row.add_column(no_wrap=True)
        unknown = timeline.compiled is None
        bar = ProgressBar(total, steps, pulse=unknown, animation_time=now)
        row.add_row(phase, bar, used)
        return row

    def _facts(self, timeline: Timeline, now: float) -> Table:
        grid = Table.grid(padding=(0, 2, 0, 0))
        grid.add_column(no_wrap=True, style="dim")
        for name, text in self._named_facts(timeline, now):
            grid.add_row(name, text)
        return grid

    def _named_facts(self, timeline: Timeline, now: float) -> Iterator[tuple[str, str]]:
        if timeline.result:
            yield "reason", REASONS[timeline.result.reason]
        elif timeline.finished is None:
            yield "time", duration(now - timeline.since)
            yield from _remaining(timeline, now)
        else:
            yield from _remaining(timeline, now)
        if timeline.finished:
            front, best = timeline.finished.front, timeline.finished.utility_max
            mean = timeline.finished.search.get("utility_mean")
            yield "speed", f"{short_count(timeline.finished.steps_per_second)} steps/s"
            yield "front", f"{plural(front.front_size, 'policy')}, hypervolume {number(front.hypervolume)}"
            if best is not None:
                yield "utility", f"best {number(best)}" + ("" if mean is None else f", mean {number(mean)}")
        if timeline.decided and timeline.decided.chosen:
            decided, choice = timeline.decided, timeline.decided.chosen
            writers = writers_for(decided.question.values, self.objectives)
            values = values_in_words(choice.values, writers)
            yield "chosen" if timeline.result else "last choice", f"policy {choice.id}: {values}"
            if np.isfinite(decided.bounds).any():
                yield "bounds", bounds_in_words(decided.bounds, writers)
        if timeline.finished and timeline.finished.candidates == 1 and timeline.decided:
            yield "", "nothing but the choice itself lay within the bounds"

    def _front(self, timeline: Timeline) -> list[RenderableType]:
        """Return the front as a plot of two objectives, or as a table of more, if there is room."""
        assert timeline.finished is not None
        members = timeline.finished.state.archive.members
        lines = min(self.console.height - FACT_LINES, PLOT_LINES)
        chosen = timeline.decided.chosen if timeline.decided else None
        if lines < LEAST_LINES:
            return []
        if len(self.objectives) > 2:
            return ["", front_table(members, self.objectives, previous_id=chosen.id if chosen else None)]
        marks, legend = ({"x": chosen.values}, "o: the front, x: the last choice") if chosen else ({}, "o: the front")
        plot = front_scatter(self.objectives, values_of(members), marks, self._room, lines)
        return ["", plot, Text(legend, "dim")]


def _phase(timeline: Timeline) -> str:
    match timeline.phase:
        case "generation":
            return f"round {timeline.generation} of {timeline.generations}"
        case "question" if timeline.generation > timeline.generations:
            return "final choice"
        case "question":
            return f"choice for round {timeline.generation}"
    return timeline.phase


def _remaining(timeline: Timeline, now: float) -> Iterator[tuple[str, str]]:
    question, end = timeline.seconds_to_question(now), timeline.seconds_to_end(now)
    if timeline.phase == "question":
        yield "next question", f"waiting for an answer since {duration(now - timeline.since)}"
    elif question is not None:
        yield "next question", f"in {duration(question)}" if question else "any moment"
    if end is not None:
        yield "end", f"in about {duration(end)}" if end else "any moment"

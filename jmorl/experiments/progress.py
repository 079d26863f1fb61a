"""Making the runs that are missing, with a line for each on the terminal."""

import time
from collections.abc import Sequence
from dataclasses import dataclass

from jmorl.display.console import PlainConsole
from jmorl.display.text import duration, short_count
from jmorl.events import Event, GenerationFinished, RunFinished
from jmorl.experiments.cells import Cell, Places, groups, missing
from jmorl.experiments.runner import make
from jmorl.signals import StopSignals


@dataclass(frozen=True)
class Part:
    """Runs that are made one after the other under one name."""

    name: str
    cells: Sequence[Cell]


def make_all(
    parts: Sequence[Part], places: Places, together: int, console: PlainConsole, fresh_episodes: int = 0
) -> None:
    """Make every part's missing runs, up to `together` in one program. What two parts share is made with the first.

    `fresh_episodes` is as in `make`.
    """
    with StopSignals("stopping after this generation; the same command goes on from there") as stop:
        for part in parts:
            todo = missing(part.cells, places)
            started, steps, made = time.monotonic(), 0, 0
            for cells in groups(todo, together):
                numbers = f"{made + 1} to {made + len(cells)}" if len(cells) > 1 else f"{made + 1}"
                name = f"{part.name}, {numbers} of {len(todo)}"
                steps += _make_some(cells, places, name, console, stop, fresh_episodes)
                made += len(cells)
            spent = duration(time.monotonic() - started)
            done = f"{len(todo)} runs, {short_count(steps)} steps, {spent}" if todo else "done"
            _say(console, f"{part.name}: {done}")


def _make_some(
    cells: Sequence[Cell], places: Places, name: str, console: PlainConsole, stop: StopSignals, fresh_episodes: int
) -> int:
    """Make runs together, with a line that changes on a terminal, and one for each that stays. Returns their steps."""
    started = time.monotonic()
    with console.status(f"{name}: {cells[0].key}", spinner="line") as status:  # which every encoding has

        def watch(cell: Cell, event: Event) -> None:
            if isinstance(event, GenerationFinished):
                rate = short_count(event.steps_per_second)
                status.update(f"{name}: {cell.key}, {short_count(event.steps)} steps, {rate} steps/s")
            if not isinstance(event, RunFinished):
                stop.check()

        records = make(cells, places, watch, fresh_episodes=fresh_episodes)
    spent = duration(time.monotonic() - started)
    for cell, record in zip(cells, records, strict=True):
        fault = f", broke down: {record.fault}" if record.fault else ""
        _say(console, f"  {name}: {cell.key}, {short_count(record.total_steps)} steps, {spent}{fault}")
    stop.check()
    return sum(record.total_steps for record in records)


def _say(console: PlainConsole, text: str) -> None:
    console.print(text, soft_wrap=True)

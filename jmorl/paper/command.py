"""`jmorl paper`: the runs that are missing, one after the other, then the report."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from jmorl.display.console import PlainConsole
from jmorl.display.text import duration, short_count
from jmorl.events import Event, GenerationFinished, RunFinished
from jmorl.experiments.cells import Cell, Places, distinct, groups, known, missing
from jmorl.experiments.runner import make
from jmorl.paper.pilots import propose
from jmorl.paper.plan import CHEETAH, ITEMS, NAMES, SHORTER, Plan, in_order, named
from jmorl.paper.report import Scope, write_report
from jmorl.signals import StopSignals


def make_paper(
    only: Sequence[str] | None,
    units: Sequence[str],
    seeds: Sequence[int] | None,
    quick: bool,
    run: bool,
    out: Path | None = None,
    work: Path | None = None,
    together: int = 1,
) -> None:
    """Make what is missing of the items named, all by default, and write the report; without `run` only that.

    Up to `together` runs are made in one program. `only` may have "targets": runs on other seeds, from which targets
    for HalfCheetah are proposed.
    """
    console = PlainConsole()
    plan = Plan(quick, tuple(seeds) if seeds else None)
    out = out or Path("runs/paper-quick" if quick else "benchmarks/paper")
    places = Places(out / "records", work or (out / "work" if quick else Path("runs/paper")))
    items = [item for item in ITEMS.values() if only is None or item.name in only]
    later = {(item.name, each): plan.later(item, each) for item, each in in_order(items, units)}
    parts = [
        _Part(item.name, each, [cell for cell in plan.cells(item, each) if cell not in later[item.name, each]])
        for item, each in in_order(items, units)
    ]
    if only and "targets" in only:
        parts.append(_Part(f"targets, {NAMES[CHEETAH]}", "raw", plan.pilots(CHEETAH)))
    parts += [_Part(f"{name}, {named(SHORTER)}", each, cells) for (name, each), cells in later.items() if cells]
    if run:
        _make_all(parts, places, together, console)
    if only and "targets" in only:
        proposed = propose(CHEETAH, known(plan.pilots(CHEETAH), places))
        console.print(proposed, soft_wrap=True)
    if items:
        cells = distinct(cell for part in parts for cell in part.cells)
        path = write_report(out, Scope(plan, items, units), known(cells, places))
        console.print(f"report: {path}", soft_wrap=True)


@dataclass(frozen=True)
class _Part:
    """An item in one kind of units."""

    name: str
    units: str
    cells: Sequence[Cell]


def _make_all(parts: Sequence[_Part], places: Places, together: int, console: PlainConsole) -> None:
    """Make every part's missing runs. What two parts share is made with the first."""
    with StopSignals("stopping after this generation; the same command goes on from there") as stop:
        for part in parts:
            name = f"{part.name}, {part.units} units"
            todo = missing(part.cells, places)
            started, steps, made = time.monotonic(), 0, 0
            for cells in groups(todo, together):
                numbers = f"{made + 1} to {made + len(cells)}" if len(cells) > 1 else f"{made + 1}"
                steps += _make_some(cells, places, f"{name}, {numbers} of {len(todo)}", console, stop)
                made += len(cells)
            spent = duration(time.monotonic() - started)
            _say(console, f"{name}: {len(todo)} runs, {short_count(steps)} steps, {spent}" if todo else f"{name}: done")


def _make_some(cells: Sequence[Cell], places: Places, name: str, console: PlainConsole, stop: StopSignals) -> int:
    """Make runs together, with a line that changes on a terminal, and one for each that stays. Returns their steps."""
    started = time.monotonic()
    with console.status(f"{name}: {cells[0].key}", spinner="line") as status:  # which every encoding has

        def watch(cell: Cell, event: Event) -> None:
            if isinstance(event, GenerationFinished):
                rate = short_count(event.steps_per_second)
                status.update(f"{name}: {cell.key}, {short_count(event.steps)} steps, {rate} steps/s")
            if not isinstance(event, RunFinished):
                stop.check()

        records = make(cells, places, watch)
    spent = duration(time.monotonic() - started)
    for cell, record in zip(cells, records, strict=True):
        fault = f", broke down: {record.fault}" if record.fault else ""
        _say(console, f"  {name}: {cell.key}, {short_count(record.total_steps)} steps, {spent}{fault}")
    stop.check()
    return sum(record.total_steps for record in records)


def _say(console: PlainConsole, text: str) -> None:
    console.print(text, soft_wrap=True)

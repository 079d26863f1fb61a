"""Making the runs of a comparison: what is done is skipped, what was interrupted goes on.

records/KEY.json  what is kept of a run that ended or broke down; delete it, and the run is made again
work/KEY/         its run folder, from which it is resumed
"""

from collections.abc import Callable, Hashable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path

import envs
from jmorl.config import Config, ConfigError, resolve
from jmorl.decision.protocol import DecisionMaker
from jmorl.events import Event
from jmorl.learning.population import Population, TrainingFault
from jmorl.learning.stack import Seat, Stack
from jmorl.paper.plan import Cell
from jmorl.paper.record import RunRecord, broken_record, is_record_of, read_record, record_of, write_record
from jmorl.storage.layout import Layout
from jmorl.storage.resume import AlreadyFinished, Continued, resume
from jmorl.storage.run_folder import RunFolder
from jmorl.storage.stored_run import read_run

Watch = Callable[[Cell, Event], None]


@dataclass(frozen=True)
class Places:
    """Where the runs of a comparison are kept."""

    records: Path
    work: Path

    def record(self, cell: Cell) -> Path:
        return self.records / f"{cell.key}.json"


def missing(cells: Sequence[Cell], places: Places) -> list[Cell]:
    """The cells that have no record, or one of other settings. Raises RecordError for a file that is none."""
    return [cell for cell in cells if not is_record_of(places.record(cell), cell.config)]


def known(cells: Sequence[Cell], places: Places) -> dict[str, RunRecord]:
    """The records there are, by the cell's key."""
    return {
        cell.key: read_record(places.record(cell)) for cell in cells if is_record_of(places.record(cell), cell.config)
    }


def make(
    cells: Sequence[Cell], places: Places, watch: Watch, user: Callable[[], DecisionMaker] | None = None
) -> list[RunRecord]:
    """Make runs of one `shape`, or what is left of them, together in one program, and keep their records.

    Several have a thread each, in which `watch` and the users are called; one alone has the caller's. `user` defaults
    to the one that a run's config names. What `watch` raises breaks a run off; it goes on from its last checkpoint the
    next time. A run that breaks down by itself would do so again: it is kept as it was until then, with its `fault`.
    """
    stack = _stack(cells[0].config)
    keys = tuple(cell.key for cell in cells) if len(cells) > 1 else ()

    def make_one(cell: Cell, seat: Seat) -> RunRecord:
        with seat:
            record = replace(_made(cell, places, watch, user, seat), together=keys)
        write_record(places.record(cell), record)
        return record

    seats = stack.seats(len(cells))
    if len(cells) == 1:  # an interruption is to reach it at once, and somebody's own user need not know of threads
        return [make_one(cells[0], seats[0])]
    with ThreadPoolExecutor(len(cells)) as pool:
        return list(pool.map(make_one, cells, seats))


def groups(cells: Sequence[Cell], most: int) -> Iterator[list[Cell]]:
    """The cells in order, up to so many that follow each other and have one shape at a time."""
    for _, alike in groupby(cells, lambda cell: shape(cell.config)):
        some = list(alike)
        yield from (some[start : start + most] for start in range(0, len(some), most))


def shape(config: Config) -> Hashable:
    """Equal for runs that can share a program."""
    return config.env, config.population.agents, config.ppo, config.evaluation


def _made(cell: Cell, places: Places, watch: Watch, user: Callable[[], DecisionMaker] | None, seat: Seat) -> RunRecord:
    folder = places.work / cell.key
    try:
        continued = _begun(cell, folder)
    except AlreadyFinished:
        return record_of(read_run(folder))
    population = Population(continued.folder.environment, cell.config, seat)
    try:
        with continued.folder:
            for event in continued.events(user() if user else None, population=population):
                watch(cell, event)
    except TrainingFault as fault:
        return broken_record(folder, cell.config, str(fault))
    return record_of(read_run(folder))


_stacks: dict[Hashable, Stack] = {}  # a few: compiled once, and used by all runs of one shape


def _stack(config: Config) -> Stack:
    if shape(config) not in _stacks:
        _stacks[shape(config)] = Stack(envs.make(config.env), config)
    return _stacks[shape(config)]


def _begun(cell: Cell, folder: Path) -> Continued:
    """The run as far as it is; from the beginning if what is there was made with other settings."""
    try:
        begun = resolve(file=Layout(folder).config).digest() == cell.config.digest()
    except ConfigError:
        begun = False
    if begun:
        return resume(folder)
    return Continued(RunFolder.create(folder, cell.config, envs.make(cell.config.env), force=True), None)

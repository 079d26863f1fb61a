"""Making the runs of a comparison: what is done is skipped, what was interrupted goes on.

records/KEY.json  what is kept of a run that ended or broke down; delete it, and the run is made again
work/KEY/         its run folder, from which it is resumed
"""

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from pathlib import Path

import envs
from jmorl.config import Config, ConfigError, resolve
from jmorl.decision.protocol import DecisionMaker
from jmorl.learning.population import Population, TrainingFault
from jmorl.paper.plan import Cell
from jmorl.paper.record import RunRecord, broken_record, is_record_of, read_record, record_of, write_record
from jmorl.run import Event
from jmorl.storage.continuing import AlreadyFinished, Continued, resume
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


def make(cell: Cell, places: Places, watch: Watch, user: Callable[[], DecisionMaker] | None = None) -> RunRecord:
    """Make one run, or the rest of it, and keep its record. `user` defaults to the one that the config names.

    What `watch` raises breaks the run off; it goes on from its last checkpoint the next time. A run that breaks down by
    itself would do so again: it is kept as it was until then, with its `fault`.
    """
    folder = places.work / cell.key
    try:
        continued = _begun(cell, folder)
    except AlreadyFinished:
        pass
    else:
        try:
            with continued.folder:
                for event in continued.events(user() if user else None, population=_population(cell.config)):
                    watch(cell, event)
        except TrainingFault as fault:
            return _kept(cell, places, broken_record(folder, cell.config, str(fault)))
    return _kept(cell, places, record_of(read_run(folder)))


def _kept(cell: Cell, places: Places, record: RunRecord) -> RunRecord:
    write_record(places.record(cell), record)
    return record


_populations: dict[Hashable, Population] = {}  # a few: compiled once, and used by all runs of equal shapes


def _population(config: Config) -> Population:
    shape = config.env, config.population, config.ppo, config.evaluation
    if shape not in _populations:
        _populations[shape] = Population(envs.make(config.env), config)
    return _populations[shape]


def _begun(cell: Cell, folder: Path) -> Continued:
    """The run as far as it is; from the beginning if what is there was made with other settings."""
    try:
        begun = resolve(file=folder / "config.toml").digest() == cell.config.digest()
    except ConfigError:
        begun = False
    if begun:
        return resume(folder)
    return Continued(RunFolder.create(folder, cell.config, envs.make(cell.config.env), force=True), None)

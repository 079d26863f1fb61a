"""The runs of a comparison: which there are to make, which are made, and where they are kept.

records/KEY.json  what is kept of a run that ended or broke down; delete it, and the run is made again
work/KEY/         its run folder, from which it is resumed
"""

from collections.abc import Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

from jmorl.config import Config
from jmorl.experiments.record import RunRecord, is_record_of, read_record


@dataclass(frozen=True)
class Cell:
    """One training run. Its key names its files, so that no two cells of a comparison have the same."""

    key: str
    config: Config


@dataclass(frozen=True)
class Places:
    """The folders of a comparison's runs."""

    records: Path
    work: Path

    def record(self, cell: Cell) -> Path:
        """Return the path of a cell's record."""
        return self.records / f"{cell.key}.json"

    def folder(self, cell: Cell) -> Path:
        """Return the path of a cell's run folder."""
        return self.work / cell.key


def distinct(cells: Iterable[Cell]) -> list[Cell]:
    """Return each cell once, in order."""
    return list({cell.key: cell for cell in cells}.values())


def missing(cells: Sequence[Cell], places: Places) -> list[Cell]:
    """Return the cells without a record of their settings. Raises RecordError for a file that is no record."""
    return [cell for cell in cells if not is_record_of(places.record(cell), cell.config)]


def known(cells: Sequence[Cell], places: Places) -> dict[str, RunRecord]:
    """Return the records there are, by the cell's key. Raises RecordError for a file that is no record."""
    present = [cell for cell in cells if is_record_of(places.record(cell), cell.config)]
    return {cell.key: read_record(places.record(cell)) for cell in present}


def groups(cells: Sequence[Cell], most: int) -> Iterator[list[Cell]]:
    """Yield the cells in order, in groups of at most `most` that follow each other and have one shape."""
    for _, alike in groupby(cells, lambda cell: shape(cell.config)):
        some = list(alike)
        yield from (some[start : start + most] for start in range(0, len(some), most))


def shape(config: Config) -> Hashable:
    """Return the key of a config; runs with equal keys can share a program."""
    return config.env, config.learning

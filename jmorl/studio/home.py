"""The runs below a folder, each in a few facts, for a page that lists them.

Only small files are read, and again only when they have changed; no environment is made. What cannot be read makes a
run damaged, and keeps no other from being listed.
"""

import math
import os
import threading
import tomllib
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, TypeAdapter
from typing_extensions import TypedDict

from jmorl.storage.csv_log import parsed_rows
from jmorl.storage.documents import check_fields
from jmorl.storage.layout import Layout
from jmorl.storage.lock import FolderInUse, check_unlocked
from jmorl.storage.manifest import read_manifest
from jmorl.storage.stored_run import read_result

_IN = Layout(Path())
VALUE = "value_"  # that the columns of scores begin with
DIGITS = 18  # of a count, at most
READ = tuple(each.name for each in (_IN.manifest, _IN.config, _IN.metrics, _IN.result, _IN.decisions))
DEPTH = 3  # folders below the home folder in which runs are looked for: runs/STUDY/work/RUN is the deepest
State = Literal["finished", "interrupted", "elsewhere", "damaged"]
Stamp = tuple[tuple[int, int] | None, ...]  # time of the last change and size of each file; None for one that is not


class _Settings(TypedDict):
    """What is relied on of a run's settings."""

    env: str
    method: str
    user: str
    steps: Annotated[int, Field(ge=1, lt=2**63)]


_SETTINGS = TypeAdapter(_Settings)


@dataclass(frozen=True)
class Origin:
    """Where a branch leaves another run."""

    run: str  # id in the manifest of the other run
    name: str
    generation: int  # the last that both have


@dataclass(frozen=True)
class Facts:
    """What the files of a whole run say."""

    run: str  # id in its manifest
    env: str
    method: str
    user: str
    budget: int  # environment steps
    rounds: int | None  # done after the warm-up; None before its end
    steps: int  # environment steps so far
    scores: tuple[tuple[str, float], ...]  # objective -> value of the result; nothing before the end
    origin: Origin | None


@dataclass(frozen=True)
class ListedRun:
    """A run as it is listed."""

    path: Path
    name: str  # its path below the home folder, in characters that can be printed
    state: State
    written: float  # seconds since the epoch
    facts: Facts | None  # None for a damaged one
    why: str = ""  # it is damaged, or not free: a sentence


class Home:
    """The folder of runs. Several threads may read it."""

    def __init__(self, folder: Path):
        self.folder = folder.resolve()
        self._known: dict[Path, tuple[Stamp, ListedRun]] = {}
        self._reading = threading.Lock()

    def runs(self, ours: Collection[Path] = ()) -> tuple[ListedRun, ...]:
        """Read which runs there are: first those that are being written, then what was written last.

        `ours` are the folders, resolved, that this process holds: their locks do not count.
        """
        with self._reading:
            found = dict(_run_folders(self.folder, DEPTH))
            self._known = {path: (stamp, self._listed(path, stamp)) for path, stamp in found.items()}
            runs = [run if path in ours else _with_lock(run) for path, (_, run) in self._known.items()]
        return tuple(sorted(_with_origins(runs), key=lambda run: _place(run, ours)))

    def _listed(self, path: Path, stamp: Stamp) -> ListedRun:
        """Return a run as it was known, or as its files have it now."""
        known = self._known.get(path)
        if known and known[0] == stamp:
            return known[1]
        name = printable(path.relative_to(self.folder))
        written = max(each[0] for each in stamp if each) / 1e9
        try:
            facts = _facts(path)
        except (OSError, ValueError, OverflowError, RecursionError) as error:
            return ListedRun(path, name, "damaged", written, None, _reason(error, path))
        return ListedRun(path, name, "finished" if facts.scores else "interrupted", written, facts)


def is_run(folder: Path) -> bool:
    """Return whether a folder holds a run, damaged as it may be."""
    return _looks_like_run(_stamp(folder))


def printable(name: Path | str) -> str:
    """Return a name with an escape in place of each byte that is no text."""
    return os.fsencode(name).decode(errors="backslashreplace")


def _run_folders(folder: Path, depth: int) -> Iterator[tuple[Path, Stamp]]:
    """Give the runs in a folder, and in folders in it that are none. Links and hidden folders are not followed."""
    try:
        with os.scandir(folder) as entries:
            inside = [entry.name for entry in entries if entry.name[0] != "." and entry.is_dir(follow_symlinks=False)]
    except OSError:  # it is gone, or not ours to read
        return
    for name in inside:
        path = folder / name
        stamp = _stamp(path)
        if _looks_like_run(stamp):
            yield path, stamp
        elif depth > 1:
            yield from _run_folders(path, depth - 1)


def _stamp(folder: Path) -> Stamp:
    return tuple(_changed(f"{folder}{os.sep}{name}") for name in READ)


def _changed(path: str) -> tuple[int, int] | None:
    try:
        status = os.stat(path)
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size


def _looks_like_run(stamp: Stamp) -> bool:
    """Return whether a folder has two of the three files that every run has after its warm-up: one may be lost."""
    manifest, config, metrics, *_ = stamp
    return sum(each is not None for each in (manifest, config, metrics)) >= 2


def _with_lock(run: ListedRun) -> ListedRun:
    """Return the run as it is if another process writes it."""
    with suppress(OSError):  # where the lock cannot be looked at
        try:
            check_unlocked(run.path)
        except FolderInUse as error:
            return replace(run, state="elsewhere", why=_reason(error, run.path.parent))
    return run


def _with_origins(runs: Sequence[ListedRun]) -> Iterator[ListedRun]:
    """Give the runs, each branch with the present name of the run that it leaves, if that is listed.

    Of several copies of that run it is the one that is called as it was then.
    """
    names: dict[str, list[str]] = {}
    for run in runs:
        if run.facts:
            names.setdefault(run.facts.run, []).append(run.name)
    for run in runs:
        origin = run.facts.origin if run.facts else None
        if run.facts and origin and origin.run in names:
            name = max(names[origin.run], key=lambda name: name.rpartition(os.sep)[2] == origin.name)
            yield replace(run, facts=replace(run.facts, origin=replace(origin, name=name)))
        else:
            yield run


def _place(run: ListedRun, ours: Collection[Path]) -> tuple[object, ...]:
    """Return what runs are ordered by. Those that are written now keep their places among each other."""
    now = run.path in ours or run.state == "elsewhere"
    return not now, 0 if now else -run.written, run.name


def _facts(path: Path) -> Facts:
    """Read the small files of a run. Raises OSError, ValueError, OverflowError and RecursionError."""
    layout = Layout(path)
    manifest = read_manifest(path)
    settings: dict[str, Any] = tomllib.loads(layout.config.read_bytes().decode())
    check_fields(settings, _SETTINGS, str(layout.config))
    last = _last_row(layout.metrics) if layout.metrics.exists() else None
    parent = manifest["parent"]
    return Facts(
        run=manifest["run"],
        env=settings["env"],
        method=settings["method"],
        user=settings["user"],
        budget=settings["steps"],
        rounds=_count(last, "generation", layout.metrics) if last else None,
        steps=_count(last, "steps", layout.metrics) if last else 0,
        scores=_scores(layout.result) if layout.result.exists() else (),
        origin=Origin(parent["run"], parent["name"], parent["generation"]) if parent else None,
    )


def _last_row(path: Path) -> dict[str, str] | None:
    """Return the last whole row of a CSV file; None if there is none. A line may just be written."""
    text = path.read_bytes().decode()
    rows = parsed_rows(text[: text.rfind("\n") + 1], str(path))
    return rows[-1] if rows else None


def _count(row: dict[str, str], column: str, path: Path) -> int:
    cell = row.get(column, "")
    if not cell.isdecimal() or len(cell) > DIGITS:
        raise ValueError(f"{path} has no number in the last row of its column {column}")
    return int(cell)


def _scores(path: Path) -> tuple[tuple[str, float], ...]:
    """Return the value of the result in each objective."""
    chosen: Mapping[str, Any] = read_result(path)["chosen"]
    found = {name.removeprefix(VALUE): value for name, value in chosen.items() if name.startswith(VALUE)}
    if not found or not all(isinstance(value, int | float) and math.isfinite(value) for value in found.values()):
        raise ValueError(f"{path} has no scores of the result, or one that is not finite")
    return tuple((name, float(value)) for name, value in found.items())


def _reason(error: Exception, path: Path) -> str:
    """Return why a run cannot be read, in words that name its files alone."""
    said = f"{error.strerror}: {error.filename}" if isinstance(error, OSError) else str(error)
    return printable(said.replace(f"{path}{os.sep}", ""))

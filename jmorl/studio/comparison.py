"""The fronts of a run and its branches, read to be shown in one chart."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from envs.core import Objective
from jmorl.storage.layout import Layout
from jmorl.storage.stored_run import StoredFront, StoredRunError, read_front
from jmorl.studio.history import Branch


@dataclass(frozen=True, eq=False)
class BranchFront:
    """The front of a branch."""

    branch: Branch
    place: int  # of the branch in the history, the first run's is 0
    front: StoredFront


@dataclass(frozen=True, eq=False)
class Comparison:
    """The fronts of those branches that have one."""

    fronts: tuple[BranchFront, ...]
    problems: tuple[str, ...]  # why others cannot be shown, sentences


def read_fronts(branches: Sequence[Branch], objectives: tuple[Objective, ...]) -> Comparison:
    """Read the fronts of branches, those again that have changed since. One in its warm-up has none."""
    fronts, problems = [], []
    for place, branch in enumerate(branches):
        layout = Layout(branch.path)
        try:
            if layout.front.exists():
                stamps = _stamp(layout.front), _stamp(layout.result)
                fronts.append(BranchFront(branch, place, _read(branch.path, objectives, stamps)))
        except StoredRunError as error:
            problems.append(str(error))
    return Comparison(tuple(fronts), tuple(problems))


def _stamp(path: Path) -> tuple[int, int] | None:
    """Return what changes when a file is written anew; None for one that is not there."""
    try:
        found = path.stat()
    except FileNotFoundError:
        return None
    return found.st_mtime_ns, found.st_ino


@lru_cache(maxsize=256)
def _read(path: Path, objectives: tuple[Objective, ...], stamps: object) -> StoredFront:
    return read_front(path, objectives)

"""Named arrays as a folder that Orbax writes.

Orbax finds its own files by patterns. In a folder whose path has brackets or a backslash in it, it finds none, leaves
out the list of what it wrote, and says nothing. Other names it takes for addresses of a cloud, or cannot write down.
So it works under plain names only, and what it wrote is read back before anybody relies on it.
"""

import functools
import gc
import logging
import os
import re
import shutil
import sys
import tempfile
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

PLAIN = re.compile(r"[\w .-]+")  # of each folder in a path
_one_at_a_time = threading.RLock()


class ArraysError(ValueError):
    """Arrays that Orbax cannot write, or cannot read."""


def write_arrays(path: Path, arrays: Mapping[str, np.ndarray]) -> None:
    """Write arrays as the new folder `path`, and read them back. Raises ArraysError and OSError."""
    if _is_plain(path):
        _save(path.absolute(), arrays)
    else:
        with _plain_folder() as folder:
            _save(folder / "arrays", arrays)
            shutil.move(folder / "arrays", path)


def read_arrays(path: Path) -> dict[str, np.ndarray]:
    """Read the arrays in a folder. Raises ArraysError if they cannot be read, OSError if there is no place to."""
    if _is_plain(path):
        return _load(path.absolute())
    with _plain_folder() as folder:
        return _load(shutil.copytree(path, folder / "arrays"))


def _is_plain(path: Path) -> bool:
    return all(PLAIN.fullmatch(part) for part in path.absolute().parts[1:])


@contextmanager
def _plain_folder() -> Iterator[Path]:
    """Make a temporary folder with a plain path. Raises OSError if the system's has none."""
    with tempfile.TemporaryDirectory(prefix="jmorl-") as name:
        folder = Path(name)
        if not _is_plain(folder):
            raise OSError(
                f"the folder for temporary files, {folder.parent}, has special characters in its path; set TMPDIR to "
                "one with letters, digits, spaces, dots and dashes only"
            )
        yield folder


def _save(path: Path, arrays: Mapping[str, np.ndarray]) -> None:
    """Write uncompressed: the mantissas of trained networks are noise; compressing them costs more than their bytes."""
    with _orbax() as ocp:
        handler = ocp.PyTreeCheckpointHandler(use_ocdbt=True, use_compression=False)
        with ocp.Checkpointer(handler) as checkpointer:
            checkpointer.save(path, dict(arrays))
    (path / "commit_success.txt").unlink(missing_ok=True)  # names this place, and a run may be moved
    written = _load(path)
    if written.keys() != arrays.keys() or not all(_same(written[name], arrays[name]) for name in arrays):
        raise ArraysError("what was written is not what was read back")


def _same(one: np.ndarray, other: np.ndarray) -> bool:
    return one.dtype == other.dtype and np.array_equal(one, other, equal_nan=True)


def _load(path: Path) -> dict[str, np.ndarray]:
    with _orbax() as ocp, ocp.PyTreeCheckpointer() as checkpointer:
        restored: dict[str, np.ndarray] = checkpointer.restore(path)
    return restored


@contextmanager
def _orbax() -> Iterator[Any]:
    """Give Orbax to one thread at a time, and raise what goes wrong there once, as ArraysError in a few words.

    Otherwise each of its threads reports a traceback, and so does each task that it leaves behind.
    """
    import orbax.checkpoint as ocp  # takes half a second to import

    _ignore_late_callbacks()
    failure = None
    with _one_at_a_time, _quiet():
        try:
            yield ocp
        except Exception as error:  # it raises all kinds, and so do the libraries below it
            failure = _reason(error)
        if failure:
            gc.collect()  # the tasks left behind
    if failure:
        raise ArraysError(failure)


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep what Orbax says of its threads and tasks to itself."""

    def heard(record: logging.LogRecord) -> bool:
        return "orbax" not in Path(record.pathname).parts and "never retrieved" not in record.getMessage()

    loggers = (logging.getLogger("absl"), logging.getLogger("asyncio"))
    for logger in loggers:
        logger.addFilter(heard)
    try:
        yield
    finally:
        for logger in loggers:
            logger.removeFilter(heard)


@functools.cache
def _ignore_late_callbacks() -> None:
    """Say nothing, from now on, of callbacks that Orbax's threads make after it has closed the loop they belong to.

    That may be any time later, on a busy machine, and is not an error.
    """
    report = sys.unraisablehook

    def reported(unraisable: Any) -> None:
        if str(unraisable.exc_value) != "Event loop is closed":
            report(unraisable)

    sys.unraisablehook = reported


def _reason(error: Exception) -> str:
    """Return the system's words for what went wrong. Orbax has its number somewhere in a long text."""
    number = re.search(r"os_error_code='(\d+)'", str(error))
    if number:
        return os.strerror(int(number[1]))
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    return str(error).partition(" [")[0].partition("\n")[0] or type(error).__name__

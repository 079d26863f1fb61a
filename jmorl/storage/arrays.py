"""Named arrays as a folder that Orbax writes.

Orbax finds its own files by patterns. In a folder whose path has brackets or a backslash in it, it finds none, leaves
out the list of what it wrote, and says nothing. Other names it takes for addresses of a cloud, or cannot write down.
So it works under plain names only, and what it wrote is read back before anybody relies on it.
"""

import logging
import re
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import numpy as np

PLAIN = re.compile(r"[\w .-]+")  # of each folder in a path


class ArraysError(ValueError):
    """Arrays that cannot be read back."""


def write_arrays(path: Path, arrays: Mapping[str, np.ndarray]) -> None:
    """Write arrays as the new folder `path`. Raises ArraysError if what was written is not what should be."""
    if _is_plain(path):
        _save(path.absolute(), arrays)
    else:
        with _plain_folder() as folder:
            _save(folder / "arrays", arrays)
            shutil.move(folder / "arrays", path)


def read_arrays(path: Path) -> dict[str, np.ndarray]:
    """Read the arrays in a folder. Raises ArraysError if Orbax cannot."""
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
    import orbax.checkpoint as ocp  # takes half a second to import

    handler = ocp.PyTreeCheckpointHandler(use_ocdbt=True, use_compression=False)
    with _quiet(), ocp.Checkpointer(handler) as checkpointer:
        checkpointer.save(path, dict(arrays))
    (path / "commit_success.txt").unlink(missing_ok=True)  # names this place, and a run may be moved
    written = _load(path)
    if written.keys() != arrays.keys() or not all(_same(written[name], arrays[name]) for name in arrays):
        raise ArraysError("what was written is not what was read back")


def _same(one: np.ndarray, other: np.ndarray) -> bool:
    return one.dtype == other.dtype and np.array_equal(one, other, equal_nan=True)


def _load(path: Path) -> dict[str, np.ndarray]:
    import orbax.checkpoint as ocp

    try:
        with _quiet(), ocp.PyTreeCheckpointer() as checkpointer:
            restored: dict[str, np.ndarray] = checkpointer.restore(path)
    except Exception as error:  # Orbax and the libraries below it raise all kinds
        raise ArraysError(f"its arrays cannot be read: {str(error).partition(' [')[0]}") from error
    return restored


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep out of the log what Orbax's threads report, a traceback each: its failure is raised once more, to us."""

    def not_of_orbax(record: logging.LogRecord) -> bool:
        return "orbax" not in Path(record.pathname).parts

    logger = logging.getLogger("absl")
    logger.addFilter(not_of_orbax)
    try:
        yield
    finally:
        logger.removeFilter(not_of_orbax)

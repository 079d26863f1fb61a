"""Writing files so that nobody ever sees half of one, and none is lost when the power fails."""

import json
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

WINDOWS = os.name == "nt"


@contextmanager
def written_whole(path: Path) -> Iterator[Path]:
    """Give a temporary path beside `path`, which replaces it when the block ends, and vanishes if the block fails.

    The file is on the disk after that.
    """
    temporary = partial_path(path)
    try:
        yield temporary
        sync(temporary)
        os.replace(temporary, path)
        sync(path.parent)
    finally:
        temporary.unlink(missing_ok=True)


def partial_path(path: Path) -> Path:
    """Return where a file or folder is while it is being written."""
    return path.with_name(f".{path.name}.partial")


def remove_partial(folder: Path) -> None:
    """Delete what a process that was killed had begun to write in a folder and those below it."""
    for path in sorted(folder.rglob(".*.partial")):
        remove(path)


def remove(path: Path) -> None:
    """Delete a file, or a folder with all that is in it; nothing if there is neither."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write or replace a text file; it is on the disk when this returns."""
    with written_whole(path) as temporary:
        temporary.write_bytes(text.encode())


def write_json(path: Path, content: Any) -> None:
    """Write or replace a JSON file. Raises ValueError for NaN and infinity, which JSON does not have.

    A byte of a file name that is no text becomes a question mark: what reads JSON refuses it.
    """
    text = json.dumps(content, indent=2, allow_nan=False, ensure_ascii=False)
    write_text(path, text.encode(errors="replace").decode() + "\n")


def append_text(path: Path, text: str) -> None:
    """Append to a text file; it is on the disk when this returns."""
    new = not path.exists()
    with path.open("ab") as file:
        file.write(text.encode())
        file.flush()
        os.fsync(file.fileno())
    if new:
        sync(path.parent)


def sync(path: Path) -> None:
    """Wait until a file, or the list of names in a folder, is on the disk. Windows has no such thing for folders."""
    if WINDOWS and path.is_dir():
        return
    # Windows flushes only what may be written; elsewhere a file without permission to write can be flushed, too.
    descriptor = os.open(path, os.O_RDWR if WINDOWS else os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)

"""One process at a time writes a run folder.

The lock is the operating system's, on the file `run.lock`, so it ends with the process that holds it, however that
ends. The file names the holder, and is deleted when a run is left in good order: one that is found there, but not
locked, tells that its process is gone.
"""

import json
import os
import platform
import time
from pathlib import Path

from jmorl.storage.layout import Layout

ATTEMPTS = 5  # somebody who only looks whether a folder is locked has the lock for a moment
MOMENT = 0.01  # seconds
FIRST = b"{"  # byte of the file. It is the locked one, which Windows lets nobody else read.


class FolderInUse(ValueError):
    """The folder holds something that must not be overwritten, or another process is writing it."""


class RunLock:
    """The lock of a run folder, held from `__init__` to `release`.

    Raises FolderInUse, naming the holder, if another process has it. `previous` describes a holder that is gone
    without having released it, if there was one.
    """

    def __init__(self, folder: Path):
        self.path = Layout(folder).lock
        self._descriptor = _locked(self.path)
        self.previous = _holder(self._descriptor)
        started = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())
        holder = {"pid": os.getpid(), "host": platform.node(), "started": started}
        os.ftruncate(self._descriptor, 0)
        os.lseek(self._descriptor, 0, os.SEEK_SET)
        os.write(self._descriptor, json.dumps(holder).encode())

    def release(self) -> None:
        """Let others have the folder. Where the file cannot be deleted, as on Windows, it stays, unlocked and empty.

        A second time it does nothing.
        """
        descriptor, self._descriptor = self._descriptor, -1
        if descriptor < 0:
            return
        try:
            self.path.unlink(missing_ok=True)
        except OSError:
            os.ftruncate(descriptor, 0)
        os.close(descriptor)


def check_unlocked(folder: Path) -> None:
    """Raise FolderInUse, naming the process, if one is writing the folder."""
    path = Layout(folder).lock
    if path.exists():
        descriptor = os.open(path, os.O_RDONLY)
        try:
            _lock(descriptor, path)
        finally:
            os.close(descriptor)


def _locked(path: Path) -> int:
    """Return a descriptor of the lock file, locked."""
    while True:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
        try:
            _lock(descriptor, path)
            if _is_at(descriptor, path):
                return descriptor
        except BaseException:
            os.close(descriptor)
            raise
        os.close(descriptor)


def _is_at(descriptor: int, path: Path) -> bool:
    """Return whether the path still leads to the open file, which its last holder may have deleted."""
    try:
        return os.path.samestat(os.fstat(descriptor), path.stat())
    except FileNotFoundError:
        return False


def _lock(descriptor: int, path: Path) -> None:
    """Lock the open file until the descriptor is closed. Raises FolderInUse if another process has the lock."""
    from filelock import lock_descriptor  # takes a tenth of a second to import

    for attempt in range(ATTEMPTS):
        if lock_descriptor(descriptor, blocking=False):
            return
        if attempt < ATTEMPTS - 1:
            time.sleep(MOMENT)
    holder = _holder(descriptor) or "another process"
    raise FolderInUse(f"{path.parent} is being written by {holder}; wait for it, or end it")


def _holder(descriptor: int) -> str | None:
    """Return whom the lock file names, in words; None if it names nobody."""
    try:
        os.lseek(descriptor, len(FIRST), os.SEEK_SET)
        holder = json.loads(FIRST + os.read(descriptor, 4096))
        return f"process {holder['pid']} on {holder['host']}, started {holder['started']}"
    except (OSError, ValueError, TypeError, KeyError):
        return None

"""One process at a time writes a run folder.

The lock is the operating system's, on the file `run.lock`, so it ends with the process that holds it, however that
ends. The file names the holder, and is deleted when a run is left in good order: one that is found there, but not
locked, tells that its process is gone.
"""

import fcntl
import json
import os
import platform
import time
from pathlib import Path

LOCK_FILE = "run.lock"


class FolderInUse(ValueError):
    """The folder holds something that must not be overwritten, or another process is writing it."""


class RunLock:
    """The lock of a run folder, held from `__init__` to `release`.

    Raises FolderInUse, naming the holder, if another process has it. `previous` describes a holder that is gone
    without having released it, if there was one.
    """

    def __init__(self, folder: Path):
        self.path = folder / LOCK_FILE
        self._descriptor = _locked(self.path)
        self.previous = _holder(self._descriptor)
        started = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())
        holder = {"pid": os.getpid(), "host": platform.node(), "started": started}
        os.ftruncate(self._descriptor, 0)
        os.pwrite(self._descriptor, json.dumps(holder).encode(), 0)

    def release(self) -> None:
        """Let others have the folder. Where the file cannot be deleted it stays, unlocked."""
        try:
            self.path.unlink(missing_ok=True)
        except OSError:
            os.ftruncate(self._descriptor, 0)
        os.close(self._descriptor)


def check_unlocked(folder: Path) -> None:
    """Raise FolderInUse, naming the process, if one is writing the folder."""
    path = folder / LOCK_FILE
    if path.exists():
        descriptor = os.open(path, os.O_RDONLY)
        try:
            _lock(descriptor, path, fcntl.LOCK_SH)
        finally:
            os.close(descriptor)


def _locked(path: Path) -> int:
    """A descriptor of the lock file, locked."""
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
    """Whether the path still leads to the open file: its last holder may have deleted it before it was locked."""
    try:
        return os.path.samestat(os.fstat(descriptor), path.stat())
    except FileNotFoundError:
        return False


def _lock(descriptor: int, path: Path, kind: int = fcntl.LOCK_EX) -> None:
    try:
        fcntl.flock(descriptor, kind | fcntl.LOCK_NB)
    except BlockingIOError:
        holder = _holder(descriptor) or "another process"
        raise FolderInUse(f"{path.parent} is being written by {holder}; wait for it, or end it") from None


def _holder(descriptor: int) -> str | None:
    """Who the lock file names, in words; None if it names nobody."""
    try:
        holder = json.loads(os.pread(descriptor, 4096, 0))
        return f"process {holder['pid']} on {holder['host']}, started {holder['started']}"
    except (ValueError, TypeError, KeyError):
        return None

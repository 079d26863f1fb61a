"""One process at a time: the lock keeps others out, names its holder, and dies with it."""

import os
import subprocess
import sys

import pytest

from jmorl.storage.lock import LOCK_FILE, FolderInUse, RunLock, check_unlocked

HOLD = """
import sys
from pathlib import Path
from jmorl.storage.lock import RunLock
lock = RunLock(Path(sys.argv[1]))
print("locked", flush=True)
sys.stdin.read()
"""


@pytest.fixture
def holder(tmp_path):
    """Another process that holds the lock of `tmp_path`."""
    process = subprocess.Popen(
        [sys.executable, "-c", HOLD, str(tmp_path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout.readline() == "locked\n"
    yield process
    process.kill()
    process.communicate()


def test_another_process_is_kept_out_and_told_whose_it_is(tmp_path, holder):
    message = rf"is being written by process {holder.pid} on .*, started 20.*Z; wait for it, or end it"
    with pytest.raises(FolderInUse, match=message):
        RunLock(tmp_path)
    with pytest.raises(FolderInUse, match=message):
        check_unlocked(tmp_path)


def test_the_lock_of_a_killed_process_is_taken_over_and_the_process_named(tmp_path, holder):
    holder.kill()
    holder.wait()
    check_unlocked(tmp_path)
    lock = RunLock(tmp_path)
    assert lock.previous.startswith(f"process {holder.pid} on ")
    lock.release()


def test_a_released_lock_leaves_nothing_behind(tmp_path):
    for _ in range(2):
        lock = RunLock(tmp_path)
        assert lock.previous is None
        with pytest.raises(FolderInUse, match=f"process {os.getpid()} on"):
            RunLock(tmp_path)
        lock.release()
        assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("content", ["", "{", "[]", '{"pid": 1}'])
def test_a_lock_file_that_says_nothing_is_no_obstacle(tmp_path, content):
    (tmp_path / LOCK_FILE).write_text(content)
    check_unlocked(tmp_path)
    assert RunLock(tmp_path).previous is None


def test_a_lock_file_deleted_between_opening_and_locking_is_not_taken_for_the_lock(tmp_path, monkeypatch):
    """Whoever locks the deleted file would share the folder with whoever makes a new one."""
    import fcntl

    flock, calls = fcntl.flock, []

    def late(descriptor, kind):
        calls.append(kind)
        if len(calls) == 1:
            (tmp_path / LOCK_FILE).unlink()
        flock(descriptor, kind)

    monkeypatch.setattr(fcntl, "flock", late)
    RunLock(tmp_path)
    assert len(calls) == 2
    with pytest.raises(FolderInUse):
        RunLock(tmp_path)

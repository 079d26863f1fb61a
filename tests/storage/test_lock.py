"""One process at a time: the lock keeps others out, names its holder, and dies with it."""

import os
import subprocess
import sys

import filelock
import pytest

from jmorl.storage.layout import Layout
from jmorl.storage.lock import FolderInUse, RunLock, check_unlocked

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
    Layout(tmp_path).lock.write_text(content)
    check_unlocked(tmp_path)
    assert RunLock(tmp_path).previous is None


def test_who_only_looks_at_a_lock_keeps_nobody_out(tmp_path, monkeypatch):
    """Looking takes the lock for a moment. Here it is found taken three times, and then no longer."""
    lock_descriptor, calls = filelock.lock_descriptor, []

    def taken_at_first(descriptor, blocking):
        calls.append(descriptor)
        return len(calls) > 3 and lock_descriptor(descriptor, blocking=blocking)

    monkeypatch.setattr(filelock, "lock_descriptor", taken_at_first)
    assert RunLock(tmp_path).previous is None
    assert len(calls) == 4


def test_looking_leaves_the_folder_free_and_the_file_as_it_was(tmp_path):
    path = Layout(tmp_path).lock
    path.write_text('{"pid": 17, "host": "here", "started": "yesterday"}')
    before = path.read_bytes()
    check_unlocked(tmp_path)
    assert path.read_bytes() == before
    assert RunLock(tmp_path).previous == "process 17 on here, started yesterday"


def test_a_lock_file_deleted_between_opening_and_locking_is_not_taken_for_the_lock(tmp_path, monkeypatch):
    """Whoever locks the deleted file would share the folder with whoever makes a new one."""
    lock_descriptor, calls = filelock.lock_descriptor, []

    def late(descriptor, blocking):
        calls.append(descriptor)
        if len(calls) == 1:
            Layout(tmp_path).lock.unlink()
        return lock_descriptor(descriptor, blocking=blocking)

    with monkeypatch.context() as patch:
        patch.setattr(filelock, "lock_descriptor", late)
        RunLock(tmp_path)
    assert len(calls) == 2
    with pytest.raises(FolderInUse):
        RunLock(tmp_path)

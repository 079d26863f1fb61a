"""Checkpoints: visible only when whole, refused when a byte is not as written, deleted only behind a newer one."""

import json
import shutil

import numpy as np
import pytest

from jmorl.storage import checkpoints
from jmorl.storage.arrays import ArraysError
from jmorl.storage.checkpoints import (
    FORMAT,
    Checkpoint,
    CheckpointError,
    CheckpointWriter,
    DamagedCheckpoint,
    _digest_line,
    read_checkpoint,
    stored_generations,
    write_checkpoint,
)
from jmorl.storage.layout import CheckpointLayout, checkpoint_path
from jmorl.storage.serialization import pack, unpack
from jmorl.storage.versions import NewerFormat
from tests.storage.test_serialization import assert_same

LOGS = {"metrics.csv": "generation,steps\r\n0,17\r\n", "decisions.jsonl": "", "policies.csv": "größer\r\n"}


@pytest.fixture
def written(make_state, method, tmp_path):
    """A folder with the checkpoint of generation 1, and the state in it."""
    state = make_state(1)
    write_checkpoint(tmp_path, Checkpoint(1, "some-run", pack(state, method), LOGS))
    return tmp_path, state


def files(folder):
    return sorted(path for path in folder.rglob("*") if path.is_file())


def test_what_is_read_is_what_was_written(written, small_config, environment):
    folder, state = written
    checkpoint = read_checkpoint(folder, 1)
    assert (checkpoint.generation, checkpoint.run, checkpoint.logs) == (1, "some-run", LOGS)
    assert_same(state, unpack(checkpoint.state, small_config, environment))


def test_a_checkpoint_may_be_moved_and_names_no_place(written, tmp_path, small_config, environment):
    folder, state = written
    moved = tmp_path.parent / "moved elsewhere"
    shutil.move(folder, moved)
    assert_same(state, unpack(read_checkpoint(moved, 1).state, small_config, environment))
    for path in files(moved):
        assert str(tmp_path).encode() not in path.read_bytes(), path


def test_no_file_is_too_short_without_being_named(written):
    """Truncations at 20 lengths of every file."""
    folder, _ = written
    for path in files(folder):
        content = path.read_bytes()
        for length in np.unique(np.linspace(0, len(content) - 1, 20).astype(int)) if content else []:
            path.write_bytes(content[:length])
            with pytest.raises(DamagedCheckpoint, match=path.name):
                read_checkpoint(folder, 1)
        path.write_bytes(content)
    read_checkpoint(folder, 1)


def test_no_flipped_bit_goes_unnoticed(written):
    """200 bits anywhere in the checkpoint, and 20 in every small file, which Orbax alone would often accept."""
    folder, _ = written
    generator = np.random.default_rng(0)
    paths = [path for path in files(folder) if path.stat().st_size]
    sizes = np.array([path.stat().st_size for path in paths])
    chosen = [*generator.choice(len(paths), 200, p=sizes / sizes.sum()), *np.repeat(np.arange(len(paths)), 20)]
    for path in (paths[index] for index in chosen):
        content = bytearray(path.read_bytes())
        content[generator.integers(len(content))] ^= 1 << generator.integers(8)
        original = path.read_bytes()
        path.write_bytes(content)
        with pytest.raises(DamagedCheckpoint, match=path.name):
            read_checkpoint(folder, 1)
        path.write_bytes(original)
    read_checkpoint(folder, 1)


def test_a_missing_file_is_named(written):
    folder, _ = written
    for path in files(folder):
        content = path.read_bytes()
        path.unlink()
        with pytest.raises(DamagedCheckpoint, match=f"{path.name} is missing"):
            read_checkpoint(folder, 1)
        path.write_bytes(content)


def test_a_newer_format_is_refused_with_the_version_that_wrote_it(written):
    path = CheckpointLayout(checkpoint_path(written[0], 1)).document
    document = json.loads(path.read_text().splitlines()[0]) | {"format": FORMAT + 1, "jmorl": "9.1.2"}
    line = json.dumps(document) + "\n"
    path.write_text(line + _digest_line(line))
    with pytest.raises(NewerFormat, match=f"format {FORMAT + 1}, written by jmorl 9.1.2; this is jmorl .*update it"):
        read_checkpoint(written[0], 1)


def test_nothing_is_seen_of_a_checkpoint_that_fails_at_any_step(make_state, method, tmp_path, monkeypatch):
    """Whatever call fails, the earlier checkpoint stands and nothing else is there."""
    write_checkpoint(tmp_path, Checkpoint(1, "run", pack(make_state(1), method), LOGS))

    def full(*arguments, **keywords):
        raise OSError(28, "No space left on device")

    for place, name in [
        (checkpoints, "write_arrays"),
        (checkpoints, "_fingerprint"),
        (checkpoints, "sync"),
        (checkpoints.Path, "write_bytes"),
        (checkpoints.os, "rename"),
    ]:
        with monkeypatch.context() as patch:
            patch.setattr(place, name, full)
            with pytest.raises((OSError, ArraysError), match="No space left"):
                write_checkpoint(tmp_path, Checkpoint(2, "run", pack(make_state(2), method), LOGS))
        assert [path.name for path in tmp_path.iterdir()] == ["00001"], name
    read_checkpoint(tmp_path, 1)


def test_a_failure_in_the_background_is_raised_by_the_next_call(make_state, method, tmp_path, monkeypatch):
    def full(*arguments):
        raise OSError(28, "No space left on device")

    for call in (lambda writer: writer.wait(), lambda writer: writer.save(make_state(3), LOGS)):
        writer = CheckpointWriter(tmp_path, "run", 2, method)
        with monkeypatch.context() as patch:
            patch.setattr(checkpoints, "write_arrays", full)
            writer.save(make_state(2), LOGS)
            with pytest.raises(CheckpointError, match="of round 2 could not be written: .*No space left"):
                call(writer)
        writer.close()


@pytest.mark.parametrize("keep", [1, 3])
def test_the_last_ones_are_kept(make_state, method, tmp_path, keep):
    writer = CheckpointWriter(tmp_path, "run", keep, method)
    for generation in range(5):
        writer.save(make_state(generation), LOGS)
    writer.close()
    assert stored_generations(tmp_path) == list(range(5))[-keep:]


def test_none_is_deleted_before_the_next_is_whole(make_state, method, tmp_path, monkeypatch):
    writer = CheckpointWriter(tmp_path, "run", 1, method)
    writer.save(make_state(1), LOGS)
    writer.wait()

    def failing(*arguments):
        raise OSError("full")

    monkeypatch.setattr(checkpoints, "write_arrays", failing)
    writer.save(make_state(2), LOGS)
    with pytest.raises(CheckpointError):
        writer.close()
    assert read_checkpoint(tmp_path, 1).generation == 1

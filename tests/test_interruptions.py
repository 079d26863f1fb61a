"""Signals, a full disk, lost permissions: the run ends in good order, says how to go on, and does."""

import os
import shutil
import signal
import tempfile
import time
from pathlib import Path

import pytest

from jmorl.cli import main
from jmorl.learning.population import Population
from jmorl.methods.pgmorl import PGMORL
from jmorl.storage import checkpoints
from tests.resuming import outcome

NOBODY = 65534


@pytest.fixture(autouse=True)
def _interrupts_are_heard():
    """A background job of a shell ignores SIGINT, and so would the runs in a test suite that is one."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_a_run_after_its_generation_and_says_how_to_go_on(
    whole, small_config, tmp_path, capsys, monkeypatch, number
):
    config, path = tmp_path / "config.toml", tmp_path / "run"
    config.write_text(small_config.to_toml())
    training, calls = Population.train, []

    def signalled(self, *arguments):
        calls.append(arguments)
        if len(calls) == 3:
            os.kill(os.getpid(), number)
        return training(self, *arguments)

    handlers = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
    with monkeypatch.context() as patch:
        patch.setattr(Population, "train", signalled)
        assert main(["train", "--config", str(config), "--out", str(path), "--quiet"]) == 128 + number
    assert (signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)) == handlers
    errors = capsys.readouterr().err
    assert "stopping after this round" in errors
    assert f"{number.name} received" in errors and f"go on with: jmorl resume {path}" in errors
    assert len((path / "metrics.csv").read_text().splitlines()) == 1 + 3
    assert main(["train", "--config", str(config), "--out", str(path)]) == 2
    assert f"continue it with `jmorl resume {path}`" in capsys.readouterr().err
    assert main(["resume", str(path), "--quiet"]) == 0
    shutil.rmtree(path / "plots")
    assert outcome(path) == outcome(whole)


def test_a_signal_does_not_wait_for_a_selection(whole, small_config, tmp_path, monkeypatch, capsys):
    config, path = tmp_path / "config.toml", tmp_path / "run"
    config.write_text(small_config.to_toml())

    def endless(method, run):
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(60)
        raise AssertionError("the selection was not broken off")

    with monkeypatch.context() as patch:
        patch.setattr(PGMORL, "tasks", endless)
        assert main(["train", "--config", str(config), "--out", str(path), "--quiet"]) == 143
    assert f"go on with: jmorl resume {path}" in capsys.readouterr().err
    assert main(["resume", str(path), "--quiet"]) == 0
    shutil.rmtree(path / "plots")
    assert outcome(path) == outcome(whole)


def test_a_signal_while_somebody_is_asked_does_not_wait_for_an_answer(small_config, tmp_path, monkeypatch, capsys):
    config, path = tmp_path / "config.toml", tmp_path / "run"
    config.write_text(small_config.replace(user="terminal").to_toml())

    def never(prompt):
        os.kill(os.getpid(), signal.SIGTERM)
        raise AssertionError("the question was not broken off")

    with monkeypatch.context() as patch:
        patch.setattr("builtins.input", never)
        assert main(["train", "--config", str(config), "--out", str(path), "--quiet"]) == 143
    assert (path / "checkpoints" / "00000").exists() and not (path / "decisions.jsonl").exists()


def test_a_full_disk_ends_the_run_with_what_it_had_and_it_can_go_on(whole, small_config, tmp_path, monkeypatch, capsys):
    config, path = tmp_path / "config.toml", tmp_path / "run"
    config.write_text(small_config.to_toml())
    write, calls = checkpoints.write_arrays, []

    def full(*arguments):
        calls.append(arguments)
        if len(calls) == 3:
            raise OSError(28, "No space left on device")
        write(*arguments)

    with monkeypatch.context() as patch:
        patch.setattr(checkpoints, "write_arrays", full)
        assert main(["train", "--config", str(config), "--out", str(path), "--quiet"]) == 1
    errors = capsys.readouterr().err
    assert "of round 2 could not be written" in errors and "No space left" in errors and "go on with" in errors
    assert main(["resume", str(path), "--quiet"]) == 0
    shutil.rmtree(path / "plots")
    assert outcome(path) == outcome(whole)


@pytest.fixture
def unprivileged(whole):
    """A folder of a user whom permissions bind, as whom the test runs. For root they do not."""
    folder = Path(tempfile.mkdtemp())
    root = os.geteuid() == 0
    shutil.copytree(whole, folder / "run")
    if root:
        for path in (folder, *folder.rglob("*")):
            os.chown(path, NOBODY, NOBODY)
        os.seteuid(NOBODY)
    yield folder
    if root:
        os.seteuid(0)
    set_writable(folder, True)
    shutil.rmtree(folder)


def set_writable(folder, writable):
    for path in (folder, *folder.rglob("*")):
        path.chmod((0o700 if path.is_dir() else 0o600) if writable else (0o500 if path.is_dir() else 0o400))


def test_a_read_only_folder_is_refused_in_words(unprivileged, small_config, capsys):
    run, config = unprivileged / "run", unprivileged / "config.toml"
    config.write_text(small_config.to_toml())
    (run / "result.json").unlink()
    set_writable(unprivileged, False)
    assert main(["resume", str(run)]) == 2
    assert f"{run} cannot be written: Permission denied" in capsys.readouterr().err
    assert main(["train", "--config", str(config), "--out", str(unprivileged / "new")]) == 2
    assert "new cannot be written: Permission denied" in capsys.readouterr().err
    assert main(["export", str(run), "--to", str(unprivileged / "policy.npz")]) == 2
    assert "policy.npz cannot be written: Permission denied" in capsys.readouterr().err


# Lost in the midst of a checkpoint, it leaves Orbax's own tasks behind without their event loop.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_permission_lost_midway_loses_nothing(unprivileged, small_config, monkeypatch, capsys):
    config, path = unprivileged / "config.toml", unprivileged / "new"
    config.write_text(small_config.to_toml())
    training, calls = Population.train, []

    def losing(self, *arguments):
        calls.append(arguments)
        if len(calls) == 3:
            set_writable(path, False)
        return training(self, *arguments)

    with monkeypatch.context() as patch:
        patch.setattr(Population, "train", losing)
        assert main(["train", "--config", str(config), "--out", str(path), "--quiet"]) == 1
    errors = capsys.readouterr().err
    assert "Permission denied" in errors and "go on with: jmorl resume" in errors
    set_writable(path, True)
    assert main(["resume", str(path), "--quiet"]) == 0
    shutil.rmtree(path / "plots")
    assert outcome(path) == outcome(unprivileged / "run")

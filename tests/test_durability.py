"""Runs that are killed, on full disks, by two processes at once, on other devices. Minutes long."""

import ctypes
import itertools
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import envs
from jmorl.cli import main
from jmorl.events import GenerationFinished
from jmorl.loop import make_method, run
from jmorl.storage.checkpoints import CheckpointWriter, read_checkpoint, stored_generations
from jmorl.storage.resume import resume
from tests.probes import OneStep
from tests.resuming import go_on, outcome, train

pytestmark = pytest.mark.slow

KILLS = 30
DISK = 2_000_000  # bytes of the small one; a run of these tests needs five


@pytest.fixture(scope="module")
def config_file(small_config, tmp_path_factory):
    """The config of this file's runs, which processes of their own can resolve."""
    path = tmp_path_factory.mktemp("config") / "config.toml"
    path.write_text(small_config.replace(env="tests.registered:probe-three-ways").to_toml())
    return path


@pytest.fixture(scope="module")
def start(tmp_path_factory):
    """Starts the command line in a process of its own; they share their compiled programs."""
    cache = {
        "JAX_COMPILATION_CACHE_DIR": str(tmp_path_factory.mktemp("jax")),
        "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0",
        "JAX_NUM_CPU_DEVICES": "2",
    }

    def starts(*arguments, kill_at=0, folder="/nowhere", **how):
        command = [sys.executable, "-m", "tests.breaking_off", str(kill_at), str(folder), *map(str, arguments)]
        environment = {**os.environ, **cache, **how.pop("environment", {})}
        return subprocess.Popen(
            command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **how
        )

    return starts


@pytest.fixture(scope="module")
def whole(start, config_file, tmp_path_factory):
    """The uninterrupted run of a process: its folder, how often it touched that, and its seconds from then on."""
    folder = tmp_path_factory.mktemp("runs") / "whole"
    for _ in range(2):  # the first time for the compilation cache
        shutil.rmtree(folder, ignore_errors=True)
        process = start("train", "--config", config_file, "--out", folder, "--quiet", folder=folder)
        began = wait_for(folder / "manifest.json", process)
        output, errors = process.communicate()
        assert process.returncode == 0, errors
    return folder, int(output), time.monotonic() - began


def wait_for(path, process):
    """When a file has appeared."""
    while not path.exists():
        assert process.poll() is None, process.communicate()
        time.sleep(0.002)
    return time.monotonic()


def killed(process):
    process.communicate()
    return process.returncode == -signal.SIGKILL


@pytest.mark.parametrize("kill", range(KILLS))
def test_a_run_killed_at_any_moment_ends_the_same(whole, start, config_file, tmp_path, kill):
    """Every other one at a random file operation, every other one at a random time; every third one twice."""
    uninterrupted, operations, seconds = whole
    generator = np.random.default_rng(kill)
    folder = tmp_path / "run"
    train_arguments = ("train", "--config", config_file, "--out", folder, "--quiet")
    if kill % 2:
        assert killed(start(*train_arguments, kill_at=generator.integers(1, operations + 1), folder=folder))
    else:
        process = start(*train_arguments)
        wait_for(folder / "manifest.json", process)
        time.sleep(generator.uniform(0, seconds))
        process.kill()
        process.communicate()
    if kill % 3 == 0:
        killed(start("resume", folder, "--quiet", kill_at=generator.integers(1, operations), folder=folder))
    finish(folder, [str(each) for each in train_arguments])
    assert outcome(folder) == outcome(uninterrupted)


def finish(folder, train_arguments):
    """Resume; a run that was killed before it had a config cannot be, and is started again."""
    began = (folder / "manifest.json").exists() and (folder / "config.toml").exists()
    assert main(["resume", str(folder), "--quiet"]) == (0 if began else 2)
    if not began:
        assert main(train_arguments) == 0


@pytest.fixture
def small_disk(tmp_path):
    """Make a folder on a disk of `DISK` bytes, and what limits a process to it.

    Nothing has to, unless such a disk may not be mounted; then the process cannot write large files.
    """
    folder = tmp_path / "disk"
    folder.mkdir()
    mounted = not subprocess.run(
        ["mount", "-t", "tmpfs", "-o", f"size={DISK}", "tmpfs", folder], capture_output=True, check=False
    ).returncode
    big = 500_000
    yield folder, lambda process: mounted or resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (big, big))
    if mounted:
        subprocess.run(["umount", folder], check=True)


def test_a_run_that_fills_the_disk_keeps_what_it_had_and_goes_on_where_there_is_room(
    whole, start, config_file, small_disk, tmp_path
):
    disk, limit = small_disk
    process = start("train", "--config", config_file, "--out", disk / "run", "--quiet")
    limit(process)
    _, errors = process.communicate()
    assert process.returncode == 1
    assert "No space left" in errors or "too large" in errors
    assert errors.count("\n") == 2 and all(line.startswith("jmorl: ") for line in errors.splitlines()), errors
    assert f"go on with: jmorl resume {disk / 'run'}" in errors
    for generation in stored_generations(disk / "run" / "checkpoints"):
        read_checkpoint(disk / "run" / "checkpoints", generation)
    moved = shutil.move(disk / "run", tmp_path / "moved")
    process = start("resume", moved, "--quiet")
    _, errors = process.communicate()
    assert process.returncode == 0, errors
    assert outcome(Path(moved)) == outcome(whole[0])


def test_two_processes_do_not_write_one_run(whole, start, config_file, tmp_path, capsys):
    folder = tmp_path / "run"
    process = start("train", "--config", config_file, "--out", folder, "--quiet")
    wait_for(folder / "config.toml", process)
    assert main(["resume", str(folder)]) == 2
    assert main(["train", "--config", str(config_file), "--out", str(folder), "--force"]) == 2
    assert capsys.readouterr().err.count(f"is being written by process {process.pid}") == 2
    _, errors = process.communicate()
    assert process.returncode == 0, errors
    assert outcome(folder) == outcome(whole[0])


def test_a_run_goes_on_with_another_number_of_devices_and_says_so(whole, start, tmp_path):
    folder = shutil.copytree(whole[0], tmp_path / "run")
    (folder / "result.json").unlink()
    for generation in (2, 3):
        shutil.rmtree(folder / "checkpoints" / f"{generation:05d}")
    process = start("resume", folder, environment={"JAX_NUM_CPU_DEVICES": "1"})
    output, errors = process.communicate()
    assert process.returncode == 0, errors
    assert "compiled" in output and "on 1 device" in output
    assert "device count 2 is now 1" in errors and "the run finds other policies than it would have found" in errors
    for name in ("metrics.csv", "decisions.jsonl", "policies.csv"):
        assert len((folder / name).read_text().splitlines()) == len((whole[0] / name).read_text().splitlines())


def test_a_second_signal_ends_the_process_at_once(start, config_file, tmp_path):
    """In a generation that would take an hour."""
    folder = tmp_path / "run"
    process = start(
        *("train", "--config", config_file, "--out", folder, "--quiet"),
        *("--population.iterations", 10**7, "--steps", 10**12),
    )
    wait_for(folder / "checkpoints" / "00000", process)
    time.sleep(0.5)  # for the generation to begin
    process.send_signal(signal.SIGTERM)
    assert "stopping after this round; once more to stop at once" in process.stderr.readline()
    process.send_signal(signal.SIGTERM)
    process.communicate(timeout=60)
    assert process.returncode == 143
    with resume(folder).folder as again:
        assert stored_generations(again.path / "checkpoints") == [0]


def test_six_generations_are_three_and_three_more(small_config, tmp_path):
    longer = small_config.replace(steps=4 * 3 * 16 * 20)
    six = train(tmp_path / "six", longer)
    three = train(tmp_path / "three", longer, events=1 + 1 + 2 * 3)
    go_on(three)
    assert len(outcome(six)[3]) == 1 + 6
    assert outcome(three) == outcome(six)


def test_memory_is_flat_over_fifty_generations(small_config, tmp_path, monkeypatch):
    """Where all policies are equally good: an archive that grows takes memory, and so do its checkpoints."""
    monkeypatch.setitem(envs.registry, OneStep.id, OneStep)
    config = small_config.replace(env=OneStep.id, user="A", steps=4 * 3 * 16 * 3 * 60, method="pgmorl")
    writer = CheckpointWriter(tmp_path, "run", 2, make_method(config, envs.make(config.env)))
    used = []
    for event in itertools.islice(run(config), 62):
        if isinstance(event, GenerationFinished):
            writer.save(event.state, {})
            writer.wait()
            used.append(resident_bytes())
    writer.close()
    assert len(event.state.archive.members) < 10
    assert used[60] - used[10] < 10e6


def resident_bytes():
    """The memory of this process, without what the allocator has free and keeps."""
    ctypes.CDLL(None).malloc_trim(0)
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()

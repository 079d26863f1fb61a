"""JAX's set-up, in processes of its own where it has to come first."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from jmorl.learning.devices import cache_folder, usable_cores


def printed_by(program):
    environment = {name: value for name, value in os.environ.items() if not name.startswith("JAX_")}
    command = [sys.executable, "-c", program]
    return subprocess.run(command, capture_output=True, text=True, check=True, env=environment).stdout.split()


def test_every_core_becomes_a_device():
    program = "import jax, jmorl; jmorl.use_all_cpu_cores(); print(jax.device_count())"
    assert printed_by(program) == [str(usable_cores())]


def test_a_program_that_has_used_jax_keeps_its_devices_and_gets_the_cache():
    program = (
        "import os\nos.sched_getaffinity = lambda process: range(7)\n"
        "import jax, jmorl\nbefore = jax.device_count()\njmorl.use_all_cpu_cores()\n"
        "print(before, jax.device_count(), jax.config.jax_compilation_cache_dir)"
    )
    before, after, cache = printed_by(program)
    assert before == after == "1" and cache.endswith("jax")


def test_where_the_system_does_not_say_all_cores_of_the_machine_are_used(monkeypatch):
    monkeypatch.delattr(os, "sched_getaffinity")
    monkeypatch.setattr(os, "cpu_count", lambda: 12)
    assert usable_cores() == 12
    monkeypatch.setattr(os, "cpu_count", lambda: None)
    assert usable_cores() == 1


@pytest.fixture
def home(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    return tmp_path


def test_compiled_programs_are_kept_in_the_users_folder_for_caches(home, monkeypatch):
    assert cache_folder() == home / ".cache" / "jmorl" / "jax" and cache_folder().is_dir()
    monkeypatch.setenv("XDG_CACHE_HOME", str(home / "other"))
    assert cache_folder() == home / "other" / "jmorl" / "jax"


@pytest.mark.parametrize("ignored", ["", "relative/folder"])
def test_a_cache_folder_that_is_no_absolute_path_is_ignored(home, monkeypatch, ignored):
    monkeypatch.setenv("XDG_CACHE_HOME", ignored)
    assert cache_folder() == home / ".cache" / "jmorl" / "jax"


def test_without_a_place_for_it_there_is_no_cache(home, monkeypatch):
    (home / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(home / "file"))
    assert cache_folder() is None

    def no_home():
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setattr(Path, "home", no_home)
    assert cache_folder() is None


def test_a_cache_folder_that_may_not_be_written_is_not_used(home, monkeypatch):
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    assert cache_folder() is None


@pytest.mark.parametrize(
    ("variable", "value"),
    [("JAX_PLATFORMS", "nonsense"), ("JAX_NUM_CPU_DEVICES", "0"), ("JAX_NUM_CPU_DEVICES", "abc")],
)
def test_a_jax_that_cannot_work_is_said_and_nothing_is_made(variable, value, tmp_path):
    environment = {**os.environ, variable: value}
    command = [sys.executable, "-m", "jmorl", "train", "--out", str(tmp_path / "run")]
    ended = subprocess.run(command, capture_output=True, text=True, env=environment)
    assert ended.returncode == 2
    (line,) = ended.stderr.splitlines()
    assert line.startswith("jmorl: JAX cannot ") and value in line
    assert not (tmp_path / "run").exists()

"""A folder is made once, for one environment, and what it is for is decided before anything is in it."""

import shutil
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

import envs
from envs import NotAsDeclared
from envs.checks import check_same
from jmorl.storage import run_folder
from jmorl.storage.layout import Layout
from jmorl.storage.lock import FolderInUse, RunLock
from jmorl.storage.manifest import read_manifest
from jmorl.storage.run_folder import RunFolder
from tests.probes import Compromise, ThreeWays

CREATE = """
import sys
from pathlib import Path
import envs, tests.registered
from jmorl.config import resolve
from jmorl.storage.lock import FolderInUse
from jmorl.storage.run_folder import RunFolder
config = resolve(file=Path(sys.argv[1]))
environment = envs.make(config.env)
print("ready", flush=True)
sys.stdin.readline()
try:
    folder = RunFolder.create(Path(sys.argv[2]), config, environment)
    print(folder.manifest["run"], flush=True)
    folder.close()
except FolderInUse as error:
    print(error, flush=True)
"""


def test_of_several_processes_that_make_a_folder_one_succeeds(small_config, tmp_path):
    (tmp_path / "config.toml").write_text(small_config.to_toml())
    command = [sys.executable, "-c", CREATE, str(tmp_path / "config.toml"), str(tmp_path / "run")]
    processes = [subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) for _ in range(4)]
    for process in processes:
        assert process.stdout.readline() == "ready\n"
    for process in processes:
        process.stdin.write("\n")
        process.stdin.flush()
    said = [process.communicate()[0] for process in processes]
    refused = [each for each in said if "is being written by" in each or "holds a run that has not ended" in each]
    made = [each.strip() for each in said if each not in refused]
    assert len(refused) == 3
    assert made == [read_manifest(tmp_path / "run")["run"]]


def test_a_run_made_and_left_by_another_process_in_the_meantime_is_not_overwritten(small_config, tmp_path, monkeypatch):
    """Between looking at the folder and locking it."""
    environment, made = envs.make(small_config.env), []

    def late(path):
        if not made:
            made.append(None)
            with RunFolder.create(path, small_config, environment) as other:
                made.append(other.manifest["run"])
        return RunLock(path)

    monkeypatch.setattr(run_folder, "RunLock", late)
    with pytest.raises(FolderInUse, match="holds a run that has not ended"):
        RunFolder.create(tmp_path / "run", small_config, environment)
    assert read_manifest(tmp_path / "run")["run"] == made[1]
    assert not Layout(tmp_path / "run").lock.exists()


class Wider(ThreeWays):
    observation_size = 3


class Longer(ThreeWays):
    time_limit = 7


class Unregistered(ThreeWays):
    id = "nobody-knows-it"


@pytest.mark.parametrize(
    ("other", "message"),
    [
        (
            Compromise(),
            "environment .* is not probe-three-ways, which the config names: objectives is .*action_size is 1",
        ),
        (Longer(), "time_limit is 7, not 10"),
        (Unregistered(), "id is 'nobody-knows-it', not 'probe-three-ways'; name the one .* register it first"),
    ],
)
def test_an_environment_that_the_config_does_not_name_is_refused_and_nothing_made(
    small_config, tmp_path, other, message
):
    with pytest.raises(NotAsDeclared, match=message):
        RunFolder.create(tmp_path / "run", small_config, other)
    assert not list(tmp_path.iterdir())


def test_another_observation_is_another_environment():
    with pytest.raises(NotAsDeclared, match="observation_size is 3, not 2"):
        check_same(Wider(), ThreeWays(), "probe-three-ways")


def test_an_object_of_a_programs_own_will_do_if_it_declares_the_same(small_config, tmp_path):
    """It may be of another class with the same id, or of the same class by another name."""

    class Watched(ThreeWays):
        pass

    renamed = ThreeWays()
    renamed.id = "mine"
    for name, environment in (("watched", Watched()), ("renamed", renamed)):
        RunFolder.create(tmp_path / name, small_config, environment).close()


@pytest.mark.parametrize("interrupted_at", range(1, 6))
def test_a_run_that_is_being_overwritten_can_be_begun_or_resumed_at_any_moment(
    whole, small_config, tmp_path, monkeypatch, interrupted_at
):
    """Whatever is deleted of it when its process is killed, it counts as one that has not ended, or not begun."""
    path = shutil.copytree(whole, tmp_path / "run")
    remove, calls = run_folder.remove, []

    def killed(each):
        calls.append(each)
        if len(calls) == interrupted_at:
            raise KeyboardInterrupt
        remove(each)

    with monkeypatch.context() as patch:
        patch.setattr(run_folder, "remove", killed)
        with pytest.raises(KeyboardInterrupt):
            RunFolder.create(path, small_config, envs.make(small_config.env), force=True)
    layout = Layout(path)
    assert layout.manifest.exists() and layout.config.exists() and not layout.result.exists()
    RunFolder.create(path, small_config, envs.make(small_config.env), force=True).close()


def test_runs_that_begin_in_the_same_second_get_the_next_free_names(tmp_path, monkeypatch, small_config):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(time, "strftime", lambda *_: "20260101-120000")
    environment = envs.make(small_config.env)

    def create(_):
        with RunFolder.create(None, small_config, environment) as folder:
            return str(folder.path)

    with ThreadPoolExecutor(4) as pool:
        made = sorted(pool.map(create, range(4)))
    assert made == ["runs/20260101-120000", *(f"runs/20260101-120000-{number}" for number in (2, 3, 4))]
    assert all((tmp_path / path / "manifest.json").exists() for path in made)


def test_bad_input_reserves_no_name(tmp_path, monkeypatch, small_config):
    monkeypatch.chdir(tmp_path)

    class Short(ThreeWays):
        def transition(self, state, action):
            result = super().transition(state, action)
            return result._replace(reward=result.reward[:2])

    with pytest.raises(NotAsDeclared, match="reward has shape"):
        RunFolder.create(None, small_config, Short())
    assert not list(tmp_path.iterdir())

"""A branch shares its parent's past and goes its own way."""

import json
import shutil
from dataclasses import replace

import jax.numpy as jnp
import pytest

import envs
from jmorl.config import ConfigError
from jmorl.storage.layout import Layout
from jmorl.storage.lock import FolderInUse
from jmorl.storage.policy_file import load_policy
from jmorl.storage.resume import CannotContinue, branch, resume
from tests.probes import ThreeWays
from tests.resuming import Counting, follow, go_on, outcome, timeless, train


def test_a_branch_shares_the_past_and_decides_for_itself(whole, tmp_path):
    continued = branch(whole, 1, tmp_path / "new", "weights=0,0,1")
    path = follow(continued)
    decisions = [(folder / "decisions.jsonl").read_text().splitlines() for folder in (whole, path)]
    assert decisions[0][0] == decisions[1][0] and len(decisions[1]) == 4
    assert decisions[0][1:] != decisions[1][1:]
    for name, rows in (("policies.csv", 8), ("metrics.csv", 2)):
        lines = [(folder / name).read_bytes().splitlines() for folder in (whole, path)]
        assert lines[0][: rows + 1] == lines[1][: rows + 1] and lines[0] != lines[1]
    manifest = json.loads((path / "manifest.json").read_text())
    parent = json.loads((whole / "manifest.json").read_text())["run"]
    assert manifest["parent"] == {"run": parent, "name": "whole", "generation": 1, "another_user": True}
    assert manifest["run"] != parent


def test_a_branch_with_the_same_user_ends_the_same_even_if_it_is_resumed(whole, tmp_path):
    continued = branch(whole, 1, tmp_path / "new")
    path = follow(continued, events=3)
    go_on(path)
    (path / "checkpoints" / "00000").symlink_to(whole / "checkpoints" / "00000")  # a branch has none before its own
    assert outcome(path)[1:] == outcome(whole)[1:]


def test_a_branch_asks_at_once(whole, small_config, tmp_path):
    class Silent(Counting):
        def answer(self, question):
            return replace(super().answer(question), generations=3)

    path = train(tmp_path / "run", small_config, user=Silent(small_config))
    continued = branch(path, 1, tmp_path / "new")
    user = Counting(small_config)
    follow(continued, user=user)
    assert user.asked[0] == ("steer", 2)


def test_a_branch_at_the_end_goes_on_with_more_steps(whole, small_config, tmp_path):
    before = outcome(whole)
    each = small_config.population.iterations * small_config.steps_per_iteration
    path = follow(branch(whole, 3, tmp_path / "longer", steps=small_config.steps + 2 * each))
    metrics = [timeless((folder / "metrics.csv").read_text()) for folder in (whole, path)]
    assert metrics[1][: len(metrics[0])] == metrics[0] and len(metrics[1]) == len(metrics[0]) + 2
    assert outcome(whole) == before


@pytest.mark.parametrize(
    ("how", "error", "message"),
    [
        ({"generation": 3, "steps": 2000}, CannotContinue, "had used 2112 steps by then; give the branch more"),
        ({"generation": 9}, CannotContinue, "has no checkpoint of round 9, only of: 0, 1, 2, 3"),
        ({"out": "used"}, FolderInUse, "used is not empty, and not a run"),
    ],
)
def test_a_branch_that_cannot_be_made_says_why_and_makes_nothing(whole, tmp_path, how, error, message):
    (tmp_path / "used").mkdir()
    (tmp_path / "used" / "letter").touch()
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(error, match=message):
        branch(whole, how.get("generation", 1), tmp_path / how.get("out", "new"), steps=how.get("steps"))
    assert sorted(tmp_path.rglob("*")) == before


def test_a_branch_whose_script_cannot_be_read_is_not_made(whole, tmp_path):
    (tmp_path / "broken.jsonl").write_text("{")
    for script, message in (("broken.jsonl", "line 1 is not valid JSON"), ("gone.jsonl", "there is no decision log")):
        with pytest.raises(ConfigError, match=f"^user: .*{message}"):
            branch(whole, 1, tmp_path / "new", f"script={tmp_path / script}")
    assert not (tmp_path / "new").exists()


def test_a_damaged_policy_file_is_written_into_a_branch_from_the_checkpoint_or_left_out(whole, tmp_path):
    copy = Layout(shutil.copytree(whole, tmp_path / "copy"))
    sound = branch(copy.root, 1, tmp_path / "sound").folder
    sound.close()
    for file in copy.policy_files.iterdir():
        file.write_bytes(file.read_bytes()[:-100])
    continued = branch(copy.root, 1, tmp_path / "new")
    continued.folder.close()
    files = {file.name for file in sound.layout.policy_files.iterdir()}
    assert {file.name for file in continued.folder.layout.policy_files.iterdir()} == files
    for name in files:
        load_policy(continued.folder.layout.policy_files / name)
        assert f"{copy.policy_files / name} was damaged, and is written again from the checkpoint" in continued.notes
    assert len(continued.notes) == len(files)


def test_a_checkpoint_of_another_run_is_not_branched_off(whole, small_config, tmp_path):
    other = train(tmp_path / "other", small_config.replace(seed=2), events=2)
    copy = shutil.copytree(whole, tmp_path / "copy")
    shutil.rmtree(copy / "checkpoints")
    shutil.copytree(other / "checkpoints", copy / "checkpoints")
    with pytest.raises(CannotContinue, match="00000 belongs to another run; branch off another round"):
        branch(copy, 0, tmp_path / "new")
    assert not (tmp_path / "new").exists()


def test_a_checkpoint_that_does_not_fit_its_environment_is_not_branched_off(whole, tmp_path, monkeypatch):
    class Wider(ThreeWays):
        observation_size = 3

        def observe(self, state):
            return jnp.append(state, 0.0)

    monkeypatch.setitem(envs.registry, ThreeWays.id, Wider)
    with pytest.raises(CannotContinue, match="00001 does not fit this jmorl: it has train states of another shape"):
        branch(whole, 1, tmp_path / "new")
    assert not (tmp_path / "new").exists()


def test_a_branch_never_overwrites_its_parent(whole):
    with pytest.raises(FolderInUse, match="holds the run that is branched off"):
        branch(whole, 1, whole, force=True)
    assert (whole / "policies.csv").exists()


def test_a_branch_without_a_checkpoint_does_not_begin_as_another_run(whole, tmp_path):
    branch(whole, 1, tmp_path / "new").folder.close()
    shutil.rmtree(tmp_path / "new" / "checkpoints")
    with pytest.raises(CannotContinue, match="branch off whole again"):
        resume(tmp_path / "new")

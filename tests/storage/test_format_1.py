"""Runs that the first version wrote are shown, exported, resumed and branched off today."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from jmorl.cli import main
from jmorl.storage.layout import Layout
from jmorl.storage.policy_file import load_policy
from jmorl.storage.resume import branch, resume
from jmorl.storage.stored_run import read_run
from tests.resuming import follow

FORMAT_1 = Path(__file__).parent / "format_1"
KINDS = ("interactive", "pgmorl-paper-units")
CLOSE = {"rtol": 1e-3, "atol": 1e-3}  # another machine may have written them


@pytest.fixture
def stored(tmp_path):
    """A copy of a stored run."""
    return lambda name: shutil.copytree(FORMAT_1 / name, tmp_path / name)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("state", ["finished", "interrupted"])
def test_it_is_shown(stored, kind, state, capsys):
    path = stored(f"{kind}-{state}")
    assert main(["show", str(path)]) == 0
    printed = capsys.readouterr().out
    assert "mo-mountaincarcontinuous-v0" in printed and ("unfinished" in printed) == (state == "interrupted")
    run = read_run(path)
    assert [policy.id for policy in run.policies] == list(range(len(run.policies))) and len(run.policies) >= 4
    assert all(np.isfinite(policy.std).all() for policy in run.policies)  # its columns had another name
    assert Layout(path).plots.exists()


@pytest.mark.parametrize("kind", KINDS)
def test_a_policy_is_exported_and_acts(stored, tmp_path, kind):
    path = stored(f"{kind}-finished")
    assert main(["export", str(path), "--to", str(tmp_path / "policy.npz")]) == 0
    policy, run = load_policy(tmp_path / "policy.npz"), read_run(path)
    assert policy.header["id"] == run.chosen.id
    assert policy.header["std"] == pytest.approx(run.chosen.std) and "spread" not in policy.header
    assert policy(np.array([-0.5, 0.0])).shape == (1,)


@pytest.mark.parametrize("kind", KINDS)
def test_it_goes_on_from_its_checkpoint_and_ends_as_the_one_that_was_not_interrupted(stored, kind):
    path, whole = stored(f"{kind}-interrupted"), read_run(FORMAT_1 / f"{kind}-finished")
    continued = resume(path)
    assert continued.state.generation == max(map(int, (each.name for each in Layout(path).checkpoints.iterdir())))
    assert not [note for note in continued.notes if "damaged" in note]
    run = read_run(follow(continued))
    assert_similar(run, whole)
    assert "spread_time" not in Layout(path).policies.read_text()


@pytest.mark.parametrize("kind", KINDS)
def test_it_is_branched_off(stored, tmp_path, kind):
    """With the same user, so that the branch ends as its parent did."""
    path = stored(f"{kind}-finished")
    run = read_run(follow(branch(path, 1, tmp_path / "new")))
    assert_similar(run, read_run(path))
    manifest = json.loads(Layout(tmp_path / "new").manifest.read_text())
    assert manifest["parent"] == {"run": read_run(path).manifest["run"], "name": path.name, "generation": 1}


def assert_similar(run, whole):
    """Compare what two runs found."""
    assert run.result["reason"] == whole.result["reason"]
    assert run.result["chosen"]["policy"] == whole.result["chosen"]["policy"]
    for name in ("values", "std", "weights", "discounted"):
        found, expected = ([getattr(policy, name) for policy in each.policies] for each in (run, whole))
        np.testing.assert_allclose(found, expected, **CLOSE, err_msg=name)
    assert [policy.id for policy in run.front] == [policy.id for policy in whole.front]
    for name in ("steps", "hypervolume", "front_size"):
        np.testing.assert_allclose(run.metrics[name], whole.metrics[name], **CLOSE, err_msg=name)

"""A run that is broken off anywhere and resumed ends as the run that was left alone."""

import csv
import json
import os
import shutil
import sys

import pytest

import envs
from envs import NotAsDeclared
from jmorl.cli import main
from jmorl.events import Decided, GenerationFinished, RunFinished
from jmorl.loop import run
from jmorl.storage.layout import Layout
from jmorl.storage.lock import FolderInUse
from jmorl.storage.policy_file import load_policy
from jmorl.storage.resume import AlreadyFinished, CannotContinue, branch, resume
from jmorl.storage.run_folder import RunFolder
from jmorl.storage.stored_run import read_run
from jmorl.storage.versions import NewerFormat
from tests.probes import ThreeWays
from tests.resuming import Counting, follow, go_on, outcome, train

RESUME = sys.modules["jmorl.storage.resume"]


@pytest.fixture
def copy(whole, tmp_path):
    """A copy of it, without its end."""
    path = shutil.copytree(whole, tmp_path / "copy")
    (path / "result.json").unlink()
    return path


def test_the_uninterrupted_run_has_what_the_others_are_compared_by(whole):
    files, policies, _, metrics, _, reason = outcome(whole)
    assert reason == "budget" and len(metrics) == 4 and len(policies) >= 4
    assert {"chosen.npz", "checkpoints/00000/checkpoint.json", "checkpoints/00003/metrics.csv"} <= files
    assert not [name for name in files if "partial" in name or "lock" in name]


@pytest.mark.parametrize("events", range(10))
def test_a_run_broken_off_after_any_event_ends_the_same(whole, small_config, tmp_path, events):
    asked = [Counting(small_config), Counting(small_config)]
    path = train(tmp_path / "run", small_config, user=asked[0], events=events)
    go_on(path, user=asked[1])
    assert outcome(path) == outcome(whole)
    assert [*asked[0].asked, *asked[1].asked] == [("steer", 1), ("steer", 2), ("steer", 3), ("final", 4)]


@pytest.mark.parametrize("lost", [1, 2, 3, 4])
def test_logs_ahead_of_the_checkpoint_are_cut_back_and_answers_kept(whole, copy, small_config, lost):
    """As if the process had died before the last checkpoints were written."""
    for generation in range(4 - lost, 4):
        shutil.rmtree(copy / "checkpoints" / f"{generation:05d}")
    user = Counting(small_config)
    go_on(copy, user=user)
    assert outcome(copy) == outcome(whole)
    assert not user.asked


def test_what_a_killed_process_left_half_written_is_gone(whole, copy):
    for name in (".front.csv.partial", "policies/.00003.npz.partial", "plots/.front.png.partial"):
        (copy / name).parent.mkdir(exist_ok=True)
        (copy / name).write_text("half")
    shutil.copytree(copy / "checkpoints" / "00003", copy / "checkpoints" / ".00004.partial")
    shutil.copyfile(copy / "policies" / "00000.npz", copy / "policies" / "00099.npz")
    for name in ("metrics.csv", "policies.csv"):
        with (copy / name).open("a") as file:
            file.write("4,17")
    go_on(copy)
    shutil.rmtree(copy / "plots", ignore_errors=True)
    assert outcome(copy) == outcome(whole)


def damage(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 16
    path.write_bytes(content)


def test_the_checkpoint_before_a_damaged_one_is_used_and_both_are_named(whole, copy):
    for generation in (2, 3):
        damage(copy / "checkpoints" / f"{generation:05d}" / "policies.csv")
    _, notes = go_on(copy)
    assert len(notes) == 3
    assert "00003/policies.csv is damaged" in notes[0] and "00002/policies.csv is damaged" in notes[1]
    assert notes[2] == "the run goes on from round 1 instead"
    assert outcome(copy) == outcome(whole)


def test_a_run_whose_checkpoints_are_all_damaged_begins_anew_with_its_answers(whole, copy, small_config):
    for generation in range(4):
        damage(copy / "checkpoints" / f"{generation:05d}" / "checkpoint.json")
    user = Counting(small_config)
    _, notes = go_on(copy, user=user)
    assert len(notes) == 5 and "from the beginning" in notes[-1]
    assert outcome(copy) == outcome(whole)
    assert not user.asked


def test_a_checkpoint_of_another_run_is_not_taken(whole, copy, small_config, tmp_path):
    other = train(tmp_path / "other", small_config.replace(seed=2), events=2)
    shutil.rmtree(copy / "checkpoints")
    shutil.copytree(other / "checkpoints", copy / "checkpoints")
    _, notes = go_on(copy)
    assert "belongs to another run" in notes[0]
    assert outcome(copy) == outcome(whole)


def test_a_lost_policy_file_of_the_front_is_written_again(whole, copy):
    for file in (copy / "policies").iterdir():
        file.unlink()
    shutil.rmtree(copy / "checkpoints" / "00003")
    go_on(copy)
    rows = csv.DictReader((copy / "front.csv").read_text().splitlines())
    front = {f"{int(row['policy']):05d}.npz" for row in rows}
    before, after = outcome(whole)[1], outcome(copy)[1]
    assert front <= after.keys() and all(after[name] == before[name] for name in after)


def empty(path):
    path.write_bytes(b"")


def four_bytes_changed(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 3 : len(content) // 3 + 4] = b"ABCD"
    path.write_bytes(content)


def another(path):
    """A file that can be read, and is of another policy."""
    other = next(each for each in sorted(path.parent.iterdir()) if each != path)
    shutil.copyfile(other, path)


@pytest.mark.parametrize("spoil", [empty, four_bytes_changed, another])
def test_a_damaged_policy_file_is_named_and_written_again(whole, copy, spoil):
    chosen = json.loads((whole / "result.json").read_text())["chosen"]["policy"]
    damaged = Layout(copy).policy(chosen)
    spoil(damaged)
    _, notes = go_on(copy)
    assert notes == (f"{damaged} was damaged, and is written again from the checkpoint",)
    assert outcome(copy) == outcome(whole)
    assert same_network(Layout(copy).chosen, Layout(whole).chosen)


def same_network(one, other):
    layers = [[array.tobytes() for layer in load_policy(path).layers for array in layer] for path in (one, other)]
    return layers[0] == layers[1]


def test_a_damaged_policy_file_that_cannot_be_written_again_is_named(copy, tmp_path, monkeypatch):
    """As of a policy that neither archive nor buffer have any more; in runs as small as these they have all."""
    forgotten = max(Layout(copy).policy_files.iterdir())
    with_snapshots = RESUME._with_snapshots
    monkeypatch.setattr(
        RESUME,
        "_with_snapshots",
        lambda *arguments: [each for each in with_snapshots(*arguments) if each.id != int(forgotten.stem)],
    )
    note = f"{forgotten} is damaged, and the checkpoint does not have this policy any more"
    empty(forgotten)
    last = branch(copy, 3, tmp_path / "branch")
    last.folder.close()
    assert last.notes == (note,)
    continued = resume(copy)
    continued.folder.close()
    assert continued.notes == (note,) and forgotten.read_bytes() == b""


def test_what_is_sound_is_not_written_again(copy):
    before = {file: file.stat().st_mtime_ns for file in Layout(copy).policy_files.iterdir()}
    resume(copy).folder.close()
    assert {file: file.stat().st_mtime_ns for file in Layout(copy).policy_files.iterdir()} == before


def test_a_folder_may_be_moved_and_renamed(whole, copy, tmp_path):
    moved = tmp_path / "another place" / "with another name"
    moved.parent.mkdir()
    shutil.move(copy, moved)
    go_on(moved)
    assert outcome(moved) == outcome(whole)
    for file in moved.rglob("*"):
        assert not file.is_file() or str(tmp_path).encode() not in file.read_bytes(), file


def test_a_finished_run_has_nothing_to_resume(whole):
    before = outcome(whole)
    with pytest.raises(AlreadyFinished, match="has ended; there is nothing to resume"):
        resume(whole)
    assert outcome(whole) == before


def test_another_config_is_refused_and_nothing_changed(copy):
    before = {file: file.read_bytes() for file in copy.rglob("*") if file.is_file()}
    toml = copy / "config.toml"
    toml.write_text(toml.read_text().replace("seed = 1", "seed = 2"))
    with pytest.raises(CannotContinue, match=r"config.toml is not what run \w+ was started with .*restore it"):
        resume(copy)
    toml.write_bytes(before[toml])
    assert before == {file: file.read_bytes() for file in copy.rglob("*") if file.is_file()}


def test_another_number_of_devices_is_told_and_noted(copy):
    manifest = json.loads((copy / "manifest.json").read_text())
    manifest["device"]["count"] = 64
    manifest["packages"]["jax"] = "0.1"
    (copy / "manifest.json").write_text(json.dumps(manifest))
    _, notes = go_on(copy)
    assert len(notes) == 1
    assert "device count 64 is now 2" in notes[0] and "jax 0.1 is now" in notes[0]
    assert notes[0].endswith("from here on the run finds other policies than it would have found")
    noted = json.loads((copy / "manifest.json").read_text())
    assert noted["device"]["count"] == 64 and [each["device"]["count"] for each in noted["resumed"]] == [2]


def test_a_run_in_a_newer_format_is_refused_with_the_version_that_wrote_it(copy):
    manifest = json.loads((copy / "manifest.json").read_text())
    manifest["packages"]["jmorl"] = "7.0"
    (copy / "manifest.json").write_text(json.dumps(manifest | {"format": 99}))
    with pytest.raises(NewerFormat, match="has format 99, written by jmorl 7.0"):
        resume(copy)


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda path: shutil.rmtree(path), "is not a run folder: it has no manifest.json"),
        (lambda path: (path / "config.toml").unlink(), "has lost its config.toml; put it back"),
        (lambda path: (path / "manifest.json").write_text("{"), "cannot be read as a run"),
        (lambda path: (path / "config.toml").write_text('env = "nowhere"'), "cannot be used: env: "),
    ],
)
def test_a_folder_that_cannot_be_resumed_says_why(copy, spoil, message):
    spoil(copy)
    with pytest.raises(CannotContinue, match=message):
        resume(copy)


@pytest.mark.parametrize("left", [[], [".config.toml.partial"], ["run.lock"]])
def test_a_run_that_was_killed_before_it_had_a_config_can_be_begun(whole, small_config, tmp_path, left):
    """The one that cannot be resumed is one that `train` takes."""
    path = tmp_path / "run"
    path.mkdir()
    shutil.copyfile(whole / "manifest.json", path / "manifest.json")
    for name in left:
        (path / name).touch()
    with pytest.raises(CannotContinue, match="ended before it began; start it again with `jmorl train`"):
        resume(path)
    assert outcome(train(path, small_config))[1:] == outcome(whole)[1:]
    assert not (path / ".config.toml.partial").exists()


@pytest.mark.parametrize("content", ["[]", '{"name": "My page", "icons": []}'])
def test_a_manifest_of_something_else_is_not_overwritten(small_config, tmp_path, content):
    (tmp_path / "manifest.json").write_text(content)
    with pytest.raises(FolderInUse, match="choose another folder, or overwrite it with --force"):
        train(tmp_path, small_config)
    with pytest.raises(CannotContinue, match="start again with `jmorl train --force`"):
        resume(tmp_path)
    assert (tmp_path / "manifest.json").read_text() == content


def test_a_run_that_has_lost_its_config_is_not_overwritten(copy, small_config):
    (copy / "config.toml").unlink()
    with pytest.raises(FolderInUse, match="without its config.toml; put that back and continue the run"):
        train(copy, small_config)
    assert (copy / "policies.csv").exists()


def test_a_run_that_ends_while_another_process_takes_it_up_is_left_alone(copy, whole, monkeypatch):
    """Its result appears after it was looked for, and before it was locked."""
    lock = RESUME.RunLock

    def ended(path):
        shutil.copyfile(whole / "result.json", path / "result.json")
        return lock(path)

    monkeypatch.setattr(RESUME, "RunLock", ended)
    with pytest.raises(AlreadyFinished):
        resume(copy)
    assert outcome(copy) == outcome(whole)


@pytest.fixture
def scripted(whole, small_config, tmp_path):
    """What the whole run was, broken off before its last question; its user is a script that is gone."""
    script = shutil.copyfile(whole / "decisions.jsonl", tmp_path / "script.jsonl")
    path = train(tmp_path / "scripted", small_config.replace(user=f"script={script}"), events=8)
    script.unlink()
    return path


def contents(path):
    return {file: file.read_bytes() for file in path.rglob("*") if file.is_file()}


def test_a_run_whose_script_is_gone_says_so_and_stays_as_it_is(scripted):
    before = contents(scripted)
    with pytest.raises(CannotContinue, match=r"is decided by script=.*, but there is no decision log .*jmorl branch"):
        resume(scripted)
    assert contents(scripted) == before


def test_a_run_whose_script_is_gone_can_be_shown_and_branched_off(scripted, tmp_path):
    assert read_run(scripted).config.user.startswith("script=")
    path = follow(branch(scripted, 1, tmp_path / "new", "weights=0,0,1"))
    assert read_run(path).chosen


def test_a_run_whose_script_is_gone_goes_on_where_it_is_not_needed(scripted, whole, small_config):
    with resume(scripted, Counting(small_config)).folder:
        pass  # somebody else decides
    shutil.copyfile(whole / "decisions.jsonl", scripted / "decisions.jsonl")  # or everything is answered
    go_on(scripted)
    _, _, texts, _, chosen, reason = outcome(scripted)
    _, _, texts_before, _, chosen_before, reason_before = outcome(whole)
    assert (texts, chosen, reason) == (texts_before, chosen_before, reason_before)


def test_a_finished_run_whose_script_is_gone_has_ended_all_the_same(whole, small_config, tmp_path, capsys):
    script = shutil.copyfile(whole / "decisions.jsonl", tmp_path / "script.jsonl")
    path = train(tmp_path / "scripted", small_config.replace(user=f"script={script}"))
    script.unlink()
    assert main(["show", str(path)]) == main(["resume", str(path)]) == 0
    assert "nothing to resume" in "".join(capsys.readouterr())


def test_an_environment_that_has_become_another_is_refused_and_nothing_changed(copy, monkeypatch):
    class Short(ThreeWays):
        def transition(self, state, action):
            result = super().transition(state, action)
            return result._replace(reward=result.reward[:2])

    before = contents(copy)
    monkeypatch.setitem(envs.registry, ThreeWays.id, Short)
    with pytest.raises(NotAsDeclared, match="reward has shape"):
        resume(copy)
    assert contents(copy) == before


def test_a_run_of_before_actions_were_scaled_goes_on_only_where_that_changes_nothing(copy, tmp_path, monkeypatch):
    manifest = json.loads((copy / "manifest.json").read_text(encoding="utf-8"))
    (copy / "manifest.json").write_text(json.dumps(manifest | {"format": 1}), encoding="utf-8")
    branch(copy, 1, tmp_path / "branch").folder.close()
    resume(copy).folder.close()
    monkeypatch.setattr(ThreeWays, "action_high", 2.0)
    before = contents(copy)
    for go_on_with in (lambda: resume(copy), lambda: branch(copy, 1, tmp_path / "other")):
        with pytest.raises(CannotContinue, match="did not scale actions to the environment's bounds"):
            go_on_with()
    assert contents(copy) == before and not (tmp_path / "other").exists()


def test_a_run_is_resumed_by_one_process_at_a_time(copy):
    with resume(copy).folder, pytest.raises(FolderInUse, match=f"is being written by process {os.getpid()}"):
        resume(copy)
    assert not (copy / "run.lock").exists()


def test_a_run_is_not_overwritten_while_it_is_written(copy, small_config):
    environment = envs.make(small_config.env)
    with resume(copy).folder, pytest.raises(FolderInUse, match="is being written by process"):
        RunFolder.create(copy, small_config, environment, force=True)
    assert (copy / "policies.csv").exists()


def test_the_last_checkpoints_are_kept_and_the_answer_is_durable_before_training(small_config, tmp_path):
    config = small_config.replace(checkpoints={"keep": 2})
    folder = RunFolder.create(tmp_path / "run", config, envs.make(config.env))
    with folder:
        for event in run(config):
            folder.record(event)
            if isinstance(event, Decided):
                assert len((folder.path / "decisions.jsonl").read_text().splitlines()) == event.question.generation
            if isinstance(event, GenerationFinished):
                assert f"\n{event.state.generation}," in (folder.path / "metrics.csv").read_text()
    assert sorted(path.name for path in (folder.path / "checkpoints").iterdir()) == ["00002", "00003"]
    assert isinstance(event, RunFinished)

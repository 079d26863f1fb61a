"""Which runs there are below a folder, and what their small files say."""

import json
import os
import shutil
import time

import pytest

import envs
from jmorl.storage.lock import RunLock
from jmorl.storage.resume import branch
from jmorl.storage.run_folder import RunFolder
from jmorl.storage.stored_run import read_run
from jmorl.studio import home as module
from jmorl.studio.home import Home, is_run


@pytest.fixture
def runs(whole, tmp_path):
    """Copy a run that has ended into a folder of a folder, and make a branch of it beside other folders."""
    shutil.copytree(whole, tmp_path / "study" / "work" / "ended")
    branch(tmp_path / "study" / "work" / "ended", 2, tmp_path / "branch", user="terminal").folder.close()
    (tmp_path / "empty").mkdir()
    (tmp_path / "file").touch()
    return tmp_path


def by_name(folder, ours=()):
    return {run.name: run for run in Home(folder).runs(ours)}


def test_runs_are_found_in_folders_of_folders_with_what_is_known_of_them(runs, whole, small_config):
    found = by_name(runs)
    assert found.keys() == {"study/work/ended", "branch"}
    ended, left = found["study/work/ended"], found["branch"]
    assert (ended.state, left.state, ended.why) == ("finished", "interrupted", "")
    stored = read_run(whole)
    facts = ended.facts
    assert (facts.env, facts.method, facts.user) == (small_config.env, small_config.method, small_config.user)
    assert (facts.rounds, facts.steps, facts.budget) == (3, stored.metrics["steps"][-1], small_config.steps)
    assert facts.scores == tuple(zip(("north", "east", "west"), stored.chosen.values, strict=True))
    assert (left.facts.user, left.facts.rounds, left.facts.scores) == ("terminal", 2, ())
    assert (left.facts.origin.name, left.facts.origin.generation) == ("study/work/ended", 2)
    assert abs(left.written - time.time()) < 60


def test_what_is_no_run_is_not_looked_into_for_ever(runs, whole):
    shutil.copytree(whole, runs / "a" / "b" / "c" / "too-deep")
    shutil.copytree(whole, runs / ".hidden")
    (runs / "link").symlink_to(whole)
    (runs / "round").symlink_to(runs)
    assert by_name(runs).keys() == {"study/work/ended", "branch"}
    assert Home(runs / "nowhere").runs() == () and Home(runs / "empty").runs() == ()
    assert is_run(runs / "branch") and not is_run(runs) and not is_run(runs / "nowhere")


def test_what_is_written_now_comes_first_then_what_was_written_last(runs, whole):
    for age, name in ((50, "old"), (20, "newer")):
        shutil.copytree(whole, runs / name)
        for file in (runs / name).iterdir():
            os.utime(file, (time.time(), time.time() - age))
    names = [run.name for run in Home(runs).runs()]
    assert names.index("branch") < names.index("newer") < names.index("old")
    lock = RunLock(runs / "old")
    listed = Home(runs).runs()
    assert listed[0].name == "old" and listed[0].state == "elsewhere"
    assert listed[0].why.startswith(f"old is being written by process {os.getpid()}")
    ours = Home(runs).runs([(runs / "old").resolve()])
    assert ours[0].name == "old" and (ours[0].state, ours[0].why) == ("finished", "")
    lock.release()
    assert Home(runs).runs()[0].name != "old"


def test_files_are_read_again_only_when_they_have_changed(runs, monkeypatch):
    read, home = [], Home(runs)
    facts = module._facts
    monkeypatch.setattr(module, "_facts", lambda path: read.append(path.name) or facts(path))
    before = home.runs()
    assert home.runs() == before and sorted(read) == ["branch", "ended"]
    lines = (runs / "branch" / "metrics.csv").read_bytes()
    (runs / "branch" / "metrics.csv").write_bytes(lines + lines.splitlines(keepends=True)[-1].replace(b"2,", b"3,", 1))
    changed = {run.name: run for run in home.runs()}
    assert read[2:] == ["branch"] and changed["branch"].facts.rounds == 3
    shutil.rmtree(runs / "branch")
    assert [run.name for run in home.runs()] == ["study/work/ended"] and len(read) == 3


def test_a_run_that_has_just_begun_and_a_line_that_is_just_written_are_no_damage(runs, small_config, tmp_path):
    with RunFolder.create(tmp_path / "new", small_config, envs.make(small_config.env)):
        new = by_name(tmp_path, [tmp_path / "new"])["new"]
    assert (new.state, new.facts.rounds, new.facts.steps) == ("interrupted", None, 0)
    with (runs / "branch" / "metrics.csv").open("ab") as file:
        file.write(b"3,99")
    assert by_name(runs)["branch"].facts.rounds == 2


def _without_chosen(result):
    return json.dumps({"reason": "budget", "chosen": {"policy": 1}})


@pytest.mark.parametrize(
    ("file", "change", "reason"),
    [
        ("manifest.json", lambda text: text[:40], "manifest.json is not valid JSON"),
        ("manifest.json", lambda text: text.replace('"format": 2', '"format": 99'), "written by jmorl"),
        ("manifest.json", lambda text: None, "No such file or directory: manifest.json"),
        ("manifest.json", lambda text: "[" * 100_000, "manifest.json"),
        ("config.toml", lambda text: "env = [", "Invalid value"),
        ("config.toml", lambda text: text.replace("steps = ", "steps = -"), "config.toml is damaged: steps"),
        ("config.toml", lambda text: "a = " + "[" * 100_000, ""),
        ("config.toml", lambda text: None, "No such file or directory: config.toml"),
        (
            "metrics.csv",
            lambda text: text.replace("\n3,", "\nx,"),
            "no number in the last row of its column generation",
        ),
        (
            "metrics.csv",
            lambda text: text.replace("steps", "stops", 1),
            "no number in the last row of its column steps",
        ),
        ("metrics.csv", lambda text: text.replace("\n1,", "\n1\n1,"), "line 3 ends too early"),
        ("result.json", lambda text: "{}", "result.json is damaged: reason is missing"),
        ("result.json", _without_chosen, "result.json has no scores of the result"),
        ("result.json", lambda text: text.replace('"value_east": -', '"value_east": -Infinity, "x": '), "not finite"),
        ("result.json", lambda text: text.replace('"value_east": -', '"value_east": null, "x": '), "not finite"),
    ],
)
def test_damage_is_told_and_hides_no_other_run(runs, file, change, reason):
    path = runs / "study" / "work" / "ended" / file
    text = change(path.read_bytes().decode())
    path.unlink()
    if text is not None:
        path.write_bytes(text.encode())
    found = by_name(runs)
    ended = found["study/work/ended"]
    assert (ended.state, ended.facts) == ("damaged", None) and reason in ended.why and str(runs) not in ended.why
    assert found["branch"].state == "interrupted"


def test_of_copies_a_branch_leaves_the_one_that_has_kept_its_name(runs):
    shutil.copytree(runs / "study" / "work" / "ended", runs / "a-copy")
    assert by_name(runs)["branch"].facts.origin.name == "study/work/ended"
    (runs / "study" / "work" / "ended").rename(runs / "renamed")
    assert by_name(runs)["branch"].facts.origin.name in ("renamed", "a-copy")
    shutil.rmtree(runs / "renamed")
    shutil.rmtree(runs / "a-copy")
    assert by_name(runs)["branch"].facts.origin.name == "ended"


def test_a_name_that_is_no_text_is_listed_with_escapes(whole, tmp_path):
    name = os.fsdecode(b"caf\xe9")
    shutil.copytree(whole, tmp_path / name)
    assert by_name(tmp_path)["caf\\xe9"].path == tmp_path.resolve() / name


def test_runs_of_format_1_are_listed(tmp_path):
    stored = "tests/storage/format_1"
    found = by_name(shutil.copytree(stored, tmp_path / "old"))
    assert {name: run.state for name, run in found.items()} == {
        "interactive-finished": "finished",
        "interactive-interrupted": "interrupted",
        "pgmorl-paper-units-finished": "finished",
        "pgmorl-paper-units-interrupted": "interrupted",
    }


def test_a_thousand_runs_are_listed_again_in_well_under_a_second(whole, tmp_path):
    small = ("manifest.json", "config.toml", "metrics.csv", "result.json", "decisions.jsonl")
    for number in range(1000):
        place = tmp_path / f"study-{number % 7}" / f"run-{number}"
        place.mkdir(parents=True)
        for file in small:
            os.link(whole / file, place / file)
    home = Home(tmp_path)
    assert len(home.runs()) == 1000
    started = time.process_time()
    assert len(home.runs()) == 1000
    assert time.process_time() - started < 0.5

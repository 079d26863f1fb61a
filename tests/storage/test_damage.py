"""Whatever has happened to a file of a run, a command says so in one sentence, or does without the file."""

import hashlib
import json
import shutil

import numpy as np
import pytest

from jmorl.cli import main
from jmorl.report.plots import draw_run
from jmorl.storage.csv_log import csv_text, read_rows
from jmorl.storage.layout import CheckpointLayout, Layout, checkpoint_path
from jmorl.storage.policy_file import load_policy
from jmorl.storage.stored_run import StoredRunError, read_run
from tests.registered import ThreeWays

DAMAGES = {
    "empty": lambda content: b"",
    "list": lambda content: b"[]",
    "null": lambda content: b"null",
    "binary": lambda content: bytes(range(256)) * 8,
    "cut": lambda content: content[: len(content) // 2],
}
RUN = ("show", "enautilus", "resume", "branch")
POLICY = ("export", "evaluate")
READ = {  # file -> the commands that cannot do without it
    "manifest": RUN,
    "config": RUN,
    "metrics": ("show", "enautilus"),
    "policies": ("show", "enautilus"),
    "front": ("show", "enautilus"),
    "decisions": ("show", "enautilus"),
    "result": ("show", "enautilus"),
    "chosen": POLICY,
}
HARMLESS = {("decisions", "empty")}


@pytest.fixture(autouse=True)
def _no_plots(monkeypatch):
    """They show no more than the tables, and take seconds each; a test below draws them."""
    monkeypatch.setattr("jmorl.report.plots.draw_run", lambda run, folder: [])


@pytest.fixture(scope="module")
def started_here(small_config, tmp_path_factory):
    """A run whose config names the module of its environment, as one from the command line does."""
    folder = tmp_path_factory.mktemp("runs")
    config = folder / "config.toml"
    config.write_text(small_config.replace(env=f"tests.registered:{ThreeWays.id}").to_toml())
    assert main(["train", "--config", str(config), "--out", str(folder / "run"), "--quiet"]) == 0
    return folder / "run"


@pytest.fixture
def run(started_here, tmp_path):
    return Layout(shutil.copytree(started_here, tmp_path / "run"))


def said_by(command, layout, capsys):
    """Exit code and errors of a command. What is resumed has not ended."""
    place = str(layout.root)
    arguments = {
        "show": [place],
        "enautilus": [place, "--user", "weights=1,0,0"],
        "resume": [place, "--quiet"],
        "branch": [place, "--generation", "3", "--out", str(layout.root.with_name("branch")), "--quiet"],
        "export": [place, "--to", str(layout.root.with_name("policy.npz"))],
        "evaluate": [place, "--episodes", "2"],
    }[command]
    if command == "resume":
        layout.result.unlink(missing_ok=True)
    capsys.readouterr()
    code = main([command, *arguments])
    return code, capsys.readouterr().err


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize("file", READ)
def test_a_command_that_needs_a_damaged_file_names_it_and_the_others_work(run, capsys, file, damage):
    path = getattr(run, file)
    path.write_bytes(DAMAGES[damage](path.read_bytes()))
    for command in (*(POLICY if file == "chosen" else ()), *RUN):
        code, errors = said_by(command, run, capsys)
        if command in READ[file] and (file, damage) not in HARMLESS:
            assert code == 2 and str(path) in errors and errors.count("\n") == 1, (command, code, errors)
        else:
            assert code == 0, (command, errors)


def test_a_damaged_policy_of_the_result_does_not_become_the_result(run, capsys):
    """The file of a policy is not what the choice is copied from."""
    chosen = load_policy(run.chosen)
    run.policy(chosen.header["id"]).write_bytes(b"")
    assert said_by("resume", run, capsys)[0] == 0
    assert load_policy(run.chosen).layers[0][0].tobytes() == chosen.layers[0][0].tobytes()


def without(name):
    return lambda manifest: manifest.pop(name)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (without("format"), "format is missing"),
        (lambda manifest: manifest.update(format="1"), "format: '1' is not a whole number"),
        (without("run"), "run is missing"),
        (without("packages"), "packages is missing"),
        (lambda manifest: manifest.update(packages=[]), "packages: input should be a valid dictionary"),
        (lambda manifest: manifest.update(run=3, resumed=None), "run: input should be a valid string; resumed: "),
        (lambda manifest: manifest.update(parent={"run": "x"}), "parent.name is missing; parent.generation is missing"),
        (lambda manifest: manifest["device"].update(count="two"), "device.count: input should be a valid integer"),
    ],
)
def test_a_manifest_with_other_fields_is_refused_with_all_that_is_wrong(run, capsys, change, message):
    manifest = json.loads(run.manifest.read_text())
    change(manifest)
    run.manifest.write_text(json.dumps(manifest))
    for command in RUN:
        code, errors = said_by(command, run, capsys)
        assert code == 2 and message in errors and str(run.manifest) in errors and errors.count("\n") == 1, errors


def test_a_manifest_may_have_more_fields(run, capsys):
    manifest = json.loads(run.manifest.read_text()) | {"mood": "good"}
    run.manifest.write_text(json.dumps(manifest))
    assert said_by("show", run, capsys)[0] == said_by("resume", run, capsys)[0] == 0
    assert json.loads(run.manifest.read_text())["mood"] == "good"


def changed_checkpoint(run, change):
    """The last checkpoint with another document, whose digest is right; its folder."""
    place = CheckpointLayout(checkpoint_path(run.checkpoints, 3))
    document = json.loads(place.document.read_text().splitlines()[0])
    change(document)
    line = json.dumps(document) + "\n"
    place.document.write_text(line + hashlib.sha256(line.encode()).hexdigest() + "\n")
    return place


@pytest.mark.parametrize(
    "change",
    [
        lambda document: document.pop("state"),
        lambda document: document.update(state=[]),
        lambda document: document.update(files=None),
        lambda document: document.update(logs=["metrics.csv", "nowhere.csv"]),
        lambda document: document.update(generation=2),
    ],
)
def test_a_checkpoint_with_a_valid_digest_and_odd_content_is_passed_over_and_named(run, capsys, change):
    place = changed_checkpoint(run, change)
    code, errors = said_by("branch", run, capsys)
    assert code == 2 and str(place.root) in errors and errors.count("\n") == 1
    code, errors = said_by("resume", run, capsys)
    assert code == 0 and str(place.root) in errors and "goes on from round 2 instead" in errors


# What Orbax was about to do when it failed may come to its end later, without its event loop.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_checkpoint_that_orbax_cannot_read_is_passed_over_and_named(run, capsys):
    place = changed_checkpoint(run, lambda document: document["files"].clear())
    place.arrays.joinpath("manifest.ocdbt").unlink()
    code, errors = said_by("resume", run, capsys)
    assert code == 0 and f"{place.root} is damaged: " in errors and "goes on from round 2 instead" in errors


@pytest.mark.parametrize(
    "change",
    [
        lambda state: state.clear(),
        lambda state: state["counters"].update(policies="many"),
        lambda state: state["counters"].update(generation=7),
        lambda state: state.update(archive=[10**9]),
        lambda state: state["policies"].clear(),
    ],
)
def test_a_state_that_is_not_understood_is_refused_and_nothing_changed(run, capsys, change):
    """It is as it was written: another version may understand it, and would miss what is deleted."""
    place = changed_checkpoint(run, lambda document: change(document["state"]))
    for command in ("branch", "resume"):
        before = {file: file.read_bytes() for file in run.root.rglob("*") if file.is_file() and file != run.result}
        code, errors = said_by(command, run, capsys)
        assert code == 2 and f"{place.root} does not fit this jmorl: " in errors and errors.count("\n") == 1
        assert {file: file.read_bytes() for file in before} == before


@pytest.mark.parametrize("what", ["a file", "a folder without anything"])
def test_what_is_no_checkpoint_at_all_is_passed_over(run, capsys, what):
    place = checkpoint_path(run.checkpoints, 3)
    shutil.rmtree(place)
    place.touch() if what == "a file" else place.mkdir()
    assert said_by("branch", run, capsys)[0] == 2
    code, errors = said_by("resume", run, capsys)
    assert code == 0 and "goes on from round 2 instead" in errors


@pytest.mark.parametrize(
    ("file", "change", "message"),
    [
        ("metrics", lambda lines: lines[:-1], "metrics.csv ends before .*policies.csv"),
        ("metrics", lambda lines: lines[:1], "generations are not 0, 1, 2"),
        ("metrics", lambda lines: [line.partition(",")[2] for line in lines], "generations are not 0, 1, 2"),
        ("policies", lambda lines: lines[:-1], "names a policy that|has no 1"),
        ("policies", lambda lines: [lines[0], *lines[2:]], "policies are not 0, 1, 2"),
        ("policies", lambda lines: [lines[0], lines[1].replace("0,", "-1,", 1), *lines[2:]], "is not a whole number"),
        ("front", lambda lines: lines[:1], "front.csv has no policy"),
        (
            "front",
            lambda lines: [lines[0], "999" + "," * lines[0].count(",")],
            "front.csv cannot be read: it has no 999",
        ),
        ("decisions", lambda lines: [lines[0].replace('"policy": ', '"policy": 999', 1)], "names a policy that"),
        ("decisions", lambda lines: [lines[0].replace('"values": [', '"values": [0.0, ', 1)], "one for each of 3"),
        ("result", lambda lines: [line.replace("budget", "boredom") for line in lines], "reason: input should be"),
        ("result", lambda lines: [line.replace('"policy": ', '"policy": 99') for line in lines], "names a policy that"),
    ],
)
def test_files_that_do_not_fit_each_other_are_refused(run, file, change, message):
    path = getattr(run, file)
    path.write_text("\n".join(change(path.read_text().splitlines())) + "\n")
    with pytest.raises(StoredRunError, match=message):
        read_run(run.root)


def test_a_killed_run_may_be_ahead_of_its_metrics_and_can_be_drawn(run):
    """Its last generation has policies, but no row; answers of a course that it was taken back from are ahead."""
    run.result.unlink()
    lines = run.metrics.read_text().splitlines()
    run.metrics.write_text("\n".join(lines[:-1]) + "\n")
    stored = read_run(run.root)
    assert [record.generation for record in stored.decisions] == [1, 2, 3]
    assert draw_run(stored, run.plots)


def test_a_column_that_a_version_did_not_have_is_empty(run):
    rows = [{name: cell for name, cell in row.items() if name != "sparsity"} for row in read_rows(run.metrics)]
    run.metrics.write_text(csv_text(rows, [*rows[0], "of a later version"]))
    rows = read_rows(run.policies)
    old = csv_text(rows, list(rows[0])).replace("std_", "spread_", 3)
    run.policies.write_text(old)
    stored = read_run(run.root)
    assert np.isnan(stored.metrics["sparsity"]).all() and len(stored.metrics["sparsity"]) == 4
    assert stored.policies[1].std.tolist() == [float(rows[1][f"std_{each.name}"]) for each in stored.objectives]

"""The command line: what it makes, what it prints, and that bad input makes nothing."""

import csv
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import envs
from jmorl import load_policy, read_run
from jmorl.cli import main
from jmorl.config import resolve
from jmorl.display.console import PlainConsole
from jmorl.display.text import number
from jmorl.evaluation import evaluate_stored
from jmorl.loop import evaluation_keys
from jmorl.report.progress import kind_of_progress
from tests.studio.serving import free_port

ROOT = Path(__file__).parent.parent

TRAIN = [
    *("train", "--env", "probe-three-ways", "--user", "weights=0.5,0.3,0.2", "--steps", "2112", "--quiet"),
    *("--population.agents", "4", "--population.warmup-iterations", "2", "--population.iterations", "3"),
    *("--ppo.environments", "3", "--ppo.rollout-steps", "16", "--ppo.minibatches", "4", "--ppo.epochs", "2"),
    *("--evaluation.episodes", "2", "--search.weight-divisions", "4"),
]


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "run"
    assert main([*TRAIN, "--out", str(folder)]) == 0
    return folder


@pytest.fixture
def folder(trained, tmp_path):
    """A copy that a test may spoil."""
    return shutil.copytree(trained, tmp_path / "copy")


def rows(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_the_run_folder_is_complete(trained):
    manifest = json.loads((trained / "manifest.json").read_text())
    assert manifest["packages"]["jax"] and manifest["seed"] == 1 and manifest["device"]["count"] == 2
    assert [row["generation"] for row in rows(trained / "metrics.csv")] == ["0", "1", "2", "3"]
    assert len(rows(trained / "policies.csv")) == 16
    assert len((trained / "decisions.jsonl").read_text().splitlines()) == 4
    assert {path.name for path in (trained / "plots").iterdir()} == {
        *("front.png", "front_pairs.png", "prediction.png", "progress.png")
    }
    assert not [path for path in trained.rglob("*") if path.name.startswith(".")]


def test_every_policy_of_the_front_has_a_file_with_its_scores(trained):
    for row in rows(trained / "front.csv"):
        policy = load_policy(trained / "policies" / f"{int(row['policy']):05d}.npz")
        assert policy.header["values"] == [float(row[f"value_{name}"]) for name in ("north", "east", "west")]
        action = policy(np.zeros((5, 2)))
        assert action.shape == (5, 2) and (np.abs(action) <= 1).all()


def test_the_run_reads_back(trained):
    run = read_run(trained)
    assert run.config.population.agents == 4
    assert run.result["reason"] == "budget"
    assert run.chosen.id in [policy.id for policy in run.front]
    assert (run.bounds[0] == -np.inf).all() and np.isfinite(run.bounds[1:]).all()


def test_a_stored_policy_scores_as_in_its_run_from_the_runs_starts(trained):
    run = read_run(trained)
    returns = evaluate_stored(load_policy(trained / "chosen.npz"), evaluation_keys(run.config))
    np.testing.assert_allclose(returns.undiscounted.mean(0), run.chosen.confirmation.claimed, rtol=1e-5)
    assert not np.allclose(run.chosen.values, run.chosen.confirmation.claimed, rtol=1e-3)  # confirmed on other starts


def test_evaluate_prints_every_return_and_repeats_itself(trained, capsys):
    outputs = []
    for _ in range(2):
        assert main(["evaluate", str(trained), "--episodes", "40", "--seed", "3", "--json"]) == 0
        outputs.append(json.loads(capsys.readouterr().out))
    assert outputs[0] == outputs[1]
    returns = np.array(outputs[0]["returns"])
    assert returns.shape == (40, 3)
    assert main(["evaluate", str(trained / "chosen.npz"), "--episodes", "40", "--seed", "4", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["returns"] != outputs[0]["returns"]


def test_replaying_the_decisions_gives_the_same_run(trained, tmp_path):
    again = tmp_path / "again"
    arguments = [argument for argument in TRAIN if not argument.startswith("weights=")]
    arguments[arguments.index("--user") + 1 : arguments.index("--user") + 1] = [f"script={trained}/decisions.jsonl"]
    assert main([*arguments, "--out", str(again)]) == 0
    assert (again / "policies.csv").read_bytes() == (trained / "policies.csv").read_bytes()
    assert (again / "decisions.jsonl").read_bytes() == (trained / "decisions.jsonl").read_bytes()


def test_the_config_of_a_run_makes_the_same_run(trained, tmp_path):
    again = tmp_path / "again"
    assert main(["train", "--config", str(trained / "config.toml"), "--quiet", "--out", str(again)]) == 0
    assert (again / "policies.csv").read_bytes() == (trained / "policies.csv").read_bytes()


def test_json_is_one_object_for_each_event(tmp_path, capsys):
    assert main([*(a for a in TRAIN if a != "--quiet"), "--json", "--out", str(tmp_path / "run")]) == 0
    events = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert len(events) == 1 + 4 + 4 + 1


@pytest.mark.parametrize("user", [None, "weights=0,0,1"])
def test_enautilus_ends_on_a_policy_of_the_front(folder, capsys, user):
    arguments = ["enautilus", str(folder), "--json", *(["--user", user] if user else [])]
    assert main(arguments) == 0
    chosen = json.loads(capsys.readouterr().out)
    assert str(chosen["policy"]) in [row["policy"] for row in rows(folder / "front.csv")]
    log = folder / "enautilus.jsonl"
    assert main(["enautilus", str(folder), "--json", "--user", f"script={log}"]) == 0
    assert json.loads(capsys.readouterr().out) == chosen


def test_show_writes_a_page(folder, tmp_path, capsys):
    page = tmp_path / "page.html"
    assert main(["show", str(folder), "--html", str(page)]) == 0
    assert f"page: {page}" in capsys.readouterr().out and page.read_text(encoding="utf-8").startswith("<!doctype html>")
    assert main(["show", str(folder), "--html", str(tmp_path / "nowhere" / "page.html")]) == 1


def test_show_prints_the_front_and_draws(folder, capsys):
    shutil.rmtree(folder / "plots")
    assert main(["show", str(folder)]) == 0
    assert "north" in capsys.readouterr().out
    assert (folder / "plots" / "front.png").exists()


@pytest.mark.parametrize("name", ["metrics.csv", "policies.csv", "front.csv"])
def test_a_table_with_half_a_row_is_named(folder, capsys, name):
    lines = (folder / name).read_text().splitlines(keepends=True)
    (folder / name).write_text("".join(lines[:-1]) + lines[-1][:1])
    assert main(["show", str(folder)]) == 2
    assert capsys.readouterr().err.endswith(f"{name}, line {len(lines)} ends too early\n")


def test_a_manifest_with_other_things_in_it_is_no_traceback(folder, capsys):
    (folder / "manifest.json").write_text('{"format": "one"}')
    assert main(["show", str(folder)]) == 2
    assert "cannot be read as a run" in capsys.readouterr().err


def test_envs_lists_every_environment(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "140")
    assert main(["envs"]) == 0
    printed = capsys.readouterr().out
    assert all(name in printed for name in envs.ids())
    assert printed.index("MO-Gymnasium") < printed.index("mo-walker2d-v5") < printed.index("PGMORL's authors")
    assert "steps/s" not in printed


def test_envs_measures_those_that_are_asked_for(capsys):
    name = "tests.registered:probe-three-ways"
    assert main(["envs", name, "mo-mountaincarcontinuous-v0", "--speed"]) == 0
    printed = capsys.readouterr().out
    assert "mo-halfcheetah" not in printed and "your own" in printed
    rows = [line.split() for line in printed.splitlines() if line.strip().startswith(("tests.", "mo-"))]
    assert len(rows) == 4 and all(re.search(r"\d( [kM])?$", " ".join(row)) for row in rows[2:])
    assert "96 at once on one core" in printed


def test_envs_measures_nothing_where_one_is_unknown(capsys):
    assert main(["envs", "mo-mountaincarcontinuous-v0", "mo-hoper-v5", "--speed"]) == 2
    shown = capsys.readouterr()
    assert not shown.out and "did you mean" in shown.err


def test_a_run_is_not_overwritten_without_force(folder, capsys):
    before = (folder / "policies.csv").read_bytes()
    assert main([*TRAIN, "--out", str(folder)]) == 2
    assert "already holds a run" in capsys.readouterr().err
    assert (folder / "policies.csv").read_bytes() == before
    assert main([*TRAIN, "--seed", "2", "--out", str(folder), "--force"]) == 0
    assert (folder / "policies.csv").read_bytes() != before


@pytest.mark.parametrize("force", [[], ["--force"]])
def test_a_folder_that_is_no_run_is_never_overwritten(tmp_path, capsys, force):
    (tmp_path / "letter.txt").write_text("dear")
    assert main([*TRAIN, "--out", str(tmp_path), *force]) == 2
    assert "not a run" in capsys.readouterr().err
    assert (tmp_path / "letter.txt").read_text() == "dear"


def test_all_bad_input_is_named_at_once_and_nothing_is_made(tmp_path, capsys):
    used = tmp_path / "used"
    used.mkdir()
    (used / "file").touch()
    arguments = [
        *("train", "--env", "nowhere", "--method", "magic", "--user", "Z", "--steps", "2.5"),
        *("--population.agents", "-1", "--ppo.minibatches", "7", "--preset", "fancy", "--out", str(used)),
    ]
    assert main(arguments) == 2
    errors = capsys.readouterr().err.splitlines()
    names = ("env", "method", "user", "steps", "population.agents", "ppo.minibatches", "preset", "out")
    for name in names:
        assert [line for line in errors if line.startswith(f"jmorl: {name}: ")], name
    assert len(errors) == len(names)
    assert [path.name for path in used.iterdir()] == ["file"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["train", "--user", "target=1,2,3"], "user: target must have one number for each of 2 objectives"),
        (["train", "--user", "script=/nowhere"], "user: there is no decision log"),
        (["train", "--config", "/nowhere.toml"], "config: cannot read /nowhere.toml"),
        (["show", "/nowhere"], "/nowhere does not exist"),
        (["enautilus", "/nowhere"], "/nowhere does not exist"),
        (["evaluate", "/nowhere.npz"], "/nowhere.npz is not a policy file"),
    ],
)
def test_bad_input_is_one_clear_message(arguments, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == 2
    errors = capsys.readouterr().err.splitlines()
    assert len(errors) == 1 and errors[0].startswith(f"jmorl: {message}")
    assert not list(tmp_path.iterdir())


def test_the_studio_opens_a_run_or_shows_the_folder_of_runs_that_is_named(folder, monkeypatch, capsys):
    served = []
    monkeypatch.setattr(
        "jmorl.studio.server.serve", lambda session, *_: served.append((session.runs.resolve(), session.open_folder))
    )
    runs = folder.parent
    (runs / "empty").mkdir()
    monkeypatch.chdir(folder)
    for named in (folder, ".", runs, "..", runs / "empty"):
        assert main(["studio", str(named), "--port", str(free_port())]) == 0
    assert served == [(runs, folder), (runs, folder), (runs, None), (runs, None), (runs / "empty", None)]
    for name, message in (("nowhere", "does not exist; name a run or"), ("result.json", "is not a run folder")):
        capsys.readouterr()
        assert main(["studio", str(folder / name), "--port", str(free_port())]) == 2
        (error,) = capsys.readouterr().err.splitlines()
        assert f"{folder / name} {message}" in error
    assert len(served) == 5 and not (folder / "nowhere").exists()


BAD = """
import envs
import jax.numpy as jnp
from tests.probes import ThreeWays


class Short(ThreeWays):
    def observe(self, state):
        return state[:1]

    def transition(self, state, action):
        result = super().transition(state, action)
        return result._replace(reward=result.reward[:2], terminated=jnp.zeros(1, bool))


class Single(ThreeWays):
    objectives = ThreeWays.objectives[:1]


envs.register("short-v0", Short)
envs.register("single-v0", Single)
"""


@pytest.fixture
def bad_environments(tmp_path, monkeypatch):
    """Those of a module `my_bad` in the working directory."""
    monkeypatch.setattr(envs, "registry", dict(envs.registry))
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.delitem(sys.modules, "my_bad", raising=False)
    (tmp_path / "my_bad.py").write_text(BAD)
    monkeypatch.chdir(tmp_path)


@pytest.mark.usefixtures("bad_environments")
@pytest.mark.parametrize("command", ["train", "studio"])
@pytest.mark.parametrize(
    ("env", "messages"),
    [
        (
            "my_bad:short-v0",
            ("observation has shape (1,), not (2,)", "reward has shape (2,), not (3,)", "terminated has shape (1,)"),
        ),
        ("my_bad:single-v0", ("jmorl: env: ", "there must be 2 objectives or more, not 1")),
    ],
)
def test_an_environment_that_is_not_as_it_declares_makes_nothing_and_empties_nothing(
    folder, capsys, command, env, messages
):
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    arguments = [command, *TRAIN[1:], *(["--port", str(free_port())] if command == "studio" else [])]
    arguments[arguments.index("--env") + 1] = env
    arguments = [argument for argument in arguments if argument != "--quiet"]
    assert main([*arguments, "--out", str(folder), "--force"]) == 2
    (error,) = capsys.readouterr().err.splitlines()
    assert all(message in error for message in messages), error
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before
    assert main([*arguments, "--out", str(folder.with_name("new"))]) == 2
    assert not folder.with_name("new").exists()


@pytest.mark.parametrize("command", ["train", "studio", "branch"])
def test_a_script_that_cannot_be_read_makes_nothing(trained, tmp_path, capsys, command):
    log = tmp_path / "log.jsonl"
    log.write_text("no decision\n")
    new = ["--env", "probe-three-ways", *(["--port", str(free_port())] if command == "studio" else [])]
    arguments = [str(trained), "--generation", "1"] if command == "branch" else new
    assert main([command, *arguments, "--user", f"script={log}", "--out", str(tmp_path / "run")]) == 2
    assert f"user: {log}, line 1 is not valid JSON" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()


def test_a_script_that_does_not_fit_stops_the_run_and_keeps_what_it_had(trained, tmp_path, capsys):
    log = tmp_path / "log.jsonl"
    log.write_text((trained / "decisions.jsonl").read_text().splitlines()[0] + "\n")
    arguments = [f"script={log}" if argument.startswith("weights=") else argument for argument in TRAIN]
    assert main([*arguments, "--out", str(tmp_path / "run")]) == 1
    assert "no decision for generation 2" in capsys.readouterr().err
    assert len(rows(tmp_path / "run" / "metrics.csv")) == 2
    assert main(["show", str(tmp_path / "run")]) == 0


def test_numbers_that_stop_being_finite_end_the_run_and_reach_no_file(tmp_path, capsys):
    folder = tmp_path / "run"
    sizes = [
        *("--population.agents", "2", "--population.warmup-iterations", "1", "--population.iterations", "3"),
        *("--ppo.environments", "2", "--ppo.rollout-steps", "4", "--ppo.minibatches", "1", "--ppo.epochs", "1"),
        *("--ppo.hidden-sizes", "8", "--evaluation.episodes", "2", "--steps", "64"),
    ]
    arguments = ["train", "--env", "tests.registered_faulty:probe-faulty-later", *sizes, "--json", "--out", str(folder)]
    assert main(arguments) == 1
    printed = capsys.readouterr()
    # The seventh step of an episode falls into the second rollout of four steps.
    faults = [f"agent {agent}: reward of left is not finite in iteration 2" for agent in range(2)]
    assert printed.err == f"jmorl: stopped: {'; '.join(faults)}\n"
    warm_up = json.loads(printed.out.splitlines()[1])
    assert (warm_up["event"], warm_up["generation"]) == ("generation", 0)
    logs = {name: rows(folder / name) for name in ("metrics.csv", "policies.csv", "front.csv")}
    assert [row["generation"] for row in logs["metrics.csv"]] == ["0"] and len(logs["policies.csv"]) == 2
    numbers = [float(cell) for table in logs.values() for row in table for cell in row.values() if cell]
    assert np.isfinite(numbers).all()
    assert {int(row["policy"]) for row in logs["front.csv"]} == {policy["policy"] for policy in warm_up["front"]}
    assert len(list((folder / "policies").iterdir())) == len(logs["front.csv"])
    for path in (folder / "policies").iterdir():
        with np.load(path) as file:
            assert all(np.isfinite(file[name]).all() for name in file.files if name != "header")
        assert np.isfinite(load_policy(path).header["values"]).all()
    assert main(["show", str(folder)]) == 0


def test_export_copies_a_policy(trained, tmp_path, capsys):
    policy = int(rows(trained / "front.csv")[0]["policy"])
    target = tmp_path / "policy.npz"
    assert main(["export", str(trained), "--policy", str(policy), "--to", str(target)]) == 0
    said, values = capsys.readouterr().out, load_policy(target).header["values"]
    assert said.startswith(f"{target}: policy {policy}, north {number(values[0])} units, ") and said.count("\n") == 1
    assert load_policy(target).header["id"] == policy
    assert main(["export", str(trained), "--to", str(target)]) == 2
    assert "exists; choose another file, or overwrite it with --force" in capsys.readouterr().err
    assert main(["export", str(trained), "--to", str(target), "--force"]) == 0
    assert load_policy(target).header["id"] == read_run(trained).chosen.id


@pytest.mark.parametrize("command", ["train", "resume", "branch", "enautilus"])
def test_questions_at_this_terminal_and_json_are_not_mixed(folder, tmp_path, capsys, command):
    if command == "resume":  # of a run with such a user that has not ended
        (folder / "result.json").unlink()
        config = (folder / "config.toml").read_text()
        (folder / "config.toml").write_text(config.replace("weights=0.5,0.3,0.2", "terminal"))
    new, terminal = ["--out", str(tmp_path / "new")], ["--user", "terminal"]
    arguments = {
        "train": [*(argument for argument in TRAIN if argument != "--quiet"), *terminal, *new],
        "resume": ["resume", str(folder)],
        "branch": ["branch", str(folder), "--generation", "2", *terminal, *new],
        "enautilus": ["enautilus", str(folder), *terminal],
    }
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    assert main([*arguments[command], "--json"]) == 2
    printed = capsys.readouterr()
    assert printed.out == "" and printed.err.startswith("jmorl: json: questions at this terminal would stand between")
    assert before == {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}


def test_resuming_a_run_that_has_ended_prints_nothing_for_programs(folder, capsys, monkeypatch):
    monkeypatch.setattr("jmorl.report.plots.draw_run", lambda *_: None)
    for mode, said in (("--quiet", False), ("--json", True), (None, True)):
        assert main(["resume", str(folder), *([mode] if mode else [])]) == 0
        printed = capsys.readouterr()
        assert printed.out == "" and ("has ended; there is nothing to resume" in printed.err) is said


def test_branch_makes_a_run_with_another_user(trained, tmp_path, capsys):
    folder = tmp_path / "branch"
    arguments = ["branch", str(trained), "--generation", "2", "--user", "weights=0,1,0", "--out", str(folder)]
    assert main([*arguments, "--quiet"]) == 0
    assert read_run(folder).config.user == "weights=0,1,0"
    assert [len((path / "metrics.csv").read_text().splitlines()) for path in (trained, folder)] == [5, 5]
    assert main([*arguments, "--force", "--json"]) == 0
    events = [json.loads(line)["event"] for line in capsys.readouterr().out.splitlines()]
    assert events == ["compiled", "resumed", "decided", "generation", "decided", "finished"]
    assert main(["branch", str(trained), "--generation", "2", "--user", "Z", "--out", str(tmp_path / "no")]) == 2
    assert "user: unknown user 'Z'" in capsys.readouterr().err
    assert not (tmp_path / "no").exists()


def test_a_run_that_is_over_does_not_fail_for_its_plots(folder, capsys):
    folder = folder.rename(folder.with_name("with [red]space"))
    shutil.rmtree(folder / "plots")
    (folder / "plots").touch()  # where the folder should be
    assert main(["resume", str(folder)]) == 0
    errors = capsys.readouterr().err
    for name in ("front.png", "front_pairs.png", "prediction.png", "progress.png"):
        assert f"{folder / 'plots' / name} cannot be written: " in errors
    assert errors.endswith(f"; the run is complete, and jmorl show '{folder}' draws it again\n")
    assert main(["show", str(folder)]) == 1
    printed = capsys.readouterr()
    assert "Final front" in printed.out and "front.png cannot be written: " in printed.err
    (folder / "plots").unlink()
    assert main(["show", str(folder)]) == 0
    assert f"plot: {folder / 'plots' / 'front.png'}\n" in capsys.readouterr().out


def test_commands_in_messages_can_be_pasted_into_a_shell(folder, capsys):
    folder = folder.rename(folder.with_name("it's here"))
    (folder / "result.json").unlink()
    assert main([*TRAIN, "--out", str(folder)]) == 2
    (written,) = re.findall("`(.*)`", capsys.readouterr().err)
    assert shlex.split(written) == ["jmorl", "resume", str(folder)]


@pytest.mark.parametrize(
    ("options", "term", "kind"),
    [
        ({}, "xterm", "live"),
        ({}, "dumb", "lines"),
        ({"quiet": True}, "xterm", "quiet"),
        ({"json": True}, "dumb", "json"),
    ],
)
def test_a_terminal_that_cannot_move_its_cursor_gets_lines(options, term, kind):
    console = PlainConsole(force_terminal=True, _environ={"TERM": term})
    assert kind_of_progress(**{"json": False, "quiet": False, **options}, console=console) == kind


@pytest.mark.parametrize(
    "variables",
    [
        {"MPLBACKEND": "module://matplotlib_inline.backend_inline"},
        {"PYTHONIOENCODING": "ascii"},
        {"LC_ALL": "C", "PYTHONUTF8": "0", "XDG_CACHE_HOME": "", "HOME": "/proc/nowhere"},
        {"PYTHONOPTIMIZE": "2"},
    ],
    ids=lambda variables: next(iter(variables)),
)
def test_a_run_is_shown_on_any_machine(trained, tmp_path, variables):
    folder = shutil.copytree(trained, tmp_path / "größer [/b]")
    shutil.rmtree(folder / "plots")
    config = (folder / "config.toml").read_text(encoding="utf-8")
    (folder / "config.toml").write_text(config.replace("probe-three", "tests.registered:probe-three"), encoding="utf-8")
    manifest = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    manifest["config"] = resolve(file=folder / "config.toml").identity()
    (folder / "manifest.json").write_text(json.dumps(manifest), encoding="utf-8")
    program = [sys.executable, "-m", "jmorl", "show", str(folder)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "80", **variables}
    shown = subprocess.run(program, env=environment, capture_output=True, cwd=tmp_path)
    assert shown.returncode == 0, shown.stderr
    assert (folder / "plots" / "front.png").exists()
    table = shown.stdout.split(b"Final front")[1].split(b"plot: ")[0].decode()
    assert all(f" {row['policy']} " in table for row in rows(folder / "front.csv"))


@pytest.mark.parametrize(
    "variables", [{"LC_ALL": "C", "PYTHONUTF8": "0"}, {"LC_ALL": "C.UTF-8", "JAX_TRANSFER_GUARD": "disallow"}]
)
def test_a_run_is_made_and_read_on_any_machine(tmp_path, variables):
    """Into a folder whose name is no text in the locale, or in none."""
    program = [sys.executable, "-m", "jmorl", *TRAIN, "--env", "tests.registered:probe-three-ways", "--steps", "960"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), **variables}
    name = os.fsdecode(b"gr\xf6\xc3\xa9")
    made = subprocess.run([*program, "--out", name], env=environment, capture_output=True, cwd=tmp_path)
    assert made.returncode == 0 and not made.stderr, made.stderr
    assert read_run(tmp_path / name).result is not None
    again = subprocess.run([*program[:3], "resume", name], env=environment, capture_output=True, cwd=tmp_path)
    assert again.returncode == 0 and again.stderr.endswith(b"there is nothing to resume\n")


def test_a_name_that_is_too_long_makes_nothing(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main([*TRAIN, "--out", "x" * 300]) == 2
    assert capsys.readouterr().err == f"jmorl: out: {'x' * 300} cannot be used: File name too long\n"
    assert not list(tmp_path.iterdir())

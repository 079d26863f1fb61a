"""The README's Python, as its reader would run it."""

import re
import shutil
from pathlib import Path

import pytest

import jmorl
from tests.resuming import go_on, outcome, train

README = Path(__file__).parents[1] / "README.md"

# What makes a run of seconds of that of the README, beside the settings that it has itself.
SIZES = {
    "population": {"agents": 2, "warmup_iterations": 1, "iterations": 1},
    "ppo": {"environments": 2, "rollout_steps": 16, "minibatches": 2, "epochs": 1, "hidden_sizes": (8,)},
    "evaluation": {"episodes": 2},
    "steps": 2 * 2 * 16 * 5,
}


def blocks(heading):
    """The Python of a section."""
    section = README.read_text().partition(f"\n## {heading}\n")[2].partition("\n## ")[0]
    return re.findall(r"```python\n(.*?)```", section, re.DOTALL)


@pytest.fixture
def small(tmp_path, monkeypatch):
    """An empty folder to be in, where `jmorl.resolve` gives small sizes; those settings."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("jmorl.use_all_cpu_cores", lambda: None)  # the suite has done so
    resolve, asked = jmorl.resolve, []

    def small_sizes(overrides):
        asked.append(resolve(overrides=overrides))
        return resolve(overrides={**overrides, **SIZES})

    monkeypatch.setattr("jmorl.resolve", small_sizes)
    return asked


def test_what_is_done_from_python_works_line_by_line(small, tmp_path, capsys):
    first, branched, frugal, navigated = blocks("From Python")
    train(tmp_path / "runs" / "first", jmorl.resolve({}))
    shutil.copytree("runs/first", "runs/demo")
    names = {}
    exec(first, names)
    printed = capsys.readouterr().out.splitlines()
    assert small[-1].user == "C" and small[-1].steps == 1_000_000
    assert printed[:4] == ["Compiled", "GenerationFinished", "Decided", "GenerationFinished"]
    assert printed[-3] == "RunFinished"
    assert names["policy"].header["id"] == jmorl.read_run(Path("runs/demo")).chosen.id
    exec(branched, names)
    went_on = "Compiled Resumed Decided GenerationFinished Decided RunFinished"
    assert capsys.readouterr().out.split() == went_on.split()
    assert jmorl.read_run(Path("runs/second")).config.user == "C"
    exec(frugal, names)
    asked = [event for event in names["events"] if hasattr(event, "answer")]
    assert len(asked) == 5
    assert all(event.chosen.values[1] == event.question.values[:, 1].max() for event in asked)
    exec(navigated, names)
    assert "NavigationFinished\n" in capsys.readouterr().out
    assert names["event"].chosen in names["front"]


def test_contenders_are_compared_as_the_readme_does(small, tmp_path, capsys):
    (comparison,) = blocks("The paper's experiments")
    imported = re.findall(r"^(?:from|import) (\S+)", comparison, re.MULTILINE)
    assert imported == ["pathlib", "jmorl"]  # nothing deeper
    exec(comparison, {})
    assert small[-1].steps == 5_000_000
    text = capsys.readouterr().out
    assert text == (tmp_path / "runs" / "mine" / "REPORT.md").read_text() + "\n"
    assert "| A | mine |" in text and "saved against pgmorl" in text
    assert len(list(tmp_path.glob("runs/mine/records/*.json"))) == 2 * 3


def test_a_search_method_of_ones_own_works_as_it_stands(tmp_path, monkeypatch, small_config):
    (source,) = blocks("Your own search method")
    (tmp_path / "my_methods.py").write_text(source, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    config = small_config.replace(method="my_methods:random")
    whole = train(tmp_path / "whole", config)
    interrupted = train(tmp_path / "interrupted", config, events=3)
    go_on(interrupted)
    assert outcome(interrupted) == outcome(whole)

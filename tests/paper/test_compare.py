"""The comparison as a tool: somebody's own decision maker, on somebody's own environment, to the same tables."""

import re
from pathlib import Path

import pytest

from jmorl.config import resolve
from jmorl.decision.protocol import Answer, DecisionMaker
from jmorl.learning.population import Population, TrainingFault
from jmorl.paper import Method, compare
from tests.registered import ThreeWays

TARGETS = {"near": (-200.0, -200.0, -200.0), "beyond": (0.0, 0.0, 0.0)}


class Stubborn(DecisionMaker):
    """Always prefers the first objective."""

    asked = 0

    def __init__(self, target):
        self.target = target

    def answer(self, question):
        Stubborn.asked += 1
        assert self.target.shape == (3,)
        return Answer(max(question.front, key=lambda policy: policy.values[0]).id)


@pytest.fixture(scope="module")
def methods(small_config):
    config = small_config.replace(user="weights=1,1,1")
    return {
        "stubborn": Method(config, Stubborn),
        "interactive": Method(config),
        "pgmorl": Method(config.replace(method="pgmorl")),
    }


def test_the_tables_are_of_all_methods_targets_and_seeds(methods, tmp_path):
    comparison = compare(ThreeWays.id, methods, TARGETS, seeds=(1, 2), out=tmp_path)
    assert [(row.target, row.method) for row in comparison.rows] == [(t, m) for t in TARGETS for m in methods]
    assert {row.times.successes for row in comparison.rows if row.target == "near"} == {2}
    assert {row.times.successes for row in comparison.rows if row.target == "beyond"} == {0}
    text = comparison.markdown()
    assert (tmp_path / "REPORT.md").read_text() == text
    assert "| near | stubborn |" in text and "2 of 2" in text and "≥" in text and "saved against pgmorl" in text
    assert Stubborn.asked == 2 * (1 + 4)  # near: the final choice only; beyond: three questions and the final choice
    again = compare(ThreeWays.id, methods, TARGETS, seeds=(1, 2), out=tmp_path)
    assert again.markdown() == text and Stubborn.asked == 10


def test_unequal_budgets_are_refused(methods, tmp_path):
    other = Method(methods["pgmorl"].config.replace(steps=4 * 3 * 16 * 8))
    with pytest.raises(ValueError, match=r"within one budget of steps; theirs are: stubborn 2112, shorter 1536"):
        compare(ThreeWays.id, {"stubborn": methods["stubborn"], "shorter": other}, TARGETS, (1,), tmp_path)
    assert not list(tmp_path.iterdir())


def test_a_run_that_breaks_down_counts_as_not_reaching_its_target(methods, tmp_path, monkeypatch):
    def broken(*_):
        raise TrainingFault("agent 0: loss is not finite in iteration 1")

    monkeypatch.setattr(Population, "train", broken)
    found = compare(ThreeWays.id, {"pgmorl": methods["pgmorl"]}, {"near": TARGETS["near"]}, (1, 2), tmp_path)
    (row,) = found.rows
    assert row.times.reached == (None, None) and row.faults == 2
    text = found.markdown()
    assert "| near | pgmorl | 0.00 [0.00, 0.00] | 0 of 2 |" in text and "≥ 0.00 (broke down at 0.00 M)" in text
    assert "nan" not in text


def test_the_readmes_example_works(small_config, tmp_path, monkeypatch, capsys):
    """Its lines as they are, but for the settings: those of a run of seconds."""
    readme = Path(__file__).parents[2].joinpath("README.md").read_text()
    lines = re.search(
        r"```python\n(from pathlib import Path\n\nimport jmorl\nfrom jmorl.paper.*?)```", readme, re.DOTALL
    )[1]
    assert resolve(overrides={"env": "mo-mountaincarcontinuous-v0", "steps": 5_000_000}).steps == 5_000_000
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("jmorl.resolve", lambda overrides: small_config)
    monkeypatch.setattr("jmorl.use_all_cpu_cores", lambda: None)  # the suite has done so
    lines = lines.replace("(-75.9, -44.2)", "(-200.0, -200.0, -200.0)").replace("(1, 7, 10)", "(1,)")
    exec(lines, {})
    assert "| A | mine |" in capsys.readouterr().out
    assert len(list(tmp_path.glob("runs/mine/records/*.json"))) == 2

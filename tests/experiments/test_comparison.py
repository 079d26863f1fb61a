"""The comparison as a tool: somebody's own decision maker, on somebody's own environment, to the same tables."""

import subprocess
import sys

import pytest

import jmorl
from jmorl import Contender, compare
from jmorl.config import ConfigError
from jmorl.decision.answers import Answer
from jmorl.decision.protocol import DecisionMaker
from jmorl.learning.population import Population, TrainingFault
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
def contenders(small_config):
    config = small_config.replace(user="weights=1,1,1")
    return {
        "stubborn": Contender(config, Stubborn),
        "interactive": Contender(config),
        "pgmorl": Contender(config.replace(method="pgmorl")),
    }


def test_the_tables_are_of_all_contenders_targets_and_seeds(contenders, tmp_path):
    comparison = compare(ThreeWays.id, contenders, TARGETS, seeds=(1, 2), out=tmp_path)
    assert [(row.target, row.method) for row in comparison.rows] == [(t, m) for t in TARGETS for m in contenders]
    assert {row.times.successes for row in comparison.rows if row.target == "near"} == {2}
    assert {row.times.successes for row in comparison.rows if row.target == "beyond"} == {0}
    text = comparison.markdown()
    assert (tmp_path / "REPORT.md").read_text() == text
    assert "| near | stubborn |" in text and "2 of 2" in text and "≥" in text and "saved against pgmorl" in text
    assert Stubborn.asked == 2 * (1 + 4)  # near: the final choice only; beyond: three questions and the final choice
    again = compare(ThreeWays.id, contenders, TARGETS, seeds=(1, 2), out=tmp_path)
    assert again.markdown() == text and Stubborn.asked == 10


def test_all_that_is_wrong_is_said_before_anything_is_made(contenders, tmp_path):
    shorter = Contender(contenders["pgmorl"].config.replace(steps=4 * 3 * 16 * 8))
    with pytest.raises(ConfigError) as error:
        compare(
            ThreeWays.id,
            {"stubborn": contenders["stubborn"], "a/b": shorter},
            {"near": (-200.0, -200.0), "nowhere": (0.0, float("nan"), 0.0)},
            (1, 1, -3),
            tmp_path / "out",
        )
    problems = error.value.problems
    assert problems[:3] == [
        "contender 'a/b': files are named after it; write it with letters, digits, spaces and . _ + = -",
        "seed 1 is given 2 times",
        "contenders are compared within one budget of steps; theirs are: stubborn 2112, a/b 1536",
    ]
    assert [problem.split(": ")[:2] for problem in problems[3:]] == [
        ["stubborn, target near", "user"],
        ["stubborn, target near", "seed"],
        ["stubborn, target nowhere", "user"],
    ]
    assert "one number for each of 3 objectives, not 2" in problems[3] and "finite" in problems[5]
    assert not (tmp_path / "out").exists()


def test_nothing_to_compare_is_refused(contenders, tmp_path):
    for methods, targets, seeds, missing in (
        ({}, TARGETS, (1,), "contender"),
        (contenders, {}, (1,), "target"),
        (contenders, TARGETS, (), "seed"),
    ):
        with pytest.raises(ConfigError, match=f"there is no {missing} to compare with"):
            compare(ThreeWays.id, methods, targets, seeds, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_two_runs_never_share_a_file(contenders, tmp_path):
    some = dict.fromkeys(("a", "a-target-b"), contenders["pgmorl"])
    goals = dict.fromkeys(("b-target-c", "c"), TARGETS["near"])
    with pytest.raises(ConfigError, match="two runs would have the same name"):
        compare(ThreeWays.id, some, goals, (1,), tmp_path / "out")


def test_targets_that_differ_in_the_last_digit_are_other_runs(contenders, tmp_path):
    """Otherwise a run that ended with the easier target would count as one to the harder."""
    pgmorl = {"pgmorl": contenders["pgmorl"]}
    users = []
    for last in (-200.0, -200.00000001):
        (row,) = compare(ThreeWays.id, pgmorl, {"near": (-200.0, -200.0, last)}, (1,), tmp_path).rows
        users.append(row.records[0].config["user"])
    assert users == ["target=-200,-200,-200", "target=-200,-200,-200.00000001"]


def test_a_run_that_breaks_down_counts_as_not_reaching_its_target(contenders, tmp_path, monkeypatch):
    def broken(*_):
        raise TrainingFault("agent 0: loss is not finite in iteration 1")

    monkeypatch.setattr(Population, "train", broken)
    found = compare(ThreeWays.id, {"pgmorl": contenders["pgmorl"]}, {"near": TARGETS["near"]}, (1, 2), tmp_path)
    (row,) = found.rows
    assert row.times.reached == (None, None) and row.faults == 2
    text = found.markdown()
    assert "| near | pgmorl | 0.00 [0.00, 0.00] | 0 of 2 |" in text and "≥ 0.00 (broke down at 0.00 M)" in text
    assert "nan" not in text


def test_a_program_that_only_trains_does_not_import_comparisons():
    program = "import sys, jmorl; assert 'jmorl.experiments' not in sys.modules; assert 'compare' in dir(jmorl)"
    subprocess.run([sys.executable, "-c", program], check=True)


def test_an_unknown_name_is_still_an_error():
    with pytest.raises(AttributeError, match="module 'jmorl' has no attribute 'compere'"):
        jmorl.compere  # noqa: B018

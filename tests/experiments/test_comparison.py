"""The comparison as a tool: somebody's own decision maker, on somebody's own environment, to the same tables."""

import pytest

from jmorl.decision.protocol import Answer, DecisionMaker
from jmorl.experiments import Contender, compare
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


def test_unequal_budgets_are_refused(contenders, tmp_path):
    other = Contender(contenders["pgmorl"].config.replace(steps=4 * 3 * 16 * 8))
    with pytest.raises(ValueError, match=r"within one budget of steps; theirs are: stubborn 2112, shorter 1536"):
        compare(ThreeWays.id, {"stubborn": contenders["stubborn"], "shorter": other}, TARGETS, (1,), tmp_path)
    assert not list(tmp_path.iterdir())


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

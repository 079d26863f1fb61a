"""Targets are proposed by a rule: the best of the pooled front, relaxed until half of the pilot runs reach it."""

import numpy as np

from jmorl.paper.plan import CAR
from jmorl.paper.targets import proposals, propose
from tests.paper.made import ITERATION, record

STEPS = 10 * ITERATION


def test_a_target_is_the_best_policy_relaxed_until_half_of_the_runs_reach_it():
    good = [record([[(-100.0, -20.0), (-70.0, -60.0), (-78.0, -30.0)]]) for _ in range(2)]
    slower = [record([[(-100.0, -20.0), (-70.0, -60.0), (-82.0, -33.0)]]) for _ in range(3)]
    found = {each.user: each for each in proposals(good + slower, STEPS)}
    balanced = found["A"]
    assert balanced.best.tolist() == [-78, -30]
    # 2 of 5 runs reach it as it is; the others are (4, 3) short, of ranges (30, 40): relaxed by 15 %.
    assert abs(balanced.relaxed - 0.15) < 1e-9 and balanced.reached == 5
    np.testing.assert_allclose(balanced.target, (-82.5, -36.0))


def test_what_half_of_the_runs_have_is_not_relaxed():
    found = proposals([record([[(-78.0, -30.0), (-60.0, -60.0)]]), record([[(-90.0, -70.0)]])], STEPS)
    assert all(each.relaxed == 0 and each.reached == 1 for each in found)


def test_the_proposal_says_what_it_rests_on():
    runs = {"one": record([[(-78.0, -30.0)]], seed=2), "two": record([[(-78.0, -31.0)]], seed=3)}
    text = propose(CAR, runs)
    assert "from 2 runs with seeds [2, 3]" in text and '"A": [-78, -30]' in text
    assert propose(CAR, {}) == f"{CAR}: no pilot runs yet"

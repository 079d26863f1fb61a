"""Successes that are owed to units and not to policies."""

import numpy as np

from jmorl.experiments.targets import reached, target_row
from jmorl.paper.drift import (
    at_the_start,
    by_untrained,
    common_generation,
    drifted,
    in_warm_up_units,
    prevented,
    reached_without_drift,
    sigma_at,
    untrained,
)
from tests.experiments.made import ITERATION, record

SIGMA = [(40.0, 20.0), (80.0, 20.0)]
CAP = 50 * ITERATION
TARGET = (-1.0, -1.0)


def test_a_score_in_the_units_after_the_warm_up_is_the_return_over_that_sigma():
    run = record([[(-1.5, -1.5)], [(-0.9, -0.9)]], sigma=SIGMA, discounted=[(-60.0, -30.0), (-63.0, -18.0)])
    np.testing.assert_allclose(in_warm_up_units(run), [(-1.5, -1.5), (-1.575, -0.9)])  # scored with 70, not 80
    raw = record([[(-90.0, -50.0)]])
    np.testing.assert_array_equal(in_warm_up_units(raw), raw.values)


def test_without_returns_a_score_is_of_the_sigma_at_the_end_of_its_generation():
    run = record([[(-1.5, -1.5)], [(-0.9, -0.9)]], sigma=SIGMA)
    np.testing.assert_allclose(in_warm_up_units(run), [(-1.5, -1.5), (-1.8, -0.9)])
    assert not reached_without_drift(run, TARGET, 1)
    assert reached_without_drift(run, (-1.9, -1), 1) and not reached_without_drift(run, (-1.9, -1), 0)
    assert reached_without_drift(record([[(-1.0, -1.0)]]), TARGET, 0)


def test_any_policy_found_so_far_shows_that_units_did_not_do_it():
    """The one that clears the target by most is owed to units; another, which left the archive, is not."""
    born = [[(-1.5, -1.5)], [(-0.95, -1.0), (-0.9, -0.8)]]
    run = record(born, sigma=SIGMA, discounted=[(-60, -30), (-38, -20), (-72, -16)])
    hit = reached(run, TARGET)
    assert hit.policy == 2 and run.generations[1].front == (2,)
    assert reached_without_drift(run, TARGET, hit.generation)


def test_an_untrained_success_is_owed_to_units_whatever_they_did():
    start_up = [(4.7, -0.4)] * 6
    run = record([start_up + [(-2.0, -2.0)] * 6], sigma=SIGMA[:1], discounted=[(0, 0)] * 6 + [(-80, -40)] * 6)
    assert untrained(run).tolist() == [True] * 6 + [False] * 6
    row = target_row("A", TARGET, "interactive", (1,), [run], CAP)
    assert (row.times.successes, drifted(row), by_untrained(row), at_the_start(row)) == (1, 1, 1, 1)
    trained = record([[(-0.5, -0.5)] * 6], sigma=SIGMA[:1])
    row = target_row("A", TARGET, "interactive", (1,), [trained], CAP)
    assert (row.times.successes, drifted(row), by_untrained(row), at_the_start(row)) == (1, 0, 0, 1)


def test_units_can_hide_a_success_too():
    run = record([[(-1.5, -1.5)], [(-1.2, -1.2)]], sigma=[(80, 80), (40, 40)], discounted=[(-120, -120), (-60, -60)])
    row = target_row("A", TARGET, "pgmorl", (1,), [run], CAP)
    assert (row.times.successes, prevented(row)) == (0, 1)


def test_sigma_is_compared_after_equally_many_generations():
    short, long = record([[(-1, -1)], [(-1, -2)]], sigma=SIGMA), record([[(-1, -1)]] * 3, sigma=[*SIGMA, (99, 99)])
    last = common_generation([short, long])
    assert last == 1 and sigma_at(long, last).tolist() == [80, 20]

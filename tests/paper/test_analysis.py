"""From records to results: by hand on made-up ones, and against real runs that stop or have other budgets."""

from dataclasses import replace

import numpy as np
import pytest

from jmorl.experiments.record import record_of
from jmorl.experiments.targets import reached
from jmorl.paper.analysis import (
    buffer_utility,
    finals,
    generations_within,
    greatest_utility,
    non_dominated_or_equal,
    offspring_utility,
    pooled_front,
    seconds_within,
)
from jmorl.storage.stored_run import read_run
from tests.experiments.made import ITERATION, record
from tests.resuming import train


def test_utilities_are_of_archive_offspring_and_buffer():
    run = record([[(-90, -50), (-95, -55)], [(-70, -60)]])
    steps = 20 * ITERATION
    np.testing.assert_allclose(greatest_utility(run, (0.5, 0.5), steps), [-70, -65])
    np.testing.assert_allclose(offspring_utility(run, (0.5, 0.5), steps), [-72.5, -65])
    np.testing.assert_allclose(buffer_utility(run, (0.5, 0.5), steps), [-72.5, (-70 - 75 - 65) / 3])


def test_bounds_and_untrained_policies_do_not_touch_the_mean_of_the_offspring():
    run = record([[(4.0, -18.0)] * 6 + [(1.0, -1.0)] * 6, [(2.0, -2.0)] * 6], sigma=[(1, 1)] * 2)
    bounded = replace(run.generations[1], bounds=(1.5, -5.0), buffer=(12,))
    bounded = replace(run, generations=(run.generations[0], bounded))
    for each in (run, bounded):
        np.testing.assert_allclose(offspring_utility(each, (0.5, 0.5), 20 * ITERATION), [0, 0])
    nobody = replace(bounded, generations=(run.generations[0], replace(bounded.generations[1], bounds=(9.0, 9.0))))
    assert np.isnan(buffer_utility(nobody, (0.5, 0.5), 20 * ITERATION, bounded=True)[1])


def test_the_time_within_a_smaller_budget_is_that_of_its_generations():
    run = record([[(-90, -50)], [(-70, -60)], [(-70, -50)]])
    assert seconds_within(run, 20 * ITERATION) == 8.0


def test_final_policies_are_filtered_together():
    pgmorl = [record([[(-100, -20), (-70, -60)]]), record([[(-85, -40), (-99, -21)]])]
    ours = [record([[(-84, -39)]]), record([[(-71, -61)]])]
    found = finals(ours, pgmorl, (0.5, 0.5), 10 * ITERATION)
    assert found.pooled.tolist() == [[-100, -20], [-70, -60], [-85, -40], [-99, -21]]
    assert found.enautilus.tolist() in found.pooled.tolist()
    np.testing.assert_array_equal(found.interactive, [(-84, -39), (-71, -61)])
    assert found.kept[0]
    if found.enautilus.tolist() == [-85, -40]:
        assert not found.enautilus_kept


def test_equal_policies_do_not_dominate_each_other():
    values = np.array([[1.0, 2], [1, 2], [0, 2], [2, 1]])
    assert non_dominated_or_equal(values).tolist() == [True, True, False, True]


@pytest.fixture(scope="module")
def pgmorl(small_config, tmp_path_factory):
    """A function of a config, that makes a PGMORL run of three objectives with it."""
    folder = tmp_path_factory.mktemp("runs")

    def make(name, **changes):
        return record_of(read_run(train(folder / name, small_config.replace(method="pgmorl", **changes))))

    return make


def test_the_long_run_says_when_a_run_that_stops_would_have_stopped(pgmorl):
    whole = pgmorl("whole")
    fronts = [whole.values[list(generation.front)] for generation in whole.generations]
    for generation in (1, 2, 3):
        new = [row for row in fronts[generation].tolist() if row not in fronts[generation - 1].tolist()]
        target = np.array(new[0]) - 1e-4
        hit = reached(whole, target)
        listed = ",".join(f"{value:.7g}" for value in target)
        stopped = pgmorl(f"stops-{generation}", user=f"target={listed}")
        assert hit.generation == generation
        assert (stopped.reason, stopped.steps[-1]) == ("satisfied", hit.steps)
        assert stopped.generations[-1].front == whole.generations[generation].front


def test_with_a_constant_learning_rate_a_run_is_the_beginning_of_a_longer_one(pgmorl, small_config):
    whole = pgmorl("longer")
    assert generations_within(whole, small_config.steps) == len(whole.steps)
    for iterations in (3, 5, 6, 8):
        steps = 4 * 3 * 16 * iterations
        short = pgmorl(f"short-{iterations}", steps=steps)
        count = generations_within(whole, steps)
        assert whole.steps[count - 1] == short.steps[-1]
        assert [each.front for each in whole.generations[:count]] == [each.front for each in short.generations]
        np.testing.assert_array_equal(whole.values[: len(short.values)], short.values)
        np.testing.assert_array_equal(pooled_front([whole], steps), pooled_front([short], steps))

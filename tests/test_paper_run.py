"""A whole run in paper units: untrained agents count, both kinds of values are kept, and it resumes bit for bit."""

import jax
import numpy as np
import pytest

import envs
from jmorl.events import GenerationFinished
from jmorl.learning.population import Population
from jmorl.loop import evaluation_keys
from jmorl.scoring import paper_scores
from jmorl.search.policy import values_of
from jmorl.storage.policy_file import load_policy
from jmorl.storage.resume import Continued
from jmorl.storage.run_folder import RunFolder
from jmorl.storage.stored_run import read_run
from jmorl.units import initial_units
from tests.resuming import go_on, outcome, train


@pytest.fixture(scope="module")
def paper_config(small_config):
    return small_config.replace(evaluation={"units": "paper", "actions": "sampled", "scale_discount": 0.9})


@pytest.fixture(scope="module")
def paper_run(paper_config, tmp_path_factory):
    """The folder of an uninterrupted run and its generations."""
    path = tmp_path_factory.mktemp("runs") / "paper"
    continued = Continued(RunFolder.create(path, paper_config, envs.make(paper_config.env)), None)
    with continued.folder:
        events = list(continued.events())
    return path, [event for event in events if isinstance(event, GenerationFinished)]


@pytest.mark.parametrize("events", [1, 2, 3, 5, 8])
def test_a_run_in_paper_units_resumes_bit_for_bit(paper_run, paper_config, tmp_path, events):
    path = train(tmp_path / "run", paper_config, events=events)
    go_on(path)
    assert outcome(path) == outcome(paper_run[0])


def test_the_scores_are_those_of_one_scorer_fed_in_order(paper_run, paper_config):
    """Untrained agents first, then one generation after the other, from the policies' own train states."""
    population = Population(envs.make(paper_config.env), paper_config.learning)
    units = initial_units(3)
    policies = [policy for event in paper_run[1] for policy in event.offspring]
    for first in range(0, len(policies), 4):
        train_states = jax.tree.map(
            lambda *leaves: np.stack(leaves), *(p.snapshot for p in policies[first : first + 4])
        )
        returns = population.evaluate(train_states, evaluation_keys(paper_config, first))
        scores, units = paper_scores(returns, units, paper_config.ppo.discount, 0.9)
        np.testing.assert_allclose(scores.values, values_of(policies[first : first + 4]), rtol=1e-5)
        np.testing.assert_allclose(scores.raw, [policy.raw for policy in policies[first : first + 4]], rtol=1e-5)
    np.testing.assert_allclose(units.deviation, paper_run[1][-1].state.units.deviation, rtol=1e-5)


def test_untrained_agents_come_first_and_count(paper_run):
    path, generations = paper_run
    assert [len(event.offspring) for event in generations] == [8, 4, 4, 4]
    untrained = generations[0].offspring[:4]
    assert {policy.id for policy in untrained} == {0, 1, 2, 3}
    assert set(untrained) & set(generations[0].state.search.buffer.members)
    assert [event.state.evaluation_steps for event in generations] == [4 * 2 * 10 * done for done in (2, 3, 4, 5)]
    stored = read_run(path)
    assert [policy.id for policy in stored.policies] == list(range(20))


def test_sampled_actions_start_afresh_in_every_evaluation(paper_config, small_config):
    def words(config, evaluated):
        return jax.random.key_data(evaluation_keys(config, evaluated)).tolist()

    assert words(paper_config, 0) != words(paper_config, 4)
    assert words(small_config, 0) == words(small_config, 4)


def test_sigma_and_raw_returns_are_on_the_disk(paper_run):
    path, generations = paper_run
    stored = read_run(path)
    for index, name in enumerate(("north", "east", "west")):
        expected = [event.state.units.deviation[index] for event in generations]
        np.testing.assert_array_equal(stored.metrics[f"sigma_{name}"], expected)
    policy = generations[-1].offspring[0]
    np.testing.assert_array_equal(stored.policies[policy.id].raw, policy.raw)
    assert not np.allclose(policy.raw, policy.values)
    chosen = stored.chosen
    header = load_policy(path / "chosen.npz").header
    assert header["values"] == chosen.raw.tolist() and header["score"] == chosen.values.tolist()
    assert {objective.unit for objective in stored.objectives} == {"running deviations"}


def test_in_raw_units_there_is_neither(whole):
    stored = read_run(whole)
    assert np.isnan(stored.metrics["sigma_north"]).all()
    assert all(policy.raw is None for policy in stored.policies)


def test_actions_and_units_are_separate_choices(small_config, tmp_path):
    """Deterministic in paper units, and sampled in raw ones."""
    one = train(tmp_path / "one", small_config.replace(evaluation={"units": "paper"}))
    other = train(tmp_path / "other", small_config.replace(evaluation={"actions": "sampled"}))
    assert len(read_run(one).policies) == 20 and len(read_run(other).policies) == 16
    assert outcome(one)[2] != outcome(other)[2]

"""Confirmed scores: from fresh starts, of the finalists, before the last question, and in everything a run leaves."""

import json
import shutil
from dataclasses import replace

import jax
import numpy as np
import pytest

import envs
from jmorl.confirmation import confirmed, finalists
from jmorl.decision.answers import Answer
from jmorl.decision.protocol import DecisionMaker
from jmorl.events import Decided, GenerationFinished, RunFinished
from jmorl.experiments.record import record_of
from jmorl.learning.population import Population
from jmorl.loop import run
from jmorl.report.progress import watcher
from jmorl.report.tables import run_tables
from jmorl.storage.policy_file import load_policy
from jmorl.storage.stored_run import StoredRunError, read_run
from tests.resuming import train

EPISODES = 8


@pytest.fixture(scope="module")
def config(small_config):
    return small_config.replace(evaluation={"confirmation_episodes": EPISODES})


@pytest.fixture(scope="module")
def events(config):
    return list(run(config))


@pytest.fixture(scope="module")
def folder(config, tmp_path_factory):
    return train(tmp_path_factory.mktemp("runs") / "confirmed", config)


def test_the_last_question_shows_confirmed_scores_of_all_finalists(events):
    final = [event for event in events if isinstance(event, Decided)][-1]
    archive = {policy.id: policy for policy in events[-1].state.archive.members}
    assert final.question.purpose == "final" and len(final.question.shown) > 1
    for policy in final.question.shown:
        found = policy.confirmation
        assert found.episodes == EPISODES
        np.testing.assert_array_equal(found.claimed, archive[policy.id].values)
        assert not np.array_equal(policy.values, found.claimed)
    assert events[-1].chosen is final.chosen


def test_what_is_trained_before_does_not_depend_on_it(events, small_config):
    plain = list(run(small_config))
    pairs = [
        (one.state.archive.values, other.state.archive.values)
        for one, other in zip(plain, events, strict=True)
        if isinstance(one, GenerationFinished)
    ]
    assert len(pairs) == 4
    for one, other in pairs:
        np.testing.assert_array_equal(one, other)
    assert plain[-1].chosen.confirmation is None


def test_steps_of_confirmations_are_counted(events, config):
    before, after = [event.state for event in events if isinstance(event, GenerationFinished)][-1], events[-1].state
    finalists = [event for event in events if isinstance(event, Decided)][-1].question.shown
    length = (after.evaluation_steps - before.evaluation_steps) / (4 * -(-len(finalists) // 4) * EPISODES)
    assert length == envs.make(config.env).time_limit


def test_the_score_is_that_of_the_policy_alone(events, config):
    """Mean, spread and error of episodes from the starts that the key gives, whoever is scored beside it."""
    policies = events[-1].state.archive.members
    population = Population(envs.make(config.env), config.learning)
    key = jax.random.key(3)
    together, _ = confirmed(policies, population, key, 5, 2)
    [alone], _ = confirmed(policies[1:2], population, key, 5, 2)
    assert alone.confirmation.episodes == 6  # whole calls of 2
    np.testing.assert_allclose(alone.values, together[1].values, rtol=1e-6)
    returns = episodes_of(policies[1:2], population, key, calls=3, at_once=2)[0]
    np.testing.assert_allclose(alone.std, returns.std(axis=0), rtol=1e-4)
    oddest = np.abs(returns - returns.mean(axis=0)).max(axis=0)
    error = 2.5758 * np.sqrt((alone.std**2 + oddest**2 / 6) / 5)
    np.testing.assert_allclose(alone.confirmation.error, error, rtol=1e-4)


def test_the_error_allows_for_what_happened_to_the_others(events, config):
    """A policy may do on other starts what a policy beside it was seen to do."""
    policies = events[-1].state.archive.members
    population = Population(envs.make(config.env), config.learning)
    key = jax.random.key(3)
    returns = episodes_of(policies, population, key, calls=3, at_once=2)
    apart = np.abs(returns - returns.mean(axis=1, keepdims=True)).max(axis=1)  # [N, M]
    calmest, oddest = np.argmin(apart[:, 0]), apart.max(axis=0)
    together, _ = confirmed(policies, population, key, 5, 2)
    error = 2.5758 * np.sqrt((returns[calmest].std(axis=0) ** 2 + oddest**2 / 6) / 5)
    np.testing.assert_allclose(together[calmest].confirmation.error, error, rtol=1e-4)
    [alone], _ = confirmed([policies[calmest]], population, key, 5, 2)
    assert alone.confirmation.error[0] < together[calmest].confirmation.error[0]


def episodes_of(policies, population, key, calls, at_once):
    """Returns [N, calls * at_once, M] of the policies, played one after the other."""
    found = []
    for policy in policies:
        agents = jax.tree.map(lambda leaf: np.stack([leaf] * population.size), policy.snapshot)
        each = [
            population.evaluate(agents, jax.random.split(jax.random.fold_in(key, call), at_once)).undiscounted[0]
            for call in range(calls)
        ]
        found.append(np.concatenate(each))
    return np.array(found, np.float64)


def test_a_run_that_somebody_stops_confirms_its_result(config):
    class Stopper(DecisionMaker):
        def answer(self, question):
            return Answer(question.front[0].id, stop=True)

    end = list(run(config, Stopper()))[-1]
    assert isinstance(end, RunFinished) and end.reason == "stopped" and end.chosen.confirmation.episodes == EPISODES


def test_scores_in_drifting_units_are_not_confirmed(config):
    paper = config.replace(evaluation={"units": "paper", "actions": "sampled"})
    assert list(run(paper))[-1].chosen.confirmation is None


def test_few_are_all_finalists_and_of_many_those_near_the_choice_and_some_of_everywhere(events):
    some = events[-1].state.archive.members[0]

    def at(x):
        return replace(some, values=np.array([x, -x, 0.0]))

    few = [at(x) for x in range(4)]
    assert finalists(few, None, 1) == few
    # One is far out, and would hide what lies between the others.
    front = [at(x) for x in (0.0, 0.1, 0.2, 0.3, 4.0, 8.0, 8.1, 8.2, 8.3, -1e6)]
    assert finalists(front, None, 1) == []
    assert [policy.values[0] for policy in finalists(front, front[1], 1)] == [0.0, 0.1, 8.3, -1e6]
    assert [policy.values[0] for policy in finalists(front[:-1], front[1], 1)] == [0.0, 0.1, 4.0, 8.3]


def test_everything_that_a_run_leaves_has_both_scores(folder):
    stored = read_run(folder)
    result = json.loads((folder / "result.json").read_text())["chosen"]
    chosen, found = stored.chosen, stored.chosen.confirmation
    assert found.episodes == result["confirmation_episodes"] == EPISODES
    assert chosen.values[0] == result[f"value_{stored.objectives[0].name}"]
    np.testing.assert_array_equal(found.claimed, stored.policies[chosen.id].values)
    header = load_policy(folder / "chosen.npz").header
    assert header["values"] == chosen.values.tolist() and header["evaluation_episodes"] == EPISODES
    confirmed = record_of(stored).confirmed
    np.testing.assert_allclose(confirmed.values, chosen.values, rtol=1e-6)
    np.testing.assert_allclose(confirmed.error, found.error, rtol=1e-6)


def test_people_are_told(folder, events, config, capsys):
    from rich.console import Console

    console = Console(width=200)
    for table in run_tables(read_run(folder)):
        console.print(table)
    told = capsys.readouterr().out
    assert "the mean of 8 fresh episodes, 99 % sure" in told and "in the search it was" in told
    from jmorl.display.console import PlainConsole

    watcher("lines", config, envs.make(config.env).objectives, PlainConsole()).show(events[-1])
    assert "the mean of 8 fresh episodes, 99 % sure" in capsys.readouterr().out


def test_a_result_that_lost_part_of_its_confirmed_score_is_named(folder, tmp_path):
    path = tmp_path / "damaged"
    shutil.copytree(folder, path)
    result = json.loads((path / "result.json").read_text())
    del result["chosen"][next(name for name in result["chosen"] if name.startswith("error_"))]
    (path / "result.json").write_text(json.dumps(result))
    with pytest.raises(StoredRunError, match="result.json cannot be read: it has no 'error_"):
        read_run(path)

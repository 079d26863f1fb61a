"""Fixed weights: every agent is trained on, by itself, with what it began with."""

import numpy as np
import pytest

from jmorl import GenerationFinished, run
from jmorl.config import ConfigError


def generations(events):
    return [event for event in events if isinstance(event, GenerationFinished)]


@pytest.fixture(scope="module")
def events(small_config):
    return list(run(small_config.replace(method="fixed")))


def test_every_agent_keeps_its_weights_and_goes_on_from_itself(events):
    warm_up, *later = generations(events)
    assert len(later) == 3
    parents = warm_up.offspring
    for event in later:
        for parent, child in zip(parents, event.offspring, strict=True):
            assert child.parent == parent.id
            np.testing.assert_array_equal(child.weights, parent.weights)
            assert child.predicted is None
        parents = event.offspring


def test_somebody_is_asked_once_at_the_end_about_the_whole_archive(events):
    asked = [event for event in events if hasattr(event, "answer")]
    assert [event.question.purpose for event in asked] == ["final"]
    archived = {policy.id for policy in events[-1].state.archive.members}
    assert {policy.id for policy in asked[0].question.whole.front} == archived
    assert all(event.generations_to_question is None for event in generations(events))


def test_weights_may_be_given_and_are_scaled_to_a_sum_of_one(small_config):
    given = (2.0, 1.0, 1.0, 0.0, 0.0, 3.0, 1.0, 1.0, 0.0, 1.0, 1.0, 1.0)
    config = small_config.replace(method="fixed", population={"weights": given}, steps=4 * 3 * 16 * 3)
    last = generations(list(run(config)))[-1]
    expected = [[0.5, 0.25, 0.25], [0, 0, 1], [0.5, 0.5, 0], [1 / 3, 1 / 3, 1 / 3]]
    np.testing.assert_allclose([policy.weights for policy in last.offspring], expected)


@pytest.mark.parametrize(
    ("weights", "problem"),
    [
        ((1.0, 2.0), "weights has 2 numbers, but 4 agents with 3 objectives need 12"),
        ((0.0,) * 3 + (1.0,) * 9, "weights has an agent with nothing but zeros"),
        ((-1.0,) * 12, "population.weights.0: "),
    ],
)
def test_weights_that_cannot_be_are_refused(small_config, weights, problem):
    with pytest.raises(ConfigError, match=problem):
        small_config.replace(population={"weights": weights})


def test_a_resumed_run_is_the_uninterrupted_one(small_config, tmp_path):
    from tests.resuming import go_on, outcome, train

    config = small_config.replace(method="fixed")
    whole = train(tmp_path / "whole", config)
    path = train(tmp_path / "interrupted", config, events=3)
    go_on(path)
    assert outcome(path) == outcome(whole)

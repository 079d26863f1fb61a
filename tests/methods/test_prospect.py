"""What a choice is said to mean is what comes of it."""

from dataclasses import replace

import numpy as np
import pytest

import envs
from jmorl.events import Decided, GenerationFinished
from jmorl.loop import make_method, run
from jmorl.methods.pgmorl import PGMORL
from jmorl.search.bounds import within
from jmorl.search.prediction import Prediction, Records


def prospect(config, state, policy):
    return make_method(config, envs.make(config.env)).prospect(state, policy)


@pytest.fixture(scope="module")
def events(small_config):
    return list(run(small_config))


def test_a_prospect_is_what_the_choice_brings(events, small_config):
    """Every choice of a run, with the state it was made in: the same bounds, and predictions the run then made."""
    told = 0
    for before, decided, after in zip(events, events[1:], events[2:], strict=False):
        if isinstance(decided, Decided) and isinstance(after, GenerationFinished):
            assert isinstance(before, GenerationFinished)
            seen = prospect(small_config, before.state, decided.chosen)
            np.testing.assert_array_equal(seen.bounds, decided.bounds)
            np.testing.assert_array_equal(seen.kept, within(before.state.archive.values, decided.bounds))
            assert within(seen.expected, decided.bounds).all()
            for child in after.offspring:  # nothing that the run expected within the bounds beats what was told
                if within(child.predicted[None], decided.bounds)[0]:
                    assert (seen.expected >= child.predicted - 1e-6).all(axis=1).any()
            told += 1
    assert told == 3


def test_nothing_is_expected_that_cannot_be(events, small_config, monkeypatch):
    """Whatever curves say, no return of a cost is above zero."""
    state = next(event.state for event in events[::-1] if isinstance(event, GenerationFinished))
    beyond = Prediction(np.full((1, 1, 3), 1e9), np.ones((1, 3)))
    monkeypatch.setattr(PGMORL, "prediction", lambda *_: beyond)
    method = make_method(small_config, envs.make(small_config.env))
    costs = tuple(replace(objective, highest=1e6) for objective in method.problem.objectives[1:])
    method.problem = replace(method.problem, objectives=(method.problem.objectives[0], *costs))
    np.testing.assert_array_equal(method.prospect(state, state.archive.members[0]).expected, [[1e9, 1e6, 1e6]])


def test_odds_are_those_of_what_came():
    nothing = np.zeros((48, 2))
    surprises = np.resize([[1.0, 1.0], [1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0], [2.0, 2.0]], (48, 2))
    assert Records.empty(2).odds() == Records.empty(2).add(nothing, nothing, nothing).odds() == 0.25
    assert Records.empty(2).add(nothing, nothing, nothing, surprises).odds() == pytest.approx(0.4, abs=0.03)


def test_a_choice_rules_itself_in(events, small_config):
    state = next(event.state for event in events if isinstance(event, GenerationFinished))
    for index, policy in enumerate(state.archive.members):
        assert prospect(small_config, state, policy).kept[index]


def test_without_slack_only_what_is_at_least_as_good_is_kept(events, small_config):
    """On a front nothing is at least as good as another member."""
    state = next(event.state for event in events if isinstance(event, GenerationFinished))
    config = small_config.replace(search={"delta": 0.0, "least_within": 0, "least_slack": 0.0})
    for policy in state.archive.members:
        assert prospect(config, state, policy).kept.sum() == 1

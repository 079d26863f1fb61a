"""What a choice is said to mean is what comes of it."""

import numpy as np
import pytest

import envs
from jmorl.events import Decided, GenerationFinished
from jmorl.loop import make_method, run
from jmorl.search.bounds import within


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


def test_a_choice_rules_itself_in(events, small_config):
    state = next(event.state for event in events if isinstance(event, GenerationFinished))
    for index, policy in enumerate(state.archive.members):
        assert prospect(small_config, state, policy).kept[index]


def test_without_slack_only_what_is_at_least_as_good_is_kept(events, small_config):
    """On a front nothing is at least as good as another member."""
    state = next(event.state for event in events if isinstance(event, GenerationFinished))
    config = small_config.replace(search={"delta": 0.0})
    for policy in state.archive.members:
        assert prospect(config, state, policy).kept.sum() == 1

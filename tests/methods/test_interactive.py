"""The interactive method's bounds: as in the paper, or giving way where too little lies within."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import envs
from jmorl import Decided, GenerationFinished, read_run, run
from jmorl.loop import make_method
from jmorl.search.bounds import within
from jmorl.search.policy import values_of
from tests.resuming import go_on, outcome, train

WIDE = {"delta": 1e-3, "least_within": 3, "least_slack": 0.01, "outside_share": 0.5}


@pytest.fixture(scope="module")
def config(small_config):
    return small_config.replace(search=WIDE, steps=4 * 3 * 16 * 17)


@pytest.fixture(scope="module")
def events(config):
    return list(run(config))


def generations(events):
    return [event for event in events if isinstance(event, GenerationFinished)]


def test_enough_of_the_buffer_lies_within_after_every_choice_and_every_generation(events):
    """As far as seven widenings go."""
    seen = set()
    for event in generations(events)[1:]:
        search = event.state.search
        enough = within(values_of(search.buffer.members), search.bounds).sum() >= 3
        assert enough or search.widenings == 7
        assert event.search["widenings"] == search.widenings
        seen.add(search.widenings)
    assert max(seen) > 0


def test_the_papers_bounds_never_give_way(small_config):
    events = list(run(small_config.replace(search={"delta": 1e-3})))
    decided = None
    for event in events:
        if isinstance(event, Decided):
            decided = event
        elif isinstance(event, GenerationFinished) and decided:
            np.testing.assert_array_equal(event.bounds, decided.bounds)
            assert event.search["widenings"] == 0


def test_the_choice_always_lies_within(events):
    for event in events:
        if isinstance(event, Decided) and event.question.purpose == "steer":
            assert within(event.chosen.values[None], event.bounds).all()


def test_while_the_choice_stays_some_tasks_lie_anywhere(config, events):
    """Two of four, from the third generation with the same choice on."""
    method: Any = make_method(config, envs.make(config.env))
    state = replace(generations(events)[-1].state, generation=9)
    stayed = replace(state, search=replace(state.search, generations_with_choice=2))
    moved = replace(state, search=replace(state.search, generations_with_choice=1))
    unbounded = replace(stayed, choice=None, search=replace(stayed.search, bounds=np.full(3, -np.inf)))
    anywhere = method.selected(unbounded, list(state.search.buffer.members), 2, np.random.default_rng([config.seed, 9]))
    tasks, bounded = method.tasks(stayed), method.tasks(moved)
    assert len(tasks.parents) == len(bounded.parents) == 4
    np.testing.assert_array_equal(tasks.weights[2:], anywhere.weights)
    assert [parent.id for parent in tasks.parents[2:]] == [parent.id for parent in anywhere.parents]
    inside = {policy.id for policy in method.candidates(moved)}
    assert {parent.id for parent in bounded.parents} <= inside


def test_such_a_run_resumes_to_the_same_result(config, tmp_path):
    whole = train(tmp_path / "whole", config)
    path = train(tmp_path / "broken", config, events=7)
    go_on(path)
    assert outcome(path) == outcome(whole)
    assert max(read_run(path).metrics["widenings"][1:]) > 0

"""The interactive method's bounds: as in the paper, or giving way where too little lies within."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import envs
from jmorl import Decided, GenerationFinished, read_run, run
from jmorl.decision.protocol import Answer
from jmorl.loop import make_method
from jmorl.search.bounds import within
from jmorl.search.policy import values_of
from tests.resuming import Counting, go_on, outcome, train

WIDE = {"delta": 1e-3, "least_within": 3, "least_slack": 0.01, "outside_share": 0.5}


@pytest.fixture(scope="module")
def config(small_config):
    return small_config.replace(search=WIDE, steps=4 * 3 * 16 * 17, ask="always", question="front")


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
    events = list(run(small_config.replace(search={"delta": 1e-3, "least_within": 0, "least_slack": 0.0})))
    decided = None
    for event in events:
        if isinstance(event, Decided):
            decided = event
        elif isinstance(event, GenerationFinished) and decided:
            np.testing.assert_array_equal(event.bounds, decided.bounds)
            assert event.search["widenings"] == 0


def test_what_is_told_of_a_generation_are_the_bounds_in_force_in_it(events):
    decided = [event for event in events if isinstance(event, Decided) and event.question.purpose == "steer"]
    for before, after in zip(decided, generations(events)[1:], strict=True):
        np.testing.assert_array_equal(before.bounds, after.bounds)


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


# --- limits ---------------------------------------------------------------------------------------------------------

FROM = 2  # the generation before which the user sets a limit


class Limiting(Counting):
    """The config's user, who from a generation on wants at least half of what they have in the first objective."""

    def __init__(self, config):
        super().__init__(config)
        self.limits = None

    def answer(self, question):
        right = super().answer(question)
        values = question.values
        if question.generation == FROM and question.purpose == "steer":
            self.limits = (float(np.median(values[:, 0])), -np.inf, -np.inf)
        if question.limits is None and self.limits is None:
            return right
        limits = question.limits or self.limits
        worth = np.where(within(values, np.array(limits)), self.user.utility(values), -np.inf)
        chosen = question.front[int(worth.argmax())].id if np.isfinite(worth).any() else right.policy
        return replace(right, policy=chosen, limits=self.limits if question.limits is None else None)


@pytest.fixture(scope="module")
def limited(config):
    return list(run(config, Limiting(config)))


def steering(events):
    return [event for event in events if isinstance(event, Decided) and event.question.purpose == "steer"]


def test_limits_hold_from_the_answer_that_sets_them(limited):
    asked = steering(limited)
    (limits,) = (event.answer.limits for event in asked if event.answer.limits)
    for event in asked:
        assert event.question.limits == (limits if event.question.generation > FROM else None)
    last: Any = limited[-2]
    assert last.question.purpose == "final" and last.question.limits == limits
    assert limited[-1].state.search.limits == limits


def test_bounds_that_give_way_stop_at_the_limits_where_the_choice_reaches_them(config, limited):
    checked = 0
    for event in generations(limited):
        state: Any = event.state
        if state.search.limits is None:
            continue
        chosen, spans = state.choice.values, np.ptp(state.archive.values, axis=0)
        unit = spans if config.search.bounds_scale == "range" else np.ones(3)
        slack = np.maximum(WIDE["delta"] * np.sqrt(unit * np.abs(chosen)), WIDE["least_slack"] * spans)
        limit = state.search.limits[0]
        assert chosen[0] >= limit and state.search.bounds[0] >= limit - slack[0] - 1e-9
        checked += chosen[0] - 2**state.search.widenings * slack[0] < limit - slack[0]
    assert checked  # without the limit the bounds would have gone on


def test_the_last_question_shows_what_reaches_the_limits_if_anything_does(config, events):
    method: Any = make_method(config, envs.make(config.env))
    state = generations(events)[-1].state
    state = replace(state, search=replace(state.search, bounds=np.full(3, -np.inf)))

    def shown(limits):
        return [policy.id for policy in method.final_front(replace(state, search=replace(state.search, limits=limits)))]

    everything = [policy.id for policy in state.archive.members]
    limits = (-np.inf, float(np.median(state.archive.values[:, 1])), -np.inf)
    reaching = [policy.id for policy in state.archive.members if policy.values[1] >= limits[1]]
    assert 0 < len(reaching) < len(everything)
    assert shown(limits) == reaching
    assert shown(None) == shown((np.inf, 0.0, 0.0)) == shown((-np.inf,) * 3) == everything


def test_the_last_question_of_a_run_keeps_to_the_limits(limited):
    state = generations(limited)[-1].state
    archived = {policy.id: policy.values for policy in state.archive.members}
    question: Any = limited[-2].question
    values = np.stack([archived[policy.id] for policy in question.whole.front])
    assert within(values, np.array(question.limits)).all()


def test_new_limits_take_the_place_of_all_that_were_set_and_none_leaves_them(config, limited):
    method: Any = make_method(config, envs.make(config.env))
    state = generations(limited)[-1].state
    question = steering(limited)[-1].question
    for limits in ((-np.inf, 5.0, -np.inf), (-np.inf,) * 3):
        assert method.answered(state, question, Answer(state.choice.id, limits=limits)).limits == limits
    assert method.answered(state, question, Answer(state.choice.id)).limits == state.search.limits


def test_a_run_with_limits_resumes_to_the_same_result(config, tmp_path):
    whole = train(tmp_path / "whole", config, user=Limiting(config))
    path = train(tmp_path / "broken", config, user=Limiting(config), events=8)
    go_on(path, user=Limiting(config))
    assert outcome(path) == outcome(whole)


class Slips(Counting):
    """Stays with one policy as long as it can; once names another one, and takes that back."""

    def __init__(self, config, at):
        super().__init__(config)
        self.at = at

    def answer(self, question):
        right = super().answer(question)
        ids = [policy.id for policy in question.front]
        kept = question.previous if question.previous in ids else right.policy
        slips = question.generation == self.at and not question.again
        return Answer(next(each for each in ids if each != kept) if slips else kept)

    def follow_up(self, question, answer):
        slipped = question.generation == self.at and not question.again
        return replace(question, again=True) if slipped else None


def test_a_slip_that_is_taken_back_at_once_leaves_the_run_as_it_was(config):
    without, slipped = (list(run(config, Slips(config, at))) for at in (None, 4))
    assert len([event for event in slipped if isinstance(event, Decided)]) == 1 + len(
        [event for event in without if isinstance(event, Decided)]
    )
    assert max(event.state.search.generations_with_choice for event in generations(without)) > 3
    for event, other in zip(generations(without), generations(slipped), strict=True):
        assert other.state.choice is None or other.state.choice.id == event.state.choice.id
        assert other.state.search.generations_with_choice == event.state.search.generations_with_choice
        np.testing.assert_array_equal(other.state.search.bounds, event.state.search.bounds)

"""The interactive method's bounds: as in the paper, or giving way where too little lies within."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import envs
from jmorl import Decided, GenerationFinished, read_run, run
from jmorl.decision.answers import Answer
from jmorl.loop import make_method
from jmorl.search.bounds import LIMIT_WIDENINGS, within
from jmorl.search.policy import values_of
from jmorl.search.scouts import ENDURANCE, Scouts
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


def test_while_the_choice_stays_some_tasks_train_scouts_towards_it(config, events):
    """Two of four, from the third generation with the same choice on."""
    method: Any = make_method(config, envs.make(config.env))
    state = replace(generations(events)[-1].state, generation=9)
    policies = state.archive.members
    idle = Scouts(starts=(policies[0], policies[-1], policies[1]), sent=2)
    stayed = replace(state, search=replace(state.search, generations_with_choice=2, scouts=idle))
    moved = replace(state, search=replace(state.search, generations_with_choice=1, scouts=idle))
    tasks, bounded = method.tasks(stayed), method.tasks(moved)
    assert len(tasks.parents) == len(bounded.parents) == 4
    assert tasks.parents[2:] == [policies[1], policies[0]]
    inside = method.candidates(moved)
    assert all(parent in inside for parent in (*tasks.parents[:2], *bounded.parents))
    # Their weights are those for which the choice loses least, in values scaled by range.
    span = np.ptp(state.archive.values, axis=0)
    lost = [
        ((state.archive.values - state.choice.values) / np.where(span > 0, span, 1) @ weights).max()
        for weights in method.candidate_weights()
    ]
    for weights in tasks.weights[2:]:
        np.testing.assert_array_equal(weights, method.candidate_weights()[np.argmin(lost)])
    expected = method.prediction(stayed, tasks.parents[2:]).expected[:, np.argmin(lost)]
    np.testing.assert_array_equal(tasks.predicted[2:], expected)


def test_scouts_go_on_for_their_generations_also_if_the_choice_moves(config, events):
    """Their children become the scouts of the next generation."""
    method: Any = make_method(config, envs.make(config.env))
    state = replace(generations(events)[-1].state, generation=9)
    policies = state.archive.members
    underway = Scouts(starts=policies[:2], underway=policies[2:4], generations=ENDURANCE - 2, sent=5)
    search = replace(state.search, generations_with_choice=0, scouts=underway)
    for underway_after in (policies[-2:], ()):
        run = replace(state, search=search)
        tasks = method.tasks(run)
        assert tuple(tasks.parents[2:]) == search.scouts.underway
        search = method.taken_in(run, [*policies[:2], *policies[-2:]], tasks)
        assert search.scouts.underway == underway_after
    search = replace(search, generations_with_choice=0)
    assert search.scouts == Scouts(policies[:2], sent=5)
    inside = method.candidates(replace(state, search=search))
    assert all(parent in inside for parent in method.tasks(replace(state, search=search)).parents)


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
        doubled = max(state.search.widenings, LIMIT_WIDENINGS)
        checked += chosen[0] - 2**doubled * slack[0] < limit - slack[0]
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


def test_the_last_question_leaves_out_what_lies_outside_the_bounds_only_where_they_never_give_way(config, events):
    state = generations(events)[-1].state
    bounds = np.array([float(np.median(state.archive.values[:, 0])), -np.inf, -np.inf])
    state = replace(state, search=replace(state.search, bounds=bounds))
    for least_within, kept in ((3, np.full(3, -np.inf)), (0, bounds)):
        method: Any = make_method(config.replace(search={"least_within": least_within}), envs.make(config.env))
        shown = [policy.id for policy in method.final_front(state)]
        assert shown == [policy.id for policy in state.archive.members if within(policy.values[None], kept).all()]


def test_the_last_question_of_a_run_keeps_to_the_limits(limited):
    state = generations(limited)[-1].state
    archived = {policy.id: policy.values for policy in state.archive.members}
    question: Any = limited[-2].question
    values = np.stack([archived[policy.id] for policy in question.front])
    assert within(values, np.array(question.limits)).all()
    assert {policy.id for policy in question.whole.front} == archived.keys()  # whoever asks for the others sees them


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


# --- scouts -----------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def stagnating(config):
    return list(run(config, Slips(config, None)))


def test_scouts_start_from_the_warm_up_and_go_on_from_their_children(stagnating):
    warm_up, *later = generations(stagnating)
    starts = warm_up.state.search.scouts.starts
    assert starts == tuple(warm_up.offspring)
    before, first = warm_up, True
    for event in later:
        scouts = event.state.search.scouts
        assert scouts.starts == starts
        if scouts.underway:
            assert scouts.underway == tuple(event.offspring[2:])
            parents = [policy.parent for policy in scouts.underway]
            came_from = starts[:2] if first else before.state.search.scouts.underway
            assert parents == [policy.id for policy in came_from]
            first = False
        before = event
    assert not first


def test_a_run_with_scouts_underway_resumes_to_the_same_result(config, stagnating, tmp_path):
    whole = train(tmp_path / "whole", config, user=Slips(config, None))
    underway = [event for event in stagnating if isinstance(event, GenerationFinished)][-2]
    assert underway.state.search.scouts.underway
    path = train(tmp_path / "broken", config, user=Slips(config, None), events=stagnating.index(underway) + 1)
    go_on(path, user=Slips(config, None))
    assert outcome(path) == outcome(whole)

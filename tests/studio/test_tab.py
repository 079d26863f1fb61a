"""What somebody at one tab sees and can do, without a browser."""

import asyncio
import json

import numpy as np
import pytest

from jmorl.decision.answers import Answer, Choose
from jmorl.studio import texts
from jmorl.studio.tab import Tab


class Watching:
    """A tab, with what it has said and how often it was shown."""

    def __init__(self, session):
        self.said, self.shown = [], 0
        self.tab = Tab(session, self._show, lambda text, tone: self.said.append((tone, text)))

    def _show(self):
        self.shown += 1


@pytest.fixture
def question(session):
    return session.question()


@pytest.fixture
def watching(session, question):
    """Open a tab that shows the first question."""
    return Watching(session)


@pytest.fixture
def tab(watching):
    return watching.tab


def order(front, objective):
    return [policy.id for policy in sorted(front, key=lambda policy: policy.values[objective])]


def chosen(session):
    lines = (session.view.path / "decisions.jsonl").read_text().splitlines()
    return [json.loads(line)["policy"] for line in lines]


def test_a_late_answer_is_told_that_the_question_is_answered(session, question, watching):
    first, second = question.front[0].id, question.front[-1].id
    other = Watching(session)
    other.tab.choose(first)
    watching.tab.choose(second)
    watching.tab.choose(second)  # a second click says nothing more
    assert watching.said == [
        ("warning", "This question is already answered, in another tab; nothing has changed."),
    ]
    assert not other.said
    session.question()
    assert chosen(session) == [first]


def test_a_tab_is_told_once_what_was_chosen_in_another(session, question, watching):
    first = question.front[0].id
    session.answer(question, Answer(first))
    session.question()
    watching.tab.follow()
    watching.tab.follow()
    assert watching.said == [("warning", f"Policy {first} was chosen, in another tab.")]


def test_the_own_answer_is_no_news(session, question, watching):
    watching.tab.choose(question.front[0].id)
    session.question()
    watching.tab.follow()
    assert not watching.said and watching.tab.view.question.generation == 2


def test_what_cannot_be_chosen_is_no_answer(session, question, watching):
    watching.tab.choose(99)
    assert watching.said == [("hint", "Policy 99 is not among those you can choose from.")]
    assert session.view.question is question
    session.answer(question, Answer(question.front[0].id, stop=True))
    session.ended()
    watching.tab.follow()
    watching.said.clear()
    watching.tab.keep()
    assert watching.said == [("warning", "No question is open: it is already answered, or still to come.")]


def test_generations_without_a_question_are_asked_for_anew_each_time(session, question, tab):
    tab.go_on_for(2)
    tab.follow()
    assert tab.generations == 2
    tab.choose(question.front[0].id)
    assert session.question().generation == 3
    tab.follow()
    assert tab.generations == 1
    tab.go_on_for(0)
    assert tab.generations == 1


def test_keeping_chooses_the_last_choice_again(session, question, tab):
    tab.keep()  # there is none yet
    assert session.view.question is question
    tab.choose(question.front[0].id)
    session.question()
    tab.follow()
    tab.keep()
    session.question()
    assert chosen(session) == [question.front[0].id] * 2


def test_one_looks_along_the_axis_to_the_right_and_stops_at_its_ends(question, tab):
    right = order(question.front, 0)
    for step, expected in ((1, right[0]), (1, right[1]), (-1, right[0]), (-1, right[0])):
        tab.look_along(step)
        assert tab.selection.focus == expected
    tab.turn_axes((2, 1))
    tab.look_at(order(question.front, 2)[-1])
    tab.look_along(1)
    assert tab.selection.focus == order(question.front, 2)[-1]


def test_one_looks_along_what_has_more_of_an_objective_only(question, tab):
    upward = order(question.front, 1)
    tab.look_at(upward[0])
    tab.more_of(1)
    assert tab.selection.more_of == 1
    more = [policy for policy in order(question.front, 0) if policy != upward[0]]
    tab.look_along(1)
    assert tab.selection.focus == more[0]
    tab.more_of(1)  # asked for again: all policies
    assert tab.selection.more_of is None


def test_what_is_new_is_shown(watching):
    tab = watching.tab
    commands = [
        tab.follow,
        lambda: tab.turn_axes((1, 2)),
        lambda: tab.turn_to(texts.HISTORY),
        lambda: tab.look_at(tab.view.front[0].id),
        lambda: tab.put_away(tab.view.front[0].id),
    ]
    for count, command in enumerate(commands, start=1):
        command()
        assert watching.shown == count
    tab.turn_to(texts.HISTORY)  # is open
    assert watching.shown == len(commands) and (tab.axes, tab.side) == ((1, 2), texts.HISTORY)


def test_a_policy_that_has_gone_says_so(watching):
    watching.tab.look_at(12345)
    assert watching.said == [("hint", "Policy 12345 is no longer in the front.")]
    assert watching.tab.selection.focus is None


def test_stepping_back_and_opening_say_what_they_wait_for_and_why_they_fail(session, watching):
    tab, run = watching.tab, watching.tab.view.run
    asyncio.run(tab.step_back(run, 1))
    assert tab.view.path.name == "run-2" and watching.said == [("hint", "Stepping back …")]
    session.question()
    tab.follow()
    watching.said.clear()
    asyncio.run(tab.switch("elsewhere"))
    assert watching.said[0] == ("hint", "Opening …")
    assert watching.said[1][0] == "failure" and "'elsewhere' is no run of this history" in watching.said[1][1]
    assert tab.view.path.name == "run-2"


def test_enautilus_is_taken_step_by_step_and_told_when_it_has_moved_on(watching):
    tab = watching.tab
    asyncio.run(tab.begin_dialogue(0, 2))
    assert watching.said[0][0] == "failure" and tab.dialogue is None and tab.point_question is None
    watching.said.clear()
    asyncio.run(tab.begin_dialogue(1, 2))
    begun = tab.dialogue
    assert begun is not None and tab.point_question is begun.question
    asyncio.run(tab.reply(begun, Choose(0)))
    assert getattr(tab.dialogue, "chosen", None) and tab.point_question is None and not watching.said
    asyncio.run(tab.reply(begun, Choose(0)))
    assert watching.said == [("warning", "The dialogue has moved on in another tab; nothing has changed.")]
    tab.undo_reply()
    assert tab.dialogue is begun
    tab.close_dialogue()
    assert tab.dialogue is None


def test_a_pair_is_what_is_laid_out_first(tab, question):
    first, second, third, *_ = [policy.id for policy in question.front]
    assert tab.pair is None
    tab.look_at(second)
    assert tab.pair is None
    tab.look_at(first)
    assert tab.pair == (second, first)
    tab.look_at(third)
    assert tab.pair == (second, first)
    tab.put_away(second)
    assert set(tab.pair) == {first, third}


def test_a_blend_is_scored_and_named(watching, question):
    tab = watching.tab
    first, second = (policy.id for policy in question.front[:2])
    tab.look_at(first)
    tab.look_at(second)
    ends = [asyncio.run(tab.score_between(tab.view.run, first, second, per_cent)) for per_cent in (0, 100)]
    between = asyncio.run(tab.score_between(tab.view.run, first, second, 40))
    assert not np.array_equal(between.mean, ends[0].mean) and not np.array_equal(ends[0].mean, ends[1].mean)
    assert texts.blend_scores(tab.view, between).endswith("over 16 episodes")
    names = [texts.blend_name(tab.selection, (first, second), per_cent) for per_cent in (-10, 0, 40, 100, 120)]
    one, other = f"A (policy {first})", f"B (policy {second})"
    assert names == [
        f"Beyond {one}, away from {other}",
        f"This is {one}",
        f"60 % of {one}, 40 % of {other}",
        f"This is {other}",
        f"Beyond {other}, away from {one}",
    ]


def test_a_blend_of_a_policy_that_is_not_there_is_told_of(watching, question):
    tab = watching.tab
    assert asyncio.run(tab.score_between(tab.view.run, question.front[0].id, 99999, 50)) is None
    assert watching.said == [("failure", "there is no file of policy 99999")]

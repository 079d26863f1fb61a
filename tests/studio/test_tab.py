"""What somebody at one tab sees and can do, without a browser."""

import asyncio
import json
import shutil
from dataclasses import replace

import numpy as np
import pytest

import envs
from jmorl.decision.answers import Answer, Choose
from jmorl.storage.resume import Continued
from jmorl.storage.run_folder import RunFolder
from jmorl.studio import texts, words
from jmorl.studio.selection import last_choice, listed
from jmorl.studio.tab import Tab
from jmorl.studio.view import stored_view
from tests.resuming import train


class Watching:
    """A tab, with what it has said and how often it was shown."""

    def __init__(self, session, kept=None):
        self.said, self.shown, self.renewed = [], 0, 0
        self.tab = Tab(session, self._show, lambda text, tone: self.said.append((tone, text)), kept, self._renew)

    def _renew(self):
        self.renewed += 1

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


def chosen_so_far(session):
    return chosen(session) if (session.view.path / "decisions.jsonl").exists() else []


def lay_out(tab, *policies):
    """Lay out these policies, and no others."""
    for policy in tuple(tab.selection.letters):
        tab.put_away(policy)
    for policy in policies:
        tab.look_at(policy)


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


def test_a_question_begins_with_a_compromise_and_the_ends_of_the_front(question, tab):
    letters = {letter: policy for policy, letter in tab.selection.letters.items()}
    assert letters["B"] == order(question.front, 0)[-1] and letters["C"] == order(question.front, 1)[-1]
    assert tab.selection.focus == letters["A"] and not any(tab.view.is_new(policy) for policy in question.front)


def test_after_an_answer_the_last_choice_is_in_focus_with_new_policies_beside_it(session, question, tab):
    """Whatever was looked at before: the filled button must not lead to a policy that somebody decided against."""
    policy, other = question.front[0].id, question.front[-1].id
    tab.look_at(policy)
    tab.choose(policy)
    tab.look_at(other)
    session.question()
    tab.follow()
    last = last_choice(tab.view)
    assert tab.selection.places["A"] == tab.selection.focus == last.id
    assert last.id == policy or (last.values >= tab.view.previous.values).all()
    beside = [tab.view.policy(tab.selection.places[letter]) for letter in "BC"]
    newcomers = [each for each in tab.view.front if tab.view.is_new(each) and each is not last]
    assert newcomers
    for each, axis in zip(beside, tab.axes, strict=True):
        better = [newcomer for newcomer in newcomers if newcomer.values[axis] > last.values[axis]]
        assert each in better or not set(better) - set(beside)


def test_what_is_looked_at_belongs_to_a_tab_and_outlives_a_reload(session, question):
    kept = {}
    tabs = [Watching(session, kept).tab, Watching(session).tab]
    lay_out(tabs[0], question.front[1].id)
    tabs[1].follow()
    assert tabs[0].selection.letters != tabs[1].selection.letters
    again = Watching(session, kept).tab
    assert again.selection.letters == tabs[0].selection.letters == {question.front[1].id: "A"}
    session.answer(question, Answer(question.front[0].id))
    session.question()
    again = Watching(session, kept).tab  # another question has opened since
    assert again.selection.focus == last_choice(again.view).id


def test_an_end_is_confirmed_once_and_named(session, question, watching):
    tab = watching.tab
    lay_out(tab)
    tab.stop()
    assert watching.tab.ending is None and watching.said[0][0] == "hint"
    tab.choose(question.front[0].id)
    session.question()
    tab.follow()
    last = last_choice(tab.view)
    others = [policy.id for policy in tab.view.front if policy.id != last.id]
    tab.look_at(others[0])
    tab.stop()
    assert tab.ending.policies == (last.id, others[0])
    assert texts.end_with(tab.view, tab.selection, last).startswith(f"End with A, policy {last.id}: north ")
    tab.end(others[1])  # none of those that were asked about
    assert watching.tab.ending is None and session.view.question
    tab.stop()
    tab.do_not_end()
    tab.end(last.id)
    assert session.view.question
    tab.stop()
    tab.end(last.id)
    session.ended()
    assert session.view.result.id == last.id and session.view.reason == "the user ended it"
    tab.follow()
    assert tab.selection.focus == last.id


def test_the_last_answer_is_confirmed_whatever_gives_it(session, question, tab):
    tab.go_on_for(99)
    assert tab.generations == 3  # no more are left
    tab.choose(question.front[0].id)
    final = session.question()
    assert final.purpose == "final"
    tab.follow()
    for give in (tab.keep, lambda: tab.choose(tab.selection.focus)):
        give()
        assert tab.ending.policies == (tab.selection.focus,) and session.view.question is final
        tab.do_not_end()
    tab.keep()
    tab.end(tab.ending.policies[0])
    session.ended()
    assert session.view.result.id == tab.selection.focus


def test_limits_leave_out_what_does_not_reach_them_and_go_with_the_answer(session, question, tab):
    east = order(question.front, 0)
    least = question.policy(east[-2]).values[0]
    tab.limit(0, float(least))
    assert listed(tab.view, tab.selection) == [p.id for p in question.front if p.values[0] >= least]
    assert texts.limits_reached(tab.view, tab.selection) == f"2 of {len(question.front)} policies reach your limits."
    tab.look_along(-1)
    assert tab.selection.focus in east[-2:]
    tab.choose(east[0])  # which they may all the same
    assert session.question().limits == (least, -np.inf, -np.inf)
    tab.follow()
    assert tab.selection.limits == (least, -np.inf, -np.inf)
    tab.view = replace(tab.view, question=None)  # as it is while a generation is trained
    tab.limit(0, -99.0)
    tab.follow()
    assert tab.view.question and tab.selection.limits == (-99.0, -np.inf, -np.inf)
    tab.limit(0, None)
    assert listed(tab.view, tab.selection) is None
    tab.choose(tab.selection.focus)
    assert session.question().limits == (-np.inf,) * 3
    lines = [json.loads(line) for line in (session.view.path / "decisions.jsonl").read_text().splitlines()]
    assert [line["limits"] for line in lines] == [[least, None, None], [None, None, None]]


def test_two_policies_may_be_equal(person_config, make_session, tmp_path):
    session = make_session()
    config = person_config.replace(question="pair")
    session.drive(Continued(RunFolder.create(tmp_path / "run", config, envs.make(config.env)), None))
    question, tab = session.question(), Watching(session).tab
    assert question.form == "pair" and texts.offers_equal(tab.view)
    assert list(tab.selection.letters) == [policy.id for policy in question.front]
    tab.say_equal()
    session.question()
    tab.follow()
    line = json.loads((session.view.path / "decisions.jsonl").read_text())
    assert line["equal"] and {each["policy"] for each in line["shown"]} == {policy.id for policy in question.front}


def test_a_question_may_be_skipped_or_be_about_a_pair_instead(session, question, tab):
    assert texts.offers_pair(tab.view)
    worst = float(np.median(question.values[:, 0]))
    tab.limit(0, worst)
    tab.ask_pair()
    pair = session.question()
    tab.follow()
    assert pair.generation == question.generation and pair.form == "pair" and pair.limits[0] == worst
    assert texts.offers_equal(tab.view) and not texts.offers_pair(tab.view)
    assert list(tab.selection.letters) == [policy.id for policy in pair.front]
    tab.choose(pair.front[0].id)
    assert session.question().generation == question.generation + 1
    tab.follow()
    tab.skip()
    session.question()
    tab.follow()
    first, second = (json.loads(line) for line in (session.view.path / "decisions.jsonl").read_text().splitlines())
    assert {each["policy"] for each in first["shown"]} == {policy.id for policy in pair.front}
    assert first["limits"][0] == worst and second["stand_in"]
    assert tab.view.stand_in.startswith("you skipped the question")


def test_one_is_told_what_a_stand_in_has_chosen_and_how_many_questions_there_may_be(
    person_config, make_session, tmp_path
):
    session = make_session()
    config = person_config.replace(ask="unsure")
    session.drive(Continued(RunFolder.create(tmp_path / "run", config, envs.make(config.env)), None))
    question, tab = session.question(), Watching(session).tab
    assert texts.phase(tab.view, 0.0) == "Waiting for your answer: question 1 of at most 4"
    chosen_for = None
    while question.purpose != "final":
        tab.choose(order(question.front, 0)[-1])
        question = session.question()
        tab.follow()
        chosen_for = chosen_for or tab.view.stand_in
    lines = (session.view.path / "decisions.jsonl").read_text().splitlines()
    stand_in = [json.loads(line).get("stand_in", False) for line in lines]
    assert any(stand_in) == bool(chosen_for)
    assert bool(stored_view(session.view.path).stand_in) == stand_in[-1]  # whoever opens the run later knows it, too
    if chosen_for:
        between = replace(tab.view, question=None, stand_in=chosen_for)
        told = texts.heading(between, tab.selection)
        assert told == f"Policy {tab.view.previous.id} was chosen for you: {chosen_for}."
    own = 1 + sum(not each for each in stand_in)
    assert texts.phase(tab.view, 0.0) == f"Waiting for your answer: question {own} of at most {own}"


def test_between_questions_one_stops_with_the_last_choice(session, question, tab):
    policy = order(question.front, 0)[-1]
    tab.choose(policy)
    session.question()
    tab.follow()
    tab.view = replace(tab.view, question=None)  # as it is while a generation is trained
    lay_out(tab, tab.view.front[-1].id)
    tab.stop()
    assert tab.ending.question is None and tab.ending.policies == (last_choice(tab.view).id,)
    tab.end(tab.ending.policies[0])
    assert session.view.asking == "end"


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
    assert session.view.question is question and not chosen_so_far(session)
    tab.choose(question.front[0].id)
    session.question()
    tab.follow()
    tab.keep()
    session.question()
    assert chosen(session) == [question.front[0].id] * 2


def test_one_looks_along_the_axis_to_the_right_and_stops_at_its_ends(question, tab):
    right = order(question.front, 0)
    lay_out(tab)
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
        lambda: tab.turn_to(words.HISTORY),
        lambda: tab.look_at(tab.view.front[0].id),
        lambda: tab.put_away(tab.view.front[0].id),
    ]
    for count, command in enumerate(commands, start=1):
        command()
        assert watching.shown == count
    tab.turn_to(words.HISTORY)  # is open
    assert watching.shown == len(commands) and (tab.axes, tab.side) == ((1, 2), words.HISTORY)


def test_a_policy_that_has_gone_says_so(watching):
    focus = watching.tab.selection.focus
    watching.tab.look_at(12345)
    assert watching.said == [("hint", "Policy 12345 is no longer in the front.")]
    assert watching.tab.selection.focus == focus


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
    lay_out(tab)
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
    lay_out(tab, first, second)
    ends = [asyncio.run(tab.score_between(tab.view.run, first, second, per_cent)) for per_cent in (0, 100)]
    between = asyncio.run(tab.score_between(tab.view.run, first, second, 40))
    assert not np.array_equal(between.mean, ends[0].mean) and not np.array_equal(ends[0].mean, ends[1].mean)
    assert "over 16 episodes" in texts.blend_scores(tab.view, between, (first, second))
    as_good = between._replace(mean=question.front[0].values)
    assert texts.blend_scores(tab.view, as_good, (first, second)).endswith("over 16 episodes")
    bad = as_good._replace(mean=as_good.mean - 1e3 * np.eye(3)[0])
    told = texts.blend_scores(tab.view, bad, (first, second))
    assert told.endswith(f". Worse than either of the two in {tab.view.objectives[0].label}.")
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


def favour(tab, *policies):
    for policy in policies:
        asyncio.run(tab.favour(policy))


def test_what_is_noted_in_one_tab_appears_in_the_other(session, question, watching):
    tab, other = watching.tab, Watching(session).tab
    policy = question.front[0]
    lay_out(other, policy.id)
    favour(tab, policy.id)
    tab.edit_policy(policy.id)
    other.edit_policy(policy.id)  # before the first has kept anything
    asyncio.run(tab.save_note("careful one", "Never slips."))
    assert tab.editing is None and not watching.said
    other.follow()
    note = other.view.noted.policy(policy.id)
    assert (note.name, note.text, note.favourite) == ("careful one", "Never slips.", True)
    asyncio.run(other.save_note("", "Brakes."))  # whose name they have not touched
    tab.follow()
    note = tab.view.noted.policy(policy.id)
    assert (note.name, note.text, note.favourite) == ("careful one", "Brakes.", True)
    named = f'policy {policy.id} "careful one"'
    assert texts.end_with(other.view, other.selection, policy).startswith(f"End with A, {named}: north ")
    assert texts.remarks(tab.view, policy) == "careful one"
    favour(tab, policy.id)
    assert not tab.view.favourites and tab.view.noted.policy(policy.id).name


def test_what_is_too_long_stays_written_and_is_told_once(question, watching):
    tab = watching.tab
    asyncio.run(tab.save_note("nobody", ""))  # nothing is being written
    tab.edit_policy(question.front[0].id)
    asyncio.run(tab.save_note("n" * 41, "t" * 2001))
    assert len(watching.said) == 1 and watching.said[0][0] == "failure"
    assert "41 characters" in watching.said[0][1] and "2,001 characters" in watching.said[0][1]
    assert tab.editing and not tab.view.noted.policies
    tab.stop_editing()
    assert tab.editing is None
    tab.edit_policy(99)
    asyncio.run(tab.save_note("nobody", ""))
    assert watching.said[1:] == [("failure", "there is no policy 99 in this run")]


def test_favourites_are_listed_those_that_were_replaced_too(session, question, watching):
    tab = watching.tab
    gone, *left = question.front
    everything = sorted(policy.id for policy in question.front)
    favour(tab, *everything)
    session.view = replace(
        session.view,
        front=tuple(left),
        replaced={gone.id: replace(gone, snapshot=None)},
        question=replace(question, front=tuple(left)),
    )
    tab.follow()
    assert [policy.id for policy in tab.view.favourites] == everything
    assert listed(tab.view, tab.selection) is None
    tab.list_favourites(True)
    assert listed(tab.view, tab.selection) == everything
    tab.look_along(-99)
    assert tab.selection.focus == order(question.front, 0)[0]
    tab.look_at(gone.id)
    assert tab.selection.focus == gone.id and not watching.said
    shown = tab.view.policy(gone.id)
    assert texts.remarks(tab.view, shown) == "no longer in the front" and texts.remark(tab.view, shown).endswith(
        "a later policy is better in everything, so it cannot be chosen"
    )
    tab.choose(gone.id)
    assert watching.said == [("hint", f"Policy {gone.id} is not among those you can choose from.")]
    tab.limit(0, float(gone.values[0]) + 1e-6)
    assert gone.id not in listed(tab.view, tab.selection)
    tab.limit(0, None)
    favour(tab, left[0].id)
    assert listed(tab.view, tab.selection) == [policy for policy in everything if policy != left[0].id]
    tab.more_of(1)
    assert set(listed(tab.view, tab.selection)) <= {policy.id for policy in left[1:]}
    tab.more_of(1)
    favour(tab, gone.id)
    assert tab.selection.focus == gone.id  # what is laid out stays until it is put away
    tab.list_favourites(False)
    assert listed(tab.view, tab.selection) is None
    ended = replace(tab.view, question=None)
    assert texts.remark(ended, shown) == words.REPLACED and texts.remark(ended, left[0]) == "trained in the warm-up"


def test_damaged_notes_are_told_of_and_the_page_goes_on(session, question, watching):
    tab, path = watching.tab, session.view.path / "notes.json"
    path.write_text("{")
    favour(tab, question.front[0].id)
    (tone, told), *more = watching.said
    assert tone == "failure" and "notes.json is not valid JSON" in told and not more
    session.close()
    later = type(session)()
    try:
        later.open(session.view.path)
        later.question()
        watching = Watching(later)
        watching.tab.follow()
        watching.tab.follow()
        (tone, told), *more = watching.said
        assert tone == "failure" and told.startswith("Names and notes cannot be shown: ") and not more
        path.unlink()
        favour(watching.tab, question.front[0].id)
        assert [policy.id for policy in watching.tab.view.favourites] == [question.front[0].id]
    finally:
        later.close()


def test_branches_are_named_and_compared(session, question, watching):
    tab, run = watching.tab, watching.tab.view.run
    asyncio.run(tab.compare())
    assert watching.tab.comparison is None and watching.said == [("hint", words.NOTHING_TO_COMPARE)]
    watching.said.clear()
    tab.choose(order(question.front, 0)[-1])
    session.question()
    asyncio.run(tab.step_back(run, 1))
    session.question()
    other = Watching(session).tab
    seen = other.view
    tab.edit_run(session.history()[0])
    asyncio.run(tab.save_note("the first way", ""))
    other.follow()
    assert other.view is not seen and not other.view.noted.run.name  # it is about another run, in the same history
    assert [branch.title for branch in session.history()] == ['run "the first way"', "run-2"]
    asyncio.run(tab.compare())
    assert [each.branch.name for each in tab.comparison.fronts] == ["run", "run-2"]
    tab.compare_with(run, False)
    assert tab.left_out == {run}
    tab.compare_with(run, True)
    assert not tab.left_out
    before = tab.comparison
    asyncio.run(tab.compare_anew())
    assert tab.comparison is not before
    tab.stop_comparing()
    asyncio.run(tab.compare_anew())  # it was on its way
    assert tab.comparison is None


def test_a_run_opened_in_another_tab_is_told_of(session, question, watching, whole, tmp_path):
    session.open(shutil.copytree(whole, tmp_path / "another"))
    watching.tab.follow()
    watching.tab.follow()
    assert watching.said == [("warning", "another was opened, in another tab.")]
    assert watching.tab.view.path.name == "another" and not watching.renewed


def test_a_page_is_renewed_for_a_run_with_other_objectives(session, question, small_config, tmp_path):
    kept = {}
    watching = Watching(session, kept)
    shown = watching.shown
    session.open(train(tmp_path / "two", small_config.replace(env="mo-mountaincarcontinuous-v0", user="A")))
    watching.tab.follow()
    assert watching.renewed == 1 and watching.shown == shown and not watching.said
    renewed = Watching(session, kept)
    renewed.tab.follow()
    renewed.tab.follow()
    assert renewed.said == [("warning", "two was opened, in another tab.")] and not renewed.renewed

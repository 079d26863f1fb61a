"""The stand-in: it asks where it is not sure, its answers are marked, and runs with it resume and replay exactly."""

import shutil
from typing import Any

import numpy as np
import pytest

import envs
from jmorl import Decided, DecisionMaker, PairQuestion, branch, read_run, run
from jmorl.cli import main
from jmorl.decision.protocol import Answer
from jmorl.decision.records import DecisionRecord, ScriptError, from_json, record_of, to_json
from jmorl.decision.scripted import ScriptedUser
from jmorl.decision.stand_in import StandIn
from jmorl.decision.users import make_user
from tests.resuming import Counting, follow, go_on, outcome, train


@pytest.fixture(scope="module")
def config(small_config):
    """Eight generations, long enough that answers begin to agree."""
    return small_config.replace(ask="unsure", steps=4 * 3 * 16 * 26)


@pytest.fixture(scope="module")
def whole(config, tmp_path_factory):
    return train(tmp_path_factory.mktemp("stand_in") / "whole", config)


def decisions(events):
    return [event for event in events if isinstance(event, Decided)]


def questions(path):
    """How many reached the user, the last one included."""
    return sum(not record.stand_in for record in read_run(path).decisions)


def test_only_a_part_of_the_questions_reaches_the_user(config, small_config):
    user = Counting(config)
    events = list(run(config, user))
    asked = [event for event in decisions(events) if not event.answer.stand_in]
    assert 1 <= len(asked) == len(user.asked) == events[-1].state.questions < len(decisions(events)) == 9
    assert events[-1].state.policies_shown == sum(len(event.question.front) for event in asked)
    assert all(event.answer.reason for event in decisions(events) if event.answer.stand_in)
    utility = make_user(config.user, envs.make(config.env).objectives).utility
    always = list(run(config.replace(ask="always")))
    for chosen, best in zip(decisions(events), decisions(always), strict=True):
        if len(chosen.question.front) == len(best.question.front):
            worth = utility(chosen.question.values)
            assert utility(chosen.chosen.values[None]) >= worth.max() - 0.05 * np.ptp(worth)


def test_the_log_and_the_table_tell_whose_an_answer_is(whole, tmp_path, capsys):
    records = read_run(whole).decisions
    assert {record.stand_in for record in records} == {True, False}
    assert {(record.stand_in, record.format) for record in records} == {(True, 3), (False, 1)}
    assert main(["show", str(shutil.copytree(whole, tmp_path / "copy"))]) == 0
    rows = [line for line in capsys.readouterr().out.splitlines() if " steer " in line or " final " in line]
    assert ["by the stand-in" in row for row in rows] == [record.stand_in for record in records]
    *_, last = read_run(whole).metrics["questions"]
    assert last == sum(not record.stand_in for record in records if record.purpose == "steer")


@pytest.mark.parametrize("events", [3, 8, 12])
def test_a_run_with_a_stand_in_is_resumed_to_the_same_result(whole, config, tmp_path, events):
    path = train(tmp_path / "broken", config, events=events)
    user = Counting(config)
    go_on(path, user=user)
    assert outcome(path) == outcome(whole)
    assert len(user.asked) < questions(whole) or events == 3


@pytest.mark.parametrize("ask", ["unsure", "always"])
def test_its_log_replays_to_the_same_choices(whole, config, ask):
    replayed = decisions(run(config.replace(ask=ask), ScriptedUser(whole / "decisions.jsonl")))
    recorded = read_run(whole).decisions
    assert [event.answer.policy for event in replayed] == [record.policy for record in recorded]
    assert [event.answer.stand_in for event in replayed] == [record.stand_in for record in recorded]


def test_a_mark_survives_writing_and_a_file_without_it_is_a_users(ask):
    question = ask([[1, 2], [2, 1]])
    for answer in (Answer(10), Answer(10, stand_in=True, reason="sure")):
        record = record_of(question, answer)
        assert isinstance(record, DecisionRecord) and record.stand_in == answer.stand_in
        assert from_json(to_json(record)) == record
        assert ("stand_in" in to_json(record)) == answer.stand_in
    with pytest.raises(ScriptError):
        from_json(to_json(record).replace("true", '"yes"'))


def test_other_questions_are_the_users(front_of):
    class User(Counting):
        def __init__(self):
            pass

        def compare(self, question):
            return question.pair[1].id

    pair = PairQuestion(1, (), front_of([[1, 2], [2, 1]]))
    assert StandIn(User(), 0).respond(pair) == 11


def test_a_front_of_one_needs_nobody(ask):
    assert StandIn(None, 0).respond(ask([[1, 2]])) == Answer(10, stand_in=True)


def test_a_branch_knows_what_was_answered_before_it(whole, config, tmp_path):
    user = Counting(config)
    follow(branch(whole, 6, tmp_path / "branch"), user=user)
    assert len(user.asked) < questions(whole)


@pytest.mark.parametrize("ask", ["always", "unsure"])
def test_short_questions_show_few_policies_and_lead_to_the_same(small_config, ask, tmp_path):
    config = small_config.replace(question="few", ask=ask, steps=4 * 3 * 16 * 26)
    utility = make_user(config.user, envs.make(config.env).objectives).utility
    path = train(tmp_path / "run", config)
    events = decisions(run(config))
    asked = [event for event in events if not event.answer.stand_in]
    assert ask == "unsure" or len(asked) == len(events)
    for event in asked:
        question: Any = event.question
        assert len(question.front) == min(5, len(question.front) + len(question.others))
        assert question.previous is None or question.previous in [each.id for each in question.whole.front]
        worth = utility(question.whole.values)
        assert worth.max() - utility(event.chosen.values[None])[0] <= 0.1 * np.ptp(worth)
    assert any(len(event.question.shown) == 5 for event in asked)
    records = read_run(path).decisions
    assert [[shown.policy for shown in record.shown] for record in records] == [
        [policy.id for policy in event.question.shown] for event in events
    ]
    broken = train(tmp_path / "broken", config, events=7)
    go_on(broken)
    assert outcome(broken) == outcome(path)
    replayed = decisions(run(config, ScriptedUser(path / "decisions.jsonl")))
    assert [event.chosen.id for event in replayed] == [event.chosen.id for event in events]


def test_who_chooses_from_the_others_has_seen_them_all(ask):
    class Last(DecisionMaker):
        def answer(self, question):
            return Answer(question.others[-1].id)

    question = ask([[k, 9 - k] for k in range(10)], previous=12)
    asked: Any
    asked, answer = StandIn(Last(), 0, ask="always", shows="few").decide(question)
    assert not asked.others and {policy.id for policy in asked.front} == {policy.id for policy in question.front}
    assert asked.checked(answer) == answer


def test_a_choice_from_the_others_is_remembered_and_replayed(small_config, tmp_path):
    """Its record has all policies, though the question will show few."""

    class Last(Counting):
        def answer(self, question):
            self.asked.append(question.generation)
            return Answer(question.whole.front[-1].id)

    config = small_config.replace(question="few", steps=4 * 3 * 16 * 17)
    whole = train(tmp_path / "whole", config, user=Last(config))
    assert any(len(record.shown) > 5 for record in read_run(whole).decisions)
    path = shutil.copytree(whole, tmp_path / "copy")
    (path / "result.json").unlink()
    for generation in (4, 5):
        shutil.rmtree(path / "checkpoints" / f"{generation:05d}")
    user = Last(config)
    go_on(path, user=user)
    assert not user.asked
    assert outcome(path) == outcome(whole)
    replayed = decisions(run(config, ScriptedUser(whole / "decisions.jsonl")))
    assert [event.chosen.id for event in replayed] == [record.policy for record in read_run(whole).decisions]


def test_a_short_question_has_the_last_choice_and_is_spread_over_the_front(ask):
    asked = []

    class First(DecisionMaker):
        def answer(self, question):
            asked.append([policy.id for policy in question.front])
            return Answer(question.front[0].id)

    StandIn(First(), 0, ask="always", shows="few").decide(ask([[k, 9 - k] for k in range(10)], previous=12))
    assert len(asked[0]) == 5 and 12 in asked[0] and min(asked[0]) <= 11 and max(asked[0]) >= 18

"""Answers are checked and converted where they are given, with one sentence for what is none."""

import json
from dataclasses import replace

import numpy as np
import pytest

from envs import Objective
from jmorl.decision.answers import Answer, AnswerError, Back, Choose
from jmorl.decision.protocol import PairQuestion, Question, WeightQuestion
from jmorl.decision.records import ScriptError, from_json, read_log, record_of, to_json
from jmorl.search.policy import Policy

OBJECTIVES = (Objective("time", "time", "s"), Objective("fuel", "fuel", "l"))


def policy(number, *values):
    nothing = np.zeros(2)
    return Policy(number, 0, None, nothing, np.array(values, float), nothing, nothing, None)


FRONT = (policy(3, -1, -5), policy(7, -2, -4))
QUESTION = Question("steer", 1, OBJECTIVES, FRONT, np.full(2, -np.inf), None)
PAIR = PairQuestion(2, OBJECTIVES, FRONT)
WEIGHTS = WeightQuestion(1, OBJECTIVES, FRONT)


@pytest.mark.parametrize(
    ("given", "kept"),
    [
        (lambda: Answer(FRONT[1]), Answer(7)),
        (lambda: Answer(np.int64(7)), Answer(7)),
        (lambda: Answer(7.0, generations=2.0), Answer(7, generations=2)),
        (lambda: Answer(7, generations=np.int64(1)), Answer(7)),
        (lambda: Answer(7, stop=np.bool_(True)), Answer(7, stop=True)),
        (lambda: Answer(7, ranking=[FRONT[1], np.int64(3)]), Answer(7, ranking=(7, 3))),
        (lambda: Answer(7, ranking=np.array([7])), Answer(7, ranking=(7,))),
        (lambda: Answer(7, equal=np.bool_(True)), Answer(7, equal=True)),
        (lambda: Answer(7, limits=[None, np.float32(-5)]), Answer(7, limits=(-np.inf, -5.0))),
        (lambda: Answer(7, limits=np.array([-np.inf, 2])), Answer(7, limits=(-np.inf, 2.0))),
    ],
)
def test_what_means_an_answer_becomes_one_in_its_proper_types(given, kept):
    answer = QUESTION.checked(given())
    assert answer == kept
    assert [type(each) for each in (answer.policy, answer.stop, answer.generations)] == [int, bool, int]
    assert {int} >= set(map(type, answer.ranking)) and {float} >= set(map(type, answer.limits or ()))
    json.dumps(QUESTION.to_json(answer))


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        (lambda: Answer(7, generations=0), "generations must be a whole number, at least 1, not 0"),
        (lambda: Answer(7, generations=-1), "generations must be a whole number, at least 1, not -1"),
        (lambda: Answer(7, generations=1.5), "generations must be a whole number, not 1.5"),
        (lambda: Answer(7, generations=True), "generations must be a whole number, at least 1, not True"),
        (lambda: Answer(7, stop="yes"), "stop must be True or False, not 'yes'"),
        (lambda: Answer(None), "policy must be a whole number, not None"),
        (lambda: Answer("7"), "policy must be a whole number, not '7'"),
        (lambda: Answer(float("nan")), "policy must be a whole number, not nan"),
        (lambda: None, r"answer must return a jmorl.Answer\(policy id\), not None"),
        (lambda: FRONT[0], r"answer must return a jmorl.Answer\(policy id\), not Policy"),
        (lambda: 7, r"answer must return a jmorl.Answer\(policy id\), not 7"),
        (lambda: Answer(4), r"policy 4 is not among the policies shown: \[3, 7\]"),
        (lambda: Answer(policy(4, 0, 0)), r"policy 4 is not among the policies shown"),
        (lambda: Answer(7, ranking=(7, 3, 7)), r"a policy is twice in the ranking \[7, 3, 7\]"),
        (lambda: Answer(7, ranking=(FRONT[1], 7)), r"a policy is twice in the ranking \[7, 7\]"),
        (lambda: Answer(7, ranking=(7, "3")), "ranking must be a whole number, not '3'"),
        (lambda: Answer(7, ranking=(7, 3), equal=True), "no difference cannot be ranked"),
        (lambda: Answer(7, ranking=(7, 4)), r"policy 4 is not among the policies shown: \[3, 7\]"),
        (lambda: Answer(7, equal=1), "equal must be True or False, not 1"),
        (lambda: Answer(7, limits=(float("nan"), 0)), "a limit must be a number, or -inf for none, not nan"),
        (lambda: Answer(7, limits=(0, float("inf"))), "a limit must be a number, or -inf for none, not inf"),
        (lambda: Answer(7, limits=(0, "high")), "a limit must be a number, or -inf for none, not 'high'"),
        (lambda: Answer(7, limits=(0,)), r"limits must be 2 numbers, not \(0.0,\)"),
        (lambda: Answer(7, limits=()), r"limits must be 2 numbers, not \(\)"),
    ],
)
def test_what_is_no_answer_is_refused_in_one_sentence(given, sentence):
    with pytest.raises(AnswerError, match=sentence):
        QUESTION.checked(given())


def test_a_policy_that_is_not_shown_can_be_chosen_and_ranked():
    short = replace(QUESTION, front=FRONT[:1], others=FRONT[1:])
    assert short.checked(Answer(7)) == Answer(7)
    assert short.checked(Answer(3, ranking=(3, 7))).ranking == (3, 7)
    with pytest.raises(AnswerError, match="policy 8 is not among the policies shown"):
        short.checked(Answer(3, ranking=(3, 8)))


@pytest.mark.parametrize(("given", "kept"), [(3, 3), (np.int64(7), 7), (FRONT[1], 7), (None, None)])
def test_a_pair_has_a_better_one_or_none(given, kept):
    assert PAIR.checked(given) == kept


@pytest.mark.parametrize(("given", "sentence"), [(5, "policy 5 is neither of the two"), ("left", "not 'left'")])
def test_what_is_none_of_the_pair_is_refused(given, sentence):
    with pytest.raises(AnswerError, match=sentence):
        PAIR.checked(given)


def test_weights_get_a_sum_of_one():
    assert WEIGHTS.checked([1, 3]) == WEIGHTS.checked(np.array([0.25, 0.75])) == (0.25, 0.75)


@pytest.mark.parametrize("given", [[1], [0, 0], [1, -1], [1, float("inf")], None, "ab", [[1, 2]]])
def test_what_are_no_weights_is_refused(given):
    with pytest.raises(AnswerError, match="weights must be 2 numbers"):
        WEIGHTS.checked(given)


@pytest.mark.parametrize(("question", "answer"), [(QUESTION, Answer(7, True)), (PAIR, None), (WEIGHTS, (0.25, 0.75))])
def test_an_answer_to_any_question_is_written_and_read_back(question, answer, tmp_path):
    record = record_of(question, answer)
    assert from_json(to_json(record)) == record
    log = tmp_path / "decisions.jsonl"
    log.write_text(to_json(record) + "\n", encoding="utf-8")
    assert read_log(log) == [record]
    assert question.from_json(question.to_json(answer)) == answer


AGAIN = replace(QUESTION, again=True)
SHOWN = '"shown": [{"policy": 3, "values": [-1.0, -5.0]}, {"policy": 7, "values": [-2.0, -4.0]}]'


@pytest.mark.parametrize(
    ("question", "answer", "fields"),
    [
        (QUESTION, Answer(7, ranking=(7, 3)), {"ranking": [7, 3]}),
        (QUESTION, Answer(3, ranking=(7,)), {"ranking": [7]}),
        (QUESTION, Answer(7, equal=True), {"equal": True}),
        (QUESTION, Answer(7, limits=(-np.inf, -5)), {"limits": [None, -5.0]}),
        (QUESTION, Answer(7, limits=(-np.inf, -np.inf)), {"limits": [None, None]}),
        (AGAIN, Answer(7), {"again": True}),
        (AGAIN, Answer(7, True, ranking=(7, 3), limits=(0, 1)), {"ranking": [7, 3], "limits": [0, 1], "again": True}),
    ],
)
def test_more_than_a_preferred_policy_is_a_record_of_format_4(question, answer, fields):
    record = record_of(question, answer)
    line = to_json(record)
    assert from_json(line) == record and record.answer == answer
    later = {name: value for name, value in json.loads(line).items() if name in ("ranking", "equal", "limits", "again")}
    assert json.loads(line)["format"] == 4 and later == fields


@pytest.mark.parametrize(
    ("answer", "line"),
    [
        (
            Answer(7, generations=2),
            '{"format": 1, "purpose": "steer", "generation": 1, "policy": 7, "values": [-2.0, -4.0], "stop": false, '
            f'"generations": 2, {SHOWN}}}',
        ),
        (
            Answer(7, stand_in=True),
            '{"format": 3, "purpose": "steer", "generation": 1, "policy": 7, "values": [-2.0, -4.0], "stop": false, '
            f'"generations": 1, {SHOWN}, "stand_in": true}}',
        ),
    ],
)
def test_a_preferred_policy_alone_is_written_as_ever(answer, line):
    assert to_json(record_of(QUESTION, answer)) == line


@pytest.mark.parametrize(
    ("fields", "problem"),
    [
        ({"ranking": [7, -1]}, "ranking.1: input should be greater than or equal to 0"),
        ({"limits": [None, "5"]}, "limits.1.*: input should be a valid number"),
        ({"equal": 1}, "equal: input should be a valid boolean"),
        ({"again": "yes"}, "again: input should be a valid boolean"),
    ],
)
def test_a_record_with_a_false_addition_is_refused(fields, problem):
    line = json.dumps(json.loads(to_json(record_of(QUESTION, Answer(7)))) | {"format": 4} | fields)
    with pytest.raises(ScriptError, match=f"is not a decision: {problem}"):
        from_json(line)


def test_points_are_checked_too():
    class Three:
        points = (None, None, None)

    from jmorl.decision.protocol import PointQuestion

    assert PointQuestion.checked(Three(), Choose(np.int64(2))) == Choose(2)
    assert PointQuestion.checked(Three(), Back(1)) == Back(1)
    with pytest.raises(AnswerError, match="there is no point 3 among the 3 shown"):
        PointQuestion.checked(Three(), Choose(3))
    with pytest.raises(AnswerError, match="choose_point must return Choose, Back or Adjust, not 1"):
        PointQuestion.checked(Three(), 1)


def test_a_ranking_begins_with_the_preferred_policy():
    question = Question("steer", 1, OBJECTIVES, (policy(3, 1, 2), policy(4, 2, 1)), np.full(2, -np.inf), None)
    assert question.checked(Answer(4, ranking=(4, 3))).ranking == (4, 3)
    with pytest.raises(AnswerError, match="the ranking must begin with"):
        question.checked(Answer(4, ranking=(3, 4)))

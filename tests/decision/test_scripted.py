"""The decision log and its replay: the same answers, or a sentence saying why not."""

import json
from dataclasses import replace

import numpy as np
import pytest

from jmorl.decision.answers import Adjust, Answer, Back, Choose
from jmorl.decision.navigation import run_enautilus
from jmorl.decision.protocol import Question
from jmorl.decision.records import (
    DecisionRecord,
    PointRecord,
    ScriptError,
    decision_record,
    from_json,
    point_record,
    read_log,
    to_json,
)
from jmorl.decision.scripted import ScriptedUser

VALUES = [[-70, -40], [-66.25, -57], [-100, -20]]
TEN = Answer(10)
STEER = {"format": 1, "purpose": "steer", "generation": 1, "policy": 11, "values": [-66.25, -57]}
POINT = {
    "format": 1,
    "purpose": "enautilus",
    "generation": 2,
    "number": 0,
    "answer": {"point": 0},
    "shown": [{"policy": 11, "values": [-66.25, -57]}],
}


@pytest.fixture
def replay(tmp_path):
    """Records or raw lines to the user who replays them."""

    def make(*lines) -> ScriptedUser:
        path = tmp_path / "decisions.jsonl"
        texts = (line if isinstance(line, str) else json.dumps(line) for line in lines)
        path.write_text("".join(text + "\n" for text in texts), encoding="utf-8")
        return ScriptedUser(path)

    return make


def recorded(question: Question, answer: Answer) -> str:
    return to_json(decision_record(question, answer))


def test_a_run_is_replayed_answer_by_answer(ask, replay):
    rng = np.random.default_rng(0)
    questions = [ask(rng.normal(size=(5, 3)), generation=g) for g in (1, 2, 5)]
    questions.append(ask(rng.normal(size=(3, 3)), purpose="final", generation=6))
    answers = [Answer(10), Answer(14, generations=3), Answer(12), Answer(11)]
    user = replay(*map(recorded, questions, answers))
    assert [user.answer(question) for question in questions] == answers
    # Answers do not depend on the order of the questions: a resumed run asks from the middle.
    assert [user.answer(question) for question in reversed(questions)] == answers[::-1]


@pytest.mark.parametrize(
    "answer",
    [
        Answer(12, stop=True),
        Answer(12, generations=4),
        Answer(12, ranking=(12, 10)),
        Answer(10, equal=True),
        Answer(12, limits=(-90.0, -np.inf)),
    ],
)
def test_everything_in_an_answer_survives(ask, replay, answer):
    question = ask(VALUES)
    assert replay(recorded(question, answer)).answer(question) == answer


def test_the_line_of_a_decision_by_hand(ask):
    line = recorded(ask([[-70, -40], [1 / 3, -57]], generation=3), Answer(11, stop=True))
    assert line == (
        '{"format": 1, "purpose": "steer", "generation": 3, "policy": 11, "values": [0.3333333333333333, -57.0], '
        '"stop": true, "generations": 1, "shown": [{"policy": 10, "values": [-70.0, -40.0]}, '
        '{"policy": 11, "values": [0.3333333333333333, -57.0]}]}'
    )


@pytest.mark.parametrize("answer", [Choose(0), Back(2), Adjust(3, 4), Adjust(0, 1)])
def test_records_survive_json(ask, answer):
    shown = decision_record(ask(np.random.default_rng(0).normal(size=(4, 2))), Answer(13)).shown
    for record in (PointRecord(4, 2, answer, shown), DecisionRecord("final", 3, 11, (0.1, 1e-300), shown=shown)):
        assert from_json(to_json(record)) == record


def test_a_hand_written_log_needs_only_the_decision(ask, replay):
    assert replay(STEER).answer(ask(VALUES)) == Answer(11)


def test_a_policy_with_another_id_but_the_recorded_values_is_the_one(ask, replay):
    # Elsewhere ids may differ, and last bits.
    user = replay(STEER | {"policy": 3, "values": [-66.25 * (1 + 1e-12), -57]})
    assert user.answer(ask(VALUES)) == Answer(11)


def test_of_policies_with_the_recorded_values_rather_the_one_with_the_id(ask, replay):
    twins = [[1, 2], [1, 2], [1 + 1e-9, 2]]
    assert replay(STEER | {"policy": 11, "values": [1, 2]}).answer(ask(twins)) == Answer(11)
    assert replay(STEER | {"policy": 99, "values": [1 + 1e-9, 2]}).answer(ask(twins)) == Answer(12)


@pytest.mark.parametrize("values", [[-66.2, -57], [-66.25], [-66.25, -57, -57], [0.0, 0.0]])
def test_the_same_id_with_other_values_is_another_run(ask, replay, values):
    with pytest.raises(ScriptError, match=r"chose policy 11 with values .* at generation 1, .* of another run"):
        replay(STEER | {"values": values}).answer(ask(VALUES))


def test_a_missing_decision(ask, replay):
    user = replay(STEER, STEER | {"generation": 3})
    with pytest.raises(ScriptError, match=r"decisions.jsonl has no decision for generation 2, only for \[1, 3\]; add"):
        user.answer(ask(VALUES, generation=2))
    with pytest.raises(ScriptError, match="no decision for generation 1"):
        user.answer(ask(VALUES, purpose="final"))


def test_a_log_that_ends_with_a_final_choice_ends_a_longer_run(ask, replay):
    user = replay(STEER, STEER | {"purpose": "final", "generation": 2})
    assert user.answer(ask(VALUES, generation=2)) == Answer(11, stop=True)
    assert user.answer(ask(VALUES, purpose="final", generation=2)) == Answer(11)


def test_a_line_that_goes_back_replaces_what_followed(ask, replay):
    lines = [STEER | {"generation": g} for g in (1, 2, 3)]
    changed = STEER | {"generation": 2, "policy": 12, "values": [-100, -20]}
    user = replay(*lines, changed)
    assert user.answer(ask(VALUES)) == Answer(11)
    assert user.answer(ask(VALUES, generation=2)) == Answer(12)
    with pytest.raises(ScriptError, match=r"only for \[1, 2\]"):
        user.answer(ask(VALUES, generation=3))


def test_both_answers_about_one_choice_are_replayed(ask, replay):
    question = ask(VALUES, generation=2)
    again = replace(question, front=question.front[1:], others=question.front[:1], again=True)
    user = replay(recorded(question, Answer(12)), recorded(again, Answer(11)), recorded(ask(VALUES, generation=3), TEN))
    assert [user.answer(each) for each in (question, again, question)] == [Answer(12), Answer(11), Answer(12)]
    assert user.answer(ask(VALUES, generation=3)) == TEN


@pytest.mark.parametrize("purpose", ["steer", "final"])
def test_who_is_asked_again_without_a_second_answer_says_the_same(ask, replay, purpose):
    question = ask(VALUES, purpose=purpose)
    user = replay(recorded(question, Answer(12)))
    assert user.answer(replace(question, again=True)) == user.answer(question) == Answer(12)


def test_a_first_answer_that_was_given_anew_replaces_the_second_one_too(ask, replay):
    question = ask(VALUES)
    again = replace(question, again=True)
    user = replay(recorded(question, Answer(12)), recorded(again, Answer(11)), recorded(question, TEN))
    assert user.answer(again) == user.answer(question) == TEN


def test_a_ranking_is_replayed_by_values_and_not_by_ids(ask, replay, front_of):
    line = recorded(ask(VALUES), Answer(12, ranking=(12, 10, 11)))
    other = replace(ask(VALUES), front=front_of([VALUES[2], VALUES[0], VALUES[1]]))
    assert replay(line).answer(other) == Answer(10, ranking=(10, 11, 12))


def test_a_ranking_of_policies_that_the_log_does_not_show_is_an_error_of_the_log(ask, replay):
    """In a log written by hand, which may leave out what was shown."""
    with pytest.raises(ScriptError):
        replay(STEER | {"format": 4, "ranking": [11, 10]}).answer(ask(VALUES))


def test_a_script_claims_no_utility_and_no_satisfaction(replay):
    user = replay(STEER)
    assert user.utility(np.array(VALUES)) is None and not user.satisfied(np.array(VALUES))


# --- E-NAUTILUS ---------------------------------------------------------------------------------------------------


def test_a_dialogue_is_replayed_with_its_detours(front_of, objectives_of, replay):
    values = np.stack([np.arange(20), (20 - np.arange(20)) ** 1.5], axis=1)
    answers = iter([Choose(1), Back(1), Adjust(4, 5), Choose(4), Choose(0), Choose(1), Choose(0)])
    lines = []

    def choose_point(question):
        answer = next(answers)
        lines.append(to_json(point_record(question, answer)))
        return answer

    def run(choose):
        return run_enautilus(front_of(values), objectives_of(2), choose, iterations=3, points=3, generation=9)

    chosen = run(choose_point)
    assert len(lines) > 4
    assert run(replay(*lines).choose_point).id == chosen.id
    with pytest.raises(ScriptError, match=f"no answer number {len(lines) - 1} in E-NAUTILUS at generation 9"):
        run(replay(*lines[:-1]).choose_point)


def test_a_second_dialogue_at_the_same_generation_replaces_the_first(front_of, objectives_of, replay):
    first = [POINT | {"number": number} for number in range(3)]
    second = POINT | {"answer": {"iterations_left": 0, "points": 2}}
    user = replay(*first, second)
    chosen = run_enautilus(front_of(VALUES), objectives_of(2), user.choose_point, 3, 2, 2)
    assert chosen.id == 10  # the middle one, nearest to the start


def test_another_front_is_refused(front_of, objectives_of, replay):
    other = np.array(VALUES) + 0.5
    with pytest.raises(ScriptError, match="chose policy 11 .* at generation 2, .* another run"):
        run_enautilus(front_of(other), objectives_of(2), replay(POINT).choose_point, 3, 2, 2)


def test_the_question_behind_a_dialogue_is_not_logged(ask):
    with pytest.raises(ValueError, match="logged as the question it belongs to"):
        decision_record(ask(VALUES, purpose="enautilus"), Answer(10))


# --- files that cannot be read --------------------------------------------------------------------------------------


def without(fields: dict, name: str) -> dict:
    return {key: value for key, value in fields.items() if key != name}


@pytest.mark.parametrize(
    ("line", "problem"),
    [
        ('{"format": 1, "purp', "is not valid JSON: .* at column"),
        ("[1, 2]", "is not a JSON object"),
        (STEER | {"format": 5}, "has format 5, newer than the format 4 known here; use a newer jmorl"),
        (STEER | {"format": 0}, "is not a decision: format: input should be 1"),
        (without(STEER, "purpose"), 'purpose: should be "steer", "final" or "enautilus"'),
        (STEER | {"purpose": "guess"}, 'purpose: should be "steer", "final" or "enautilus"'),
        (without(STEER, "policy"), "policy: field required"),
        (without(STEER, "values"), "values: field required"),
        (STEER | {"policy": "11"}, "policy: input should be a valid integer"),
        (STEER | {"policy": True}, "policy: input should be a valid integer"),
        (STEER | {"values": []}, "values: tuple should have at least 1 item"),
        (STEER | {"values": [1, "2"]}, "values.1: input should be a valid number"),
        (STEER | {"values": [1, float("nan")]}, "values.1: input should be a finite number"),
        (STEER | {"generation": 0}, "generation: input should be greater than or equal to 1"),
        (STEER | {"generations": 0}, "generations: input should be greater than or equal to 1"),
        (STEER | {"stpo": True}, "stpo: unexpected keyword argument"),
        (STEER | {"policy": "x", "stop": 1}, "policy: .*; stop: input should be a valid boolean"),
        (POINT | {"answer": {"go": 1}}, 'answer: should be {"point": i}, {"steps": n} or'),
        (POINT | {"answer": {"steps": 1, "point": 0}}, "answer: should be"),
        (POINT | {"answer": {"point": 1}}, "answer: point 1 is none of the 1 shown, from 0"),
        (POINT | {"answer": {"point": -1}}, "answer: point -1 is none of the 1 shown"),
        (POINT | {"number": -1}, "number: input should be greater than or equal to 0"),
        (POINT | {"shown": [{"policy": 1}]}, "shown.0.values: field required"),
    ],
)
def test_a_bad_line_is_named(replay, line, problem):
    with pytest.raises(ScriptError, match=rf"decisions\.jsonl, line 3 .*{problem}"):
        replay(STEER, "", line, STEER)


def test_a_missing_file_and_one_that_is_no_text(tmp_path):
    with pytest.raises(ScriptError, match=r"cannot read the decision log .*nowhere\.jsonl: .*No such file"):
        read_log(tmp_path / "nowhere.jsonl")
    (tmp_path / "binary").write_bytes(b"\xff\xfe")
    with pytest.raises(ScriptError, match="cannot read the decision log .*binary: "):
        read_log(tmp_path / "binary")


def test_an_empty_log_has_no_decisions(ask, replay):
    with pytest.raises(ScriptError, match=r"no decision for generation 1, only for \[\]"):
        replay("").answer(ask(VALUES))

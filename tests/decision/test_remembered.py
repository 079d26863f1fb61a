"""A run that goes on: answers are never asked for twice, never lost, never doubled, never of another course."""

from contextlib import contextmanager

import numpy as np
import pytest

from jmorl.decision.answers import Answer
from jmorl.decision.protocol import DecisionMaker
from jmorl.decision.records import decision_record, to_json
from jmorl.decision.remembered import Remembered
from jmorl.storage.decision_log import DecisionLog

VALUES = np.array([[-70, -40], [-66.25, -57], [-100, -20]])


class Fresh(DecisionMaker):
    """Answers with the last one shown, and keeps what it was asked."""

    def __init__(self):
        self.asked = []

    def answer(self, question):
        self.asked.append(question.generation)
        return Answer(question.front[-1].id)

    def utility(self, values):
        return values.sum(axis=1)

    def satisfied(self, values):
        return len(values) == 3


@pytest.fixture
def course(ask):
    """Questions of three generations, and how they were answered."""
    questions = [ask(VALUES + generation, generation=generation) for generation in (1, 2, 3)]
    return questions, [Answer(10), Answer(11, generations=2), Answer(12, stop=True)]


def lines(questions, answers):
    return [
        to_json(decision_record(question, answer)) + "\n" for question, answer in zip(questions, answers, strict=True)
    ]


def records(questions, answers):
    return list(map(decision_record, questions, answers))


def test_what_was_answered_is_not_asked_again(course):
    questions, answers = course
    user = Fresh()
    remembered = Remembered(user, records(questions[:2], answers[:2]))
    assert [remembered.answer(question) for question in questions] == [*answers[:2], Answer(12)]
    assert user.asked == [3]


@pytest.mark.parametrize(
    "change",
    [
        lambda ask: ask(VALUES + 1.01),
        lambda ask: ask(VALUES[:2] + 1),
        lambda ask: ask(np.vstack([VALUES + 1, [0, 0]])),
        lambda ask: ask(VALUES + 1, generation=2),
        lambda ask: ask(VALUES + 1, purpose="final"),
    ],
)
def test_another_question_is_asked_and_ends_what_is_remembered(course, ask, change):
    questions, answers = course
    user = Fresh()
    remembered = Remembered(user, records(questions, answers))
    remembered.answer(change(ask))
    remembered.answer(questions[1])
    assert len(user.asked) == 2


def test_values_that_differ_by_rounding_are_the_same_question(course, ask):
    questions, answers = course
    assert Remembered(Fresh(), records(questions, answers)).answer(ask((VALUES + 1) * (1 + 1e-12))) == answers[0]


def test_a_remembering_user_is_otherwise_the_user_and_is_asked_within_the_context(course):
    entered = []

    @contextmanager
    def asking():
        entered.append(True)
        yield

    remembered = Remembered(Fresh(), (), asking)
    np.testing.assert_array_equal(remembered.utility(VALUES), VALUES.sum(axis=1))
    assert remembered.satisfied(VALUES) and not remembered.satisfied(VALUES[:2])
    remembered.answer(course[0][0])
    assert entered == [True]


def test_the_log_grows_by_a_line_for_each_answer(course, tmp_path):
    log = DecisionLog(tmp_path / "log")
    for question, answer in zip(*course, strict=True):
        log.add(question, answer)
    assert (tmp_path / "log").read_text() == log.past == "".join(lines(*course))


@pytest.mark.parametrize("past", [0, 1, 3])
def test_answers_ahead_are_kept_and_not_written_again(course, tmp_path, past):
    whole = lines(*course)
    (tmp_path / "log").write_text("".join(whole))
    log = DecisionLog(tmp_path / "log", "".join(whole[:past]))
    assert not log.restored and log.ahead == records(*course)[past:]
    for question, answer in list(zip(*course, strict=True))[past:]:
        log.add(question, answer)
        assert (tmp_path / "log").read_text() == "".join(whole)
    assert log.past == "".join(whole)


def test_another_answer_ends_what_was_ahead(course, tmp_path):
    whole = lines(*course)
    (tmp_path / "log").write_text("".join(whole))
    log = DecisionLog(tmp_path / "log", whole[0])
    other = Answer(12)
    log.add(course[0][1], other)
    assert (tmp_path / "log").read_text() == log.past == whole[0] + lines(course[0][1:2], [other])[0]
    assert not log.ahead


def test_the_same_answer_to_rounded_values_keeps_what_is_ahead(course, ask, tmp_path):
    whole = lines(*course)
    (tmp_path / "log").write_text("".join(whole))
    log = DecisionLog(tmp_path / "log")
    log.add(ask((VALUES + 1) * (1 + 1e-12)), course[1][0])
    text = (tmp_path / "log").read_text()
    assert text.startswith(log.past) and text.endswith("".join(whole[1:])) and text != "".join(whole)


def test_a_half_written_line_is_cut_off_at_every_length(course, tmp_path):
    whole = lines(*course)
    for length in range(len(whole[2])):
        (tmp_path / "log").write_text("".join(whole[:2]) + whole[2][:length])
        log = DecisionLog(tmp_path / "log", whole[0])
        assert len(log.ahead) == 1
        assert (tmp_path / "log").read_text() == "".join(whole[:2])


@pytest.mark.parametrize("spoil", [lambda text: text[:40], lambda text: "", lambda text: text.replace("-69", "-68", 1)])
def test_a_log_that_is_not_as_it_was_is_restored(course, tmp_path, spoil):
    whole = lines(*course)
    (tmp_path / "log").write_text(spoil("".join(whole)))
    log = DecisionLog(tmp_path / "log", "".join(whole[:2]))
    assert log.restored and not log.ahead
    assert (tmp_path / "log").read_text() == "".join(whole[:2])

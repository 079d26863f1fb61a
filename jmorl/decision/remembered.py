"""A user whose earlier answers are known: who was asked once is not asked again."""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from typing import Any

import numpy as np

from jmorl.decision.protocol import Answer, AnyQuestion, DecisionMaker, PointAnswer, PointQuestion, Question
from jmorl.decision.records import AnswerRecord, DecisionRecord

RunRecord = DecisionRecord | AnswerRecord  # of a question that a run asks


class Remembered(DecisionMaker):
    """Answers as recorded the questions that the records are of, and passes all others on to `user`.

    A record is of a question that shows the same policies, with values equal up to rounding: where a run is resumed
    on another machine its numbers may differ in the last bits. With the first question that is not as recorded the
    remaining records are of another course of the run, and forgotten. `user` is asked within `asking()`.
    """

    def __init__(
        self,
        user: DecisionMaker,
        records: Sequence[RunRecord] = (),
        asking: Callable[[], AbstractContextManager[object]] = nullcontext,
    ):
        self.user = user
        self.records = list(records)
        self.asking = asking

    def respond(self, question: AnyQuestion) -> Any:
        """Return the answer to a question of any kind."""
        if self.records:
            record = self.records.pop(0)
            if is_of(record, question):
                return answer_in(record, question)
            self.records.clear()
        with self.asking():
            return self.user.respond(question)

    def answer(self, question: Question) -> Answer:
        """Return the preferred member of the question's front."""
        answer: Answer = self.respond(question)
        return answer

    def choose_point(self, question: PointQuestion) -> PointAnswer:
        """Return the answer to a question of E-NAUTILUS."""
        return self.user.choose_point(question)

    def utility(self, values: np.ndarray) -> np.ndarray | None:
        """Return the utilities [N] of objective vectors [N, M]; None without a utility."""
        return self.user.utility(values)

    def satisfied(self, values: np.ndarray) -> bool:
        """Return whether a run with the front `values` [N, M] may stop early."""
        return self.user.satisfied(values)


def is_of(record: RunRecord, question: AnyQuestion) -> bool:
    """Return whether the record is an answer to this question."""
    if (record.purpose, record.generation) != (question.purpose, question.generation):
        return False
    if [shown.policy for shown in record.shown] != [policy.id for policy in question.shown]:
        return False
    return np.allclose([shown.values for shown in record.shown], question.values)


def by_stand_in(record: RunRecord) -> bool:
    """Return whether a stand-in answered, which would answer the same again."""
    return isinstance(record, DecisionRecord) and record.stand_in


def answer_in(record: RunRecord, question: AnyQuestion) -> Any:
    """Return the answer that a record of the question holds."""
    if isinstance(record, DecisionRecord):
        return Answer(record.policy, record.stop, record.generations, record.stand_in)
    return question.from_json(record.answer)

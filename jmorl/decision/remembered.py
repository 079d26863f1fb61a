"""A user whose earlier answers are known: who was asked once is not asked again."""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext

import numpy as np

from jmorl.decision.protocol import Answer, DecisionMaker, PointAnswer, PointQuestion, Question
from jmorl.decision.records import DecisionRecord


class Remembered(DecisionMaker):
    """Answers as recorded the questions that the records are of, and passes all others on to `user`.

    A record is of a question that shows the same policies, with values equal up to rounding: where a run is resumed
    on another machine its numbers may differ in the last bits. With the first question that is not as recorded the
    remaining records are of another course of the run, and forgotten. `user` is asked within `asking()`.
    """

    def __init__(
        self,
        user: DecisionMaker,
        records: Sequence[DecisionRecord] = (),
        asking: Callable[[], AbstractContextManager[object]] = nullcontext,
    ):
        self.user = user
        self.records = list(records)
        self.asking = asking

    def answer(self, question: Question) -> Answer:
        if self.records:
            record = self.records.pop(0)
            if is_of(record, question):
                return Answer(record.policy, record.stop, record.generations)
            self.records.clear()
        with self.asking():
            return self.user.answer(question)

    def choose_point(self, question: PointQuestion) -> PointAnswer:
        return self.user.choose_point(question)

    def utility(self, values: np.ndarray) -> np.ndarray | None:
        return self.user.utility(values)

    def satisfied(self, values: np.ndarray) -> bool:
        return self.user.satisfied(values)


def is_of(record: DecisionRecord, question: Question) -> bool:
    """Whether the record is an answer to this question."""
    if (record.purpose, record.generation) != (question.purpose, question.generation):
        return False
    if [shown.policy for shown in record.shown] != [policy.id for policy in question.front]:
        return False
    return np.allclose([shown.values for shown in record.shown], question.values)

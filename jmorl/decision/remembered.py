"""A user whose earlier answers are known: who was asked once is not asked again."""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from typing import Any

import numpy as np

from jmorl.decision.answers import AskPair
from jmorl.decision.protocol import AnyQuestion, DecisionMaker, Question
from jmorl.decision.records import AnswerRecord, DecisionRecord
from jmorl.decision.wrapper import Wrapper

RunRecord = DecisionRecord | AnswerRecord  # of a question that a run asks


class Remembered(Wrapper):
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
        super().__init__(user)
        self.records = list(records)
        self.asking = asking

    def respond(self, question: AnyQuestion) -> Any:
        """Return the answer to a question of any kind. Raises AskPair where the record is of a pair of its policies."""
        if self._is_next(question):
            return answer_in(self.records.pop(0), question)
        if self.remembers(question):
            raise AskPair
        self.records.clear()
        with self.asking():
            return self.user.respond(question)

    def remembers(self, question: AnyQuestion) -> bool:
        """Return whether the next record is of this question, or of a pair of its policies."""
        return self._is_next(question) or (bool(self.records) and is_of_pair(self.records[0], question))

    def _is_next(self, question: AnyQuestion) -> bool:
        whole = question.whole if isinstance(question, Question) else question  # which somebody may have seen
        return bool(self.records) and (is_of(self.records[0], question) or is_of(self.records[0], whole))

    def wants_question(self, generation: int) -> bool:
        """Return whether the next record is of this generation, or the user wants to be asked."""
        if self.records:
            return self.records[0].generation == generation
        return self.user.wants_question(generation)


def is_of(record: RunRecord, question: AnyQuestion) -> bool:
    """Return whether the record is an answer to this question."""
    if (record.purpose, record.generation) != (question.purpose, question.generation):
        return False
    if [shown.policy for shown in record.shown] != [policy.id for policy in question.shown]:
        return False
    return np.allclose([shown.values for shown in record.shown], question.values)


def is_of_pair(record: RunRecord, question: AnyQuestion) -> bool:
    """Return whether the record is an answer about a pair, for which somebody asked in place of this question."""
    if not isinstance(question, Question) or question.form == "pair" or question.again or question.purpose != "steer":
        return False
    values = {policy.id: policy.values for policy in question.whole.front}
    return (
        isinstance(record, DecisionRecord)
        and (record.purpose, record.generation) == (question.purpose, question.generation)
        and len(record.shown) == 2
        and all(each.policy in values and np.allclose(each.values, values[each.policy]) for each in record.shown)
    )


def by_stand_in(record: RunRecord) -> bool:
    """Return whether a stand-in answered, which would answer the same again."""
    return isinstance(record, DecisionRecord) and record.stand_in


def answer_in(record: RunRecord, question: AnyQuestion) -> Any:
    """Return the answer that a record of the question holds."""
    if isinstance(record, DecisionRecord):
        return record.answer
    return question.from_json(record.answer)

"""A person elsewhere, who answers when they like."""

import threading
from collections.abc import Callable

from jmorl.decision.answers import Answer
from jmorl.decision.protocol import DecisionMaker, Question


class LeftOff(Exception):
    """The end of a run that is left while its question is open; resumed, it asks again."""


class Person(DecisionMaker):
    """A decision maker that waits for somebody to reply, and takes the first reply to each question.

    `asked` is called with every question, in the thread of the run.
    """

    def __init__(self, asked: Callable[[Question], None]):
        self.asked = asked
        self._changed = threading.Condition()
        self._question: Question | None = None
        self._answer: Answer | None = None
        self._left = False

    def answer(self, question: Question) -> Answer:
        """Return somebody's reply. Raises LeftOff when the run is left instead."""
        with self._changed:
            self._question, self._answer = question, None
        self.asked(question)
        with self._changed:
            self._changed.wait_for(lambda: self._answer is not None or self._left)
            self._question = None
            if self._answer is None:
                raise LeftOff
            return self._answer

    def reply(self, question: Question, answer: Answer) -> bool:
        """Answer a question. Return False if it is not open: somebody else was first, or the run was left.

        Raises ValueError, and the question stays open, if its front has no such policy.
        """
        question.policy(answer.policy)
        with self._changed:
            if question is not self._question or self._answer is not None or self._left:
                return False
            self._answer = answer
            self._changed.notify_all()
            return True

    def leave(self) -> None:
        """Wait no longer; from now on there is no reply."""
        with self._changed:
            self._left = True
            self._changed.notify_all()

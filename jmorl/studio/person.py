"""A person elsewhere, who answers when they like."""

import threading
from collections.abc import Callable

from jmorl.decision.answers import Answer, Instead
from jmorl.decision.protocol import DecisionMaker, Question


class LeftOff(Exception):
    """The end of a run that is left while its question is open; resumed, it asks again."""


class Person(DecisionMaker):
    """A decision maker that waits for somebody to reply, and takes the first reply to each question.

    `asked` is called with every question, in the thread of the run. With `ask_now` they want the next question
    however long their last answer was to hold; with `end_with` they answer it beforehand, and the run ends.
    """

    signs = True

    def __init__(self, asked: Callable[[Question], None]):
        self.asked = asked
        self._changed = threading.Condition()
        self._question: Question | None = None
        self._answer: Answer | Instead | None = None
        self._left = False
        self._wants_question = False
        self._ending: int | None = None  # the policy that the next question is answered with

    def answer(self, question: Question) -> Answer:
        """Return somebody's reply, or raise it where it is no answer. Raises LeftOff when the run is left instead."""
        with self._changed:
            beforehand = self._answer_beforehand(question)
            self._question, self._answer = question, beforehand
            self._wants_question, self._ending = False, None
            if beforehand:
                return beforehand
        self.asked(question)
        with self._changed:
            self._changed.wait_for(lambda: self._answer is not None or self._left)
            self._question = None
            if self._answer is None:
                raise LeftOff
            if isinstance(self._answer, Instead):
                raise self._answer
            return self._answer

    def reply(self, question: Question, answer: Answer | Instead) -> bool:
        """Answer a question, or say what is wanted instead.

        Return False if it is not open: somebody else was first, or the run was left. Raises ValueError, and the
        question stays open, if its front has no such policy.
        """
        if isinstance(answer, Answer):
            question.policy(answer.policy)
        with self._changed:
            if question is not self._question or self._answer is not None or self._left:
                return False
            self._answer = answer
            self._changed.notify_all()
            return True

    def wants_question(self, generation: int) -> bool:
        """Return whether somebody has asked for the next question."""
        return self._wants_question

    def ask_now(self) -> None:
        """Have the next question asked before the next generation."""
        self._wants_question = True

    def end_with(self, policy: int) -> None:
        """End the run before its next generation, with this policy as its result, if it is there by then."""
        with self._changed:
            self._wants_question, self._ending = True, policy

    def leave(self) -> None:
        """Wait no longer; from now on there is no reply."""
        with self._changed:
            self._left = True
            self._changed.notify_all()

    def _answer_beforehand(self, question: Question) -> Answer | None:
        known = self._ending in [policy.id for policy in question.whole.front]
        return Answer(self._ending, stop=True) if known and self._ending is not None else None

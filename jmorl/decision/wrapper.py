"""A decision maker around another one, which decides for itself whom to ask."""

from typing import Any

import numpy as np

from jmorl.decision.answers import Answer, PointAnswer
from jmorl.decision.protocol import AnyQuestion, DecisionMaker, PointQuestion, Question


class Wrapper(DecisionMaker):
    """Passes everything on to `user`; a subclass says in `respond` what it does not."""

    def __init__(self, user: DecisionMaker):
        self.user = user
        self.patient, self.signs = user.patient, user.signs

    def respond(self, question: AnyQuestion) -> Any:
        """Return the answer to a question of any kind."""
        return self.user.respond(question)

    def follow_up(self, question: AnyQuestion, answer: Any) -> AnyQuestion | None:
        """Return the user's further question about an answer."""
        return self.user.follow_up(question, answer)

    def remembers(self, question: AnyQuestion) -> bool:
        """Return whether the user has answered this question before."""
        return self.user.remembers(question)

    def wants_question(self, generation: int) -> bool:
        """Return whether the user wants to be asked before this generation."""
        return self.user.wants_question(generation)

    def answer(self, question: Question) -> Answer:
        """Return the preferred member of the question's front."""
        answer: Answer = self.respond(question)
        return answer

    def choose_point(self, question: PointQuestion) -> PointAnswer:
        """Return the user's answer to a question of E-NAUTILUS."""
        return self.user.choose_point(question)

    def utility(self, values: np.ndarray) -> np.ndarray | None:
        """Return the user's utilities [N] of objective vectors [N, M]; None without a utility."""
        return self.user.utility(values)

    def satisfied(self, values: np.ndarray) -> bool:
        """Return whether a run with the front `values` [N, M] may stop early."""
        return self.user.satisfied(values)

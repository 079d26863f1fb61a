"""A stand-in: it answers in a decision maker's place where their earlier answers leave little doubt."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from jmorl.decision.preferences import Choice, PreferenceModel
from jmorl.decision.protocol import Answer, AnyQuestion, DecisionMaker, PointAnswer, PointQuestion, Question
from jmorl.decision.records import DecisionRecord
from jmorl.decision.remembered import RunRecord, by_stand_in

# The expected regret up to which the stand-in answers, in shares of the utility's range over the front. A choice that
# steers can be corrected in the next generation, the last one cannot.
TRUSTED_REGRET = {"steer": 0.02, "final": 0.01}


class StandIn(DecisionMaker):
    """Answers as `user` would, by a preference model of their answers, and asks them where it is not sure.

    It is sure where its expected regret is small (`TRUSTED_REGRET`). `history` has the records of a run that
    goes on; only what the user said themselves counts. The same answers give the same posterior.
    """

    def __init__(self, user: DecisionMaker, seed: int, history: Iterable[RunRecord] = ()):
        self.user = user
        self.seed = seed
        self.choices = [choice for choice in map(_recorded, history) if choice]

    def respond(self, question: AnyQuestion) -> Any:
        """Return the answer to a question of any kind; only which policy of a front is preferred is answered here."""
        if not isinstance(question, Question) or question.purpose not in TRUSTED_REGRET:
            return self.user.respond(question)
        own = self._own_answer(question)
        if own:
            return own
        answer: Answer = self.user.respond(question)
        ids = [policy.id for policy in question.front]
        if len(ids) > 1:
            self.choices.append(Choice(question.values, ids.index(answer.policy)))
        return answer

    def _own_answer(self, question: Question) -> Answer | None:
        """Return the answer that the user's earlier ones lead to; None where they leave it open."""
        if len(question.front) == 1:
            return Answer(question.front[0].id, stand_in=True, reason="there is no other policy")
        if not self.choices:
            return None
        verdict = PreferenceModel(question.values, self.choices, self.seed).verdict()
        if verdict.regret > TRUSTED_REGRET[question.purpose]:
            return None
        policy = question.front[verdict.best].id
        reason = f"the answers so far agree on it: expected regret {verdict.regret:.1%} of the range of utility"
        return Answer(policy, stand_in=True, reason=reason)

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


def _recorded(record: RunRecord) -> Choice | None:
    """Return the choice in a record; None if the user did not make it, or had none."""
    if not isinstance(record, DecisionRecord) or by_stand_in(record) or len(record.shown) < 2:
        return None
    ids = [shown.policy for shown in record.shown]
    return Choice(np.array([shown.values for shown in record.shown]), ids.index(record.policy))

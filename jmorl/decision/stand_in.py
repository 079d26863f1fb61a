"""A stand-in: it answers where a decision maker's answers leave little doubt, and shortens what it asks them."""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from jmorl.decision.preferences import Choice, PreferenceModel, Verdict
from jmorl.decision.protocol import Answer, AnyQuestion, DecisionMaker, Question
from jmorl.decision.records import DecisionRecord
from jmorl.decision.remembered import RunRecord, by_stand_in
from jmorl.decision.wrapper import Wrapper

# The expected regret up to which the stand-in answers, in shares of the utility's range over the front. A choice that
# steers can be corrected in the next generation, the last one cannot.
TRUSTED_REGRET = {"steer": 0.02, "final": 0.01}
FEW = 5  # policies in a short question


class StandIn(Wrapper):
    """Answers as `user` would, by a preference model of their answers, and asks them where it is not sure.

    It is sure where its expected regret is small (`TRUSTED_REGRET`); with `ask` "always" it never is. With `shows`
    "few" it asks about few policies at a time: the best by expectation, the one that was chosen last, and those whose
    comparison tells most. `history` has the records of a run that goes on; only what the user said themselves counts.
    The same answers give the same posterior.
    """

    def __init__(
        self,
        user: DecisionMaker,
        seed: int,
        history: Iterable[RunRecord] = (),
        ask: Literal["always", "unsure"] = "unsure",
        shows: Literal["front", "few"] = "front",
    ):
        super().__init__(user)
        self.seed = seed
        self.choices = [choice for choice in map(_recorded, history) if choice]
        self.ask = ask
        self.shows = shows

    def decide(self, question: AnyQuestion) -> tuple[AnyQuestion, Any]:
        """Return the question as it was asked, and the answer.

        Only which policy of a front is preferred is answered here, or asked about fewer policies.
        """
        if not isinstance(question, Question) or question.purpose not in TRUSTED_REGRET:
            return question, self.user.respond(question)
        if len(question.front) == 1 and self.ask == "unsure":
            return question, Answer(question.front[0].id, stand_in=True, reason="there is no other policy")
        model = PreferenceModel(question.values, self.choices, self.seed)
        verdict = model.verdict()
        if self._is_sure(question, verdict):
            reason = f"the answers so far agree on it: expected regret {verdict.regret:.1%} of the range of utility"
            return question, Answer(question.front[verdict.best].id, stand_in=True, reason=reason)
        asked = self._shortened(question, model, verdict) if self.shows == "few" else question
        answer: Answer = self.user.respond(asked)
        if answer.policy not in [policy.id for policy in asked.front]:
            asked = asked.whole  # which they wanted to see
        ids = [policy.id for policy in asked.front]
        if len(ids) > 1:
            self.choices.append(Choice(asked.values, ids.index(answer.policy)))
        return asked, answer

    def _is_sure(self, question: Question, verdict: Verdict) -> bool:
        """Return whether the user's earlier answers leave little doubt."""
        return self.ask == "unsure" and bool(self.choices) and verdict.regret <= TRUSTED_REGRET[question.purpose]

    def _shortened(self, question: Question, model: PreferenceModel, verdict: Verdict) -> Question:
        """Return the question about a few policies; the others may be chosen, too."""
        ids = [policy.id for policy in question.front]
        previous = [ids.index(question.previous)] if question.previous in ids else []
        rows = model.telling(FEW, [verdict.best, *previous])
        few = tuple(question.front[row] for row in rows)
        return replace(question, front=few, others=tuple(policy for policy in question.front if policy not in few))

    def respond(self, question: AnyQuestion) -> Any:
        """Return the answer to a question of any kind."""
        return self.decide(question)[1]


def _recorded(record: RunRecord) -> Choice | None:
    """Return the choice in a record; None if the user did not make it, or had none."""
    if not isinstance(record, DecisionRecord) or by_stand_in(record) or len(record.shown) < 2:
        return None
    ids = [shown.policy for shown in record.shown]
    return Choice(np.array([shown.values for shown in record.shown]), ids.index(record.policy))

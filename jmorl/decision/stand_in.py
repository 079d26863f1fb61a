"""A stand-in: it answers where a decision maker's answers leave little doubt, and shortens what it asks them."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from jmorl.decision.answers import Answer, AnswerError, Instead, Skip
from jmorl.decision.preferences import Comparison, PreferenceModel, Verdict
from jmorl.decision.protocol import AnyQuestion, DecisionMaker, Form, Question
from jmorl.decision.records import DecisionRecord, decision_record
from jmorl.decision.remembered import RunRecord, by_stand_in
from jmorl.decision.wrapper import Wrapper
from jmorl.search.bounds import within
from jmorl.search.policy import Policy

Ask = Literal["always", "unsure"]
Shows = Literal["front", "few", "pair", "rank"]
FORMS: dict[Shows, Form] = {"front": "best", "few": "best", "pair": "pair", "rank": "rank"}

# The expected regret up to which the stand-in answers, in shares of the utility's range over the front. A choice that
# steers can be corrected in the next generation, the last one cannot.
TRUSTED_REGRET = {"steer": 0.07, "final": 0.02}
DOUBTED_REGRET = 0.05  # expected of an answer after it was given, from which on it may be a mistake
FEWEST_AGAINST = 2  # other answers that it may be against
EARLIER_ANSWERS = "by your earlier answers it is the best, give or take {cost:.0f} % of the front's range"
SKIPPED = "you skipped the question, and it is the best by your earlier answers"
FEW = 5  # policies in a short question


class StandIn(Wrapper):
    """Answers as `user` would, by a preference model of their answers, and asks them where it is not sure.

    It is sure where its expected regret is small (`TRUSTED_REGRET`); with `ask` "always", or for a patient user, it
    never is, nor at the end for a user who signs. With `shows` "few" it asks about few policies at a time: the best by
    expectation, the one that was chosen last, and those whose comparison tells most; with "rank" for their order; with
    "pair" about two, after which it goes on with the best by expectation, and at the end about few: the result is what
    the user chooses. A user who raises `AskPair` at a question that steers is asked about a pair this once; one who
    raises `Skip` leaves the choice to the stand-in.

    `history` has the records of a run that goes on; only what the user said themselves counts. The same answers give
    the same posterior. With `ask_now` it leaves the next question to the user, however sure it is: so somebody takes
    back what it has answered.
    """

    def __init__(
        self,
        user: DecisionMaker,
        seed: int,
        history: Iterable[RunRecord] = (),
        ask: Ask = "unsure",
        shows: Shows = "front",
        ask_now: bool = False,
    ):
        super().__init__(user)
        self.seed = seed
        history = list(history)
        self.ask = "always" if user.patient else ask
        self.shows = shows
        self.ask_now = ask_now
        decisions = [each for each in history if isinstance(each, DecisionRecord)]
        self.answers: list[Comparison] = []
        self.limits: tuple[float, ...] | None = None
        for each in decisions:
            self._take_note(each)
        self.chose_last = bool(decisions) and by_stand_in(decisions[-1])

    def decide(self, question: AnyQuestion) -> tuple[AnyQuestion, Any]:
        """Return the question as it was asked, and the answer.

        Only which policy of a front is preferred is answered here, or asked about fewer policies.
        """
        if not isinstance(question, Question) or question.purpose not in TRUSTED_REGRET:
            return question, self.user.respond(question)
        question = replace(question, previous_by_stand_in=self.chose_last)
        if question.again:
            return self._heard(question, question)
        if len(question.front) == 1 and self.ask == "unsure" and self._reachable(question):
            return self._chosen_for_them(question, 0, "there is no other policy")
        if self.ask == "always" and self.shows == "front":
            return self._heard(question, question)
        model = self._model(question)
        verdict = model.verdict()
        asked = self._shortened(question, model, verdict)
        if self._is_sure(question, verdict) and not self.ask_now and not self.user.remembers(asked):
            return self._chosen_for_them(question, verdict.best, EARLIER_ANSWERS.format(cost=100 * verdict.regret))
        self.ask_now = False
        return self._heard(question, asked)

    def _heard(self, question: Question, asked: Question) -> tuple[Question, Answer]:
        """Ask the user. Where they want something else instead, skip the question, or ask about a pair of it."""
        try:
            return self._asked(asked)
        except Instead as instead:
            if question.purpose != "steer" or question.again:
                raise AnswerError("this question can neither be skipped nor be asked about a pair") from instead
            self.limits = instead.limits or self.limits
            question = replace(question, limits=self.limits)
            model = self._model(question)
            if isinstance(instead, Skip):
                return self._chosen_for_them(question, model.verdict().best, SKIPPED, instead.limits)
            if asked.form == "pair" or len(question.front) == 1:
                raise AnswerError("there is no other pair to ask about") from instead
            asked, answer = self._heard(question, _about(question, model.sampled_pair(), "pair"))
            return asked, replace(answer, limits=answer.limits or instead.limits)

    def _chosen_for_them(
        self, question: Question, row: int, reason: str, limits: tuple[float, ...] | None = None
    ) -> tuple[Question, Answer]:
        """Return the question as it is, and an answer that is not the user's: the policy in this row of the front."""
        self.chose_last = True
        return question, Answer(question.front[row].id, stand_in=True, reason=reason, limits=limits)

    def _asked(self, asked: Question) -> tuple[Question, Answer]:
        """Ask the user, and take note of what they say. Return the question as they saw it, and the answer."""
        self.chose_last = False
        answer: Answer = self.user.respond(asked)
        unseen = asked.form == "best" and not answer.equal and not _is_shown(asked, answer.policy)
        if unseen or not all(_is_shown(asked, each) for each in answer.ranking):
            asked = asked.whole  # which they wanted to see
        if asked.form == "pair" and not answer.ranking and not answer.equal and _is_shown(asked, answer.policy):
            answer = replace(answer, ranking=(answer.policy,))
        self._take_note(decision_record(asked, asked.checked(answer)))
        if answer.stand_in:  # a log of a question that was skipped
            self.chose_last = True
            return asked, answer
        if answer.equal and asked.again:  # they see no reason to take back what they have just chosen
            answer = replace(answer, policy=asked.front[1].id)
        elif not answer.stop and (answer.equal or (asked.form == "pair" and answer.ranking)):
            whole = asked.whole
            answer = replace(answer, policy=whole.front[self._model(whole).verdict().best].id)
        return asked, answer

    def _take_note(self, record: DecisionRecord) -> None:
        """Learn from an answer, and remember the limits that it sets; a stand-in's teaches nothing."""
        self.limits = record.answer.limits or self.limits
        said = None if by_stand_in(record) else _said(record, self.limits)
        self.answers += [said] if said else []

    def wants_question(self, generation: int) -> bool:
        """Return whether the user wants to be asked before this generation; then nobody answers for them."""
        wanted = self.user.wants_question(generation)
        self.ask_now = self.ask_now or wanted
        return wanted

    def follow_up(self, question: AnyQuestion, answer: Any) -> AnyQuestion | None:
        """Return the question whether an answer was meant so, where the user's other answers speak for another policy.

        Whoever says so twice is believed.
        """
        if self.ask != "unsure":
            return super().follow_up(question, answer)
        if not isinstance(question, Question) or not question.was_asked(answer) or question.again or answer.stop:
            return None
        if question.purpose not in TRUSTED_REGRET or question.form != "best" or len(self.answers) <= FEWEST_AGAINST:
            return None
        whole = question.whole
        model = self._model(whole)
        expected = model.utilities(whole.values).mean(axis=0)  # [N]
        ids = [policy.id for policy in whole.front]
        best, chosen = int(expected.argmax()), ids.index(answer.policy)
        if expected[best] - expected[chosen] < DOUBTED_REGRET:
            return None
        pair = whole.front[best], whole.front[chosen]  # the doubt first, then what they have just chosen
        return replace(whole, front=pair, others=_without(whole.front, pair), again=True, limits=self.limits)

    def _model(self, question: Question) -> PreferenceModel:
        """Return the posterior by now."""
        limits = None if self.limits is None else np.array(self.limits)
        return PreferenceModel(question.values, self.answers, self.seed, question.generation, limits)

    def _is_sure(self, question: Question, verdict: Verdict) -> bool:
        """Return whether the user's earlier answers leave little doubt. Where nothing reaches their limits they do."""
        trusted = bool(self.answers) and verdict.regret <= TRUSTED_REGRET[question.purpose]
        theirs = question.purpose == "final" and self.signs
        return self.ask == "unsure" and trusted and not theirs and self._reachable(question)

    def _reachable(self, question: Question) -> bool:
        """Return whether a policy reaches the user's limits."""
        return self.limits is None or bool(within(question.values, np.array(self.limits)).any())

    def _shortened(self, question: Question, model: PreferenceModel, verdict: Verdict) -> Question:
        """Return the question in the form wanted, about a few policies; the others may be chosen, too."""
        shows = "few" if self.shows == "pair" and question.purpose == "final" else self.shows
        if shows == "front" or len(question.front) == 1:
            return question
        if shows == "pair":
            rows = model.sampled_pair()
        else:
            ids = [policy.id for policy in question.front]
            previous = [ids.index(question.previous)] if question.previous in ids else []
            rows = model.telling(FEW, [verdict.best, *previous])
        return _about(question, rows, FORMS[shows])

    def respond(self, question: AnyQuestion) -> Any:
        """Return the answer to a question of any kind."""
        return self.decide(question)[1]


def _about(question: Question, rows: Sequence[int], form: Form) -> Question:
    """Return the question about some of its policies; the others may be chosen, too."""
    few = tuple(question.front[row] for row in rows)
    return replace(question, front=few, others=_without(question.whole.front, few), form=form)


def _without(policies: Sequence[Policy], some: Sequence[Policy]) -> tuple[Policy, ...]:
    return tuple(policy for policy in policies if policy not in some)


def _is_shown(question: Question, policy: int) -> bool:
    return policy in [each.id for each in question.front]


def _said(record: DecisionRecord, limits: tuple[float, ...] | None) -> Comparison | None:
    """Return what a record says of the policies that were shown; None if there was no other policy.

    Where the best of them reaches the limits in force, what does not is ruled out by these, and tells nothing else.
    """
    shown = {each.policy: each.values for each in record.shown}
    ranking = () if record.equal else record.ranking or (record.policy,)
    if not record.equal and not record.ranking:
        shown.setdefault(record.policy, record.values)  # they like none of those shown better
    if limits:
        good = {policy: values for policy, values in shown.items() if np.all(np.array(values) >= limits)}
        if good and (not ranking or ranking[0] in good):
            shown, ranking = good, tuple(policy for policy in ranking if policy in good)
    if len(shown) < 2:
        return None
    rows = list(shown)
    return Comparison(np.array(list(shown.values())), tuple(map(rows.index, ranking)), record.generation)

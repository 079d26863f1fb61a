"""A user who decides as a decision log says: the same run again, or a run that somebody prepared."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from jmorl.decision.answers import Answer, AskPair, Choose, PointAnswer
from jmorl.decision.protocol import AnyQuestion, DecisionMaker, PointQuestion, Question
from jmorl.decision.records import AnswerRecord, DecisionRecord, PointRecord, ScriptError, read_log
from jmorl.decision.remembered import is_of
from jmorl.search.policy import Policy

R = TypeVar("R", DecisionRecord, PointRecord)


class ScriptedUser(DecisionMaker):
    """Replays the decision log at `path`; see `jmorl.decision.records`.

    A line that goes back to an earlier question of its purpose replaces that decision and all that followed it. A run
    stops where the log has only a final choice left. Raises ScriptError if the log cannot be read, has no answer to a
    question, or chose a policy that the question does not show.
    """

    def __init__(self, path: Path):
        self.path = path
        records = read_log(path)
        decisions = [record for record in records if isinstance(record, DecisionRecord)]
        self._steering = _timeline(record for record in decisions if record.purpose == "steer")
        self._final = _timeline(record for record in decisions if record.purpose == "final")
        self.signs = any(not record.stand_in for record in self._final.values())
        self._points = _timeline(record for record in records if isinstance(record, PointRecord))
        self._others = [record for record in records if isinstance(record, AnswerRecord)]

    def respond(self, question: AnyQuestion) -> Any:
        """Return the answer to a question of any kind."""
        if isinstance(question, (Question, PointQuestion)):
            return super().respond(question)
        # The last of equal ones: an answer that was given again replaces the earlier one.
        for record in reversed(self._others):
            if is_of(record, question):
                return question.from_json(record.answer)
        raise ScriptError(
            f"{self.path} has no answer to this question of kind {question.purpose!r} for generation "
            f"{question.generation}; add it, or replay the file with the settings of the run that wrote it"
        )

    def answer(self, question: Question) -> Answer:
        """Return the preferred member of the question's front. Raises AskPair where the log has a pair instead."""
        generation, again = question.generation, int(question.again)
        logs = (self._steering, self._final) if question.purpose == "steer" else (self._final,)
        found = [log[place] for place in ((generation, again), (generation, 0)) for log in logs if place in log]
        record = found[0] if found else None
        steering = record is not None and record.purpose == "steer"
        if record is None:
            generations = sorted(generation for generation, _ in self._steering | self._final)
            raise ScriptError(
                f"{self.path} has no decision for generation {question.generation}, only for {generations}; add that "
                "decision to it, or replay it with the settings of the run that wrote it"
            )
        if steering and _is_about_pair(record) and question.form != "pair" and len(question.whole.front) > 2:
            raise AskPair
        policies = question.whole.front
        index = self._find(record.policy, record.values, policies, question.generation)
        stop = record.stop or (question.purpose == "steer" and not steering)
        return replace(record.answer, policy=policies[index].id, stop=stop, ranking=self._ranked(record, policies))

    def follow_up(self, question: AnyQuestion, answer: Any) -> AnyQuestion | None:
        """Return the second question about a choice, if the log has one."""
        if not isinstance(question, Question) or question.again:
            return None
        record = (self._steering if question.purpose == "steer" else self._final).get((question.generation, 1))
        if record is None:
            return None
        policies = question.whole.front
        rows = [self._find(each.policy, each.values, policies, question.generation) for each in record.shown]
        others = tuple(policy for row, policy in enumerate(policies) if row not in rows)
        return replace(question.whole, front=tuple(policies[row] for row in rows), others=others, again=True)

    def wants_question(self, generation: int) -> bool:
        """Return whether the log has an answer that somebody gave themselves before this generation."""
        record = self._steering.get((generation, 0))
        return record is not None and not record.stand_in

    def choose_point(self, question: PointQuestion) -> PointAnswer:
        """Return the answer to a question of E-NAUTILUS."""
        record = self._points.get((question.generation, question.number))
        if record is None:
            raise ScriptError(
                f"{self.path} has no answer number {question.number} in E-NAUTILUS at generation "
                f"{question.generation}; add it, or replay the file with the settings of the run that wrote it"
            )
        if not isinstance(record.answer, Choose):
            return record.answer
        chosen = record.shown[record.answer.point]
        return Choose(self._find(chosen.policy, chosen.values, question.representatives, question.generation))

    def _ranked(self, record: DecisionRecord, policies: tuple[Policy, ...]) -> tuple[int, ...]:
        """Return the record's ranking, by the ids that the policies have here."""
        values = {shown.policy: shown.values for shown in record.shown}
        if not values.keys() >= set(record.ranking):
            raise ScriptError(f"{self.path} ranks policies at generation {record.generation} that it does not show")
        found = [self._find(each, values[each], policies, record.generation) for each in record.ranking]
        return tuple(policies[index].id for index in found)

    def _find(self, policy: int, values: tuple[float, ...], shown: tuple[Policy, ...], generation: int) -> int:
        """Return the index of the shown policy with these values; if there are several, rather the one with this id.

        The id alone proves nothing: every run numbers its policies from zero.
        """
        wanted = np.array(values)
        matches = [
            (each.id != policy, float(np.abs(each.values - wanted).max()), index)
            for index, each in enumerate(shown)
            if each.values.shape == wanted.shape and np.allclose(each.values, wanted)
        ]
        if not matches:
            raise ScriptError(
                f"{self.path} chose policy {policy} with values {list(values)} at generation {generation}, but no such "
                "policy is shown here: the log is of another run; compare environment, seed and settings"
            )
        return min(matches)[-1]


def _is_about_pair(record: DecisionRecord) -> bool:
    """Return whether a pair was asked about: then the run may have gone on with a third policy."""
    return (
        len(record.shown) == 2 and not record.again and not record.stand_in and (bool(record.ranking) or record.equal)
    )


def _timeline(records: Iterable[R]) -> dict[tuple[int, int], R]:
    """Return the records by generation and number, without those that a later line goes back behind."""
    kept: dict[tuple[int, int], R] = {}
    for record in records:
        place = record.generation, record.number if isinstance(record, PointRecord) else int(record.again)
        kept = {earlier: each for earlier, each in kept.items() if earlier < place}
        kept[place] = record
    return kept

"""E-NAUTILUS as a dialogue whose steps somebody takes when they like."""

from dataclasses import dataclass, field
from functools import cached_property

from envs.core import Objective
from jmorl.decision import enautilus
from jmorl.decision.answers import PointAnswer
from jmorl.decision.navigation import respond
from jmorl.decision.protocol import PointQuestion
from jmorl.decision.records import PointRecord, point_record
from jmorl.search.policy import Policy, values_of


@dataclass(frozen=True, eq=False)
class Dialogue:
    """The state of a dialogue: at a question, or at its end."""

    generation: int  # whose front this is
    objectives: tuple[Objective, ...]
    front: tuple[Policy, ...]
    state: enautilus.State
    records: tuple[PointRecord, ...] = ()
    before: "Dialogue | None" = field(default=None, repr=False)  # the last answer

    @property
    def chosen(self) -> Policy | None:
        """Return the policy that the dialogue has led to; None before its end."""
        return self.front[enautilus.result(self.state)] if enautilus.finished(self.state) else None

    @cached_property
    def question(self) -> PointQuestion:
        """Return the question that is open. Raises ValueError at the end. Takes a moment for a large front."""
        points = enautilus.intermediate_points(self.state)
        return PointQuestion(self.generation, len(self.records), self.objectives, self.front, self.state, points)


def begin(
    front: tuple[Policy, ...], objectives: tuple[Objective, ...], generation: int, iterations: int, points: int
) -> Dialogue:
    """Begin a dialogue. Raises ValueError for an empty front, or for numbers below 1."""
    if not front:
        raise ValueError("there is no front yet")
    return Dialogue(generation, objectives, front, enautilus.begin(values_of(front), iterations, points))


def reply(dialogue: Dialogue, answer: PointAnswer) -> Dialogue:
    """Return the dialogue after an answer. Raises ValueError if the question does not allow it."""
    question = dialogue.question
    state = respond(question, answer)
    records = (*dialogue.records, point_record(question, answer))
    return Dialogue(dialogue.generation, dialogue.objectives, dialogue.front, state, records, dialogue)

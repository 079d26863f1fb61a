"""The one protocol between a run and whoever decides: a question in, an answer out.

The run imports this; users implement it; neither knows the other.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal

import numpy as np

from envs.core import Objective
from jmorl.decision.answers import Answer, AnswerError, Choose, PointAnswer, shortly, whole_number
from jmorl.decision.enautilus import IntermediatePoint, State
from jmorl.search.policy import Policy, values_of
from jmorl.search.prospect import Prospect

Purpose = Literal["steer", "final", "enautilus", "pair"]
Form = Literal["best", "pair", "rank"]


class AnyQuestion(ABC):
    """Something that a decision maker can be asked. A method may bring kinds of its own.

    A kind says how it is put to a decision maker, what a valid answer is, and how an answer is written down.
    """

    purpose: str  # names the kind in the decision log
    generation: int  # the one about to start; at the end, the one after the last
    objectives: tuple[Objective, ...]

    @property
    @abstractmethod
    def shown(self) -> tuple[Policy, ...]:
        """The policies that are shown."""

    @property
    def values(self) -> np.ndarray:  # [N, M]
        """The objective vectors of the policies that are shown."""
        return values_of(self.shown)

    @abstractmethod
    def put_to(self, user: "DecisionMaker") -> Any:
        """Return the user's answer, by whichever of their abilities answers this kind."""

    @abstractmethod
    def checked(self, answer: Any) -> Any:
        """Return the answer in its proper types. Raise AnswerError if it is none to this question."""

    @abstractmethod
    def to_json(self, answer: Any) -> dict[str, Any]:
        """Return a checked answer as JSON can hold it."""

    def from_json(self, fields: dict[str, Any]) -> Any:
        """Return the answer that `to_json` wrote. Raise AnswerError if it is none to this question."""
        raise AnswerError(f"answers to a question of kind {self.purpose!r} cannot be read back")

    def chosen(self, answer: Any) -> Policy | None:
        """Return the policy that a checked answer prefers to all others shown; None if it prefers none."""
        return None

    def stops(self, answer: Any) -> bool:
        """Return whether a checked answer ends the run with the policy it chose."""
        return False

    def was_asked(self, answer: Any) -> bool:
        """Return whether a checked answer is the decision maker's own, and not a stand-in's."""
        return True


@dataclass(frozen=True)
class Question(AnyQuestion):
    """The question which policy of a front is preferred.

    `purpose` is "steer" at the start of a generation and "final" at the end of a run, when the
    answer is the run's result. `front` has at least one member; at the end of an interactive run
    it holds those within the bounds, and `others` the rest. "enautilus": which of the policies that the
    points of E-NAUTILUS head for, see `DecisionMaker.choose_point`; "pair": which of two, see `DecisionMaker.compare`.

    `form` is what is wanted: the "best" of those shown; the better one of a "pair"; or to "rank" those shown from the
    best down. Whatever the form, the best one is answer enough.
    """

    purpose: Purpose
    generation: int
    objectives: tuple[Objective, ...]
    front: tuple[Policy, ...]
    bounds: np.ndarray  # [M] those in force; -inf before the first choice
    previous: int | None  # id of the policy chosen last
    others: tuple[Policy, ...] = ()  # that may be chosen, too, but are shown only if somebody wants to see them
    form: Form = "best"
    limits: tuple[float, ...] | None = None  # [M] that somebody has set, -inf where there is none; None: never any
    previous_by_stand_in: bool = False  # the policy chosen last was a stand-in's choice
    again: bool = False  # the second question about one choice, see `DecisionMaker.follow_up`
    # In a run: what choosing a policy would mean; None where it would change nothing.
    prospect: Callable[[Policy], Prospect | None] = field(default=lambda policy: None, compare=False, repr=False)

    @property
    def shown(self) -> tuple[Policy, ...]:
        """The front."""
        return self.front

    @property
    def whole(self) -> "Question":
        """The same question with all policies shown."""
        return replace(self, front=(*self.front, *self.others), others=(), form="best")

    def policy(self, policy_id: int) -> Policy:
        """Return the policy with this id, shown or not. Raise ValueError if there is none."""
        policies = (*self.front, *self.others)
        for policy in policies:
            if policy.id == policy_id:
                return policy
        raise ValueError(f"policy {policy_id} is not among the policies shown: {[policy.id for policy in policies]}")

    def put_to(self, user: "DecisionMaker") -> Any:
        """Return `user.answer(self)`."""
        return user.answer(self)

    def checked(self, answer: Any) -> Answer:
        """Return the answer if it is an `Answer` with a policy of the front. Raise AnswerError."""
        if not isinstance(answer, Answer):
            raise AnswerError(f"answer must return a jmorl.Answer(policy id), not {shortly(answer)}")
        try:
            self.policy(answer.policy)
            for each in answer.ranking:
                self.policy(each)
        except ValueError as error:
            raise AnswerError(str(error)) from None
        if answer.ranking and self.form != "pair" and answer.ranking[0] != answer.policy:
            raise AnswerError(
                f"the ranking must begin with the preferred policy {answer.policy}: {list(answer.ranking)}"
            )
        if answer.limits is not None and len(answer.limits) != len(self.objectives):
            raise AnswerError(f"limits must be {len(self.objectives)} numbers, not {shortly(answer.limits)}")
        return answer

    def to_json(self, answer: Any) -> dict[str, Any]:
        """Return the fields of the answer."""
        return asdict(answer)

    def from_json(self, fields: dict[str, Any]) -> Any:
        """Return the answer with these fields."""
        return self.checked(Answer(**fields))

    def chosen(self, answer: Any) -> Policy:
        """Return the policy of the answer."""
        return self.policy(answer.policy)

    def stops(self, answer: Any) -> bool:
        """Return whether the run shall end here."""
        return bool(answer.stop)

    def was_asked(self, answer: Any) -> bool:
        """Return whether a checked answer is the decision maker's own, and not a stand-in's."""
        return not answer.stand_in


@dataclass(frozen=True)
class PairQuestion(AnyQuestion):
    """The question which of two policies is preferred."""

    generation: int
    objectives: tuple[Objective, ...]
    pair: tuple[Policy, Policy]
    purpose: str = "pair"

    @property
    def shown(self) -> tuple[Policy, ...]:
        """Both."""
        return self.pair

    def put_to(self, user: "DecisionMaker") -> Any:
        """Return `user.compare(self)`."""
        return user.compare(self)

    def checked(self, answer: Any) -> int | None:
        """Return the id of the preferred policy, or None for no difference. Raise AnswerError."""
        if answer is None:
            return None
        ids = [policy.id for policy in self.pair]
        preferred = answer.id if isinstance(answer, Policy) else whole_number("the preferred policy", answer, 0)
        if preferred not in ids:
            raise AnswerError(f"policy {preferred} is neither of the two shown: {ids}")
        return preferred

    def to_json(self, answer: Any) -> dict[str, Any]:
        """Return which is preferred."""
        return {"preferred": answer}

    def from_json(self, fields: dict[str, Any]) -> int | None:
        """Return which is preferred."""
        return self.checked(fields.get("preferred"))


@dataclass(frozen=True)
class WeightQuestion(AnyQuestion):
    """The question how much each objective matters, compared with the others."""

    generation: int
    objectives: tuple[Objective, ...]
    front: tuple[Policy, ...]  # for orientation
    purpose: str = "weights"

    @property
    def shown(self) -> tuple[Policy, ...]:
        """The front."""
        return self.front

    def put_to(self, user: "DecisionMaker") -> Any:
        """Return `user.weigh(self)`."""
        return user.weigh(self)

    def checked(self, answer: Any) -> tuple[float, ...]:
        """Return weights [M] with a sum of one. Raise AnswerError."""
        try:
            weights = np.asarray(answer, float)
        except (TypeError, ValueError):
            raise AnswerError(f"weights must be {len(self.objectives)} numbers, not {shortly(answer)}") from None
        valid = weights.shape == (len(self.objectives),) and np.isfinite(weights).all() and (weights >= 0).all()
        if not valid or not weights.any():
            raise AnswerError(
                f"weights must be {len(self.objectives)} numbers from zero upwards, not all zero, not {shortly(answer)}"
            )
        return tuple((weights / weights.sum()).tolist())

    def to_json(self, answer: Any) -> dict[str, Any]:
        """Return the weights."""
        return {"weights": list(answer)}

    def from_json(self, fields: dict[str, Any]) -> tuple[float, ...]:
        """Return the weights."""
        return self.checked(fields.get("weights"))


@dataclass(frozen=True)
class PointQuestion(AnyQuestion):
    """Which of these points of E-NAUTILUS do you prefer? Or step back, or change how to go on."""

    generation: int  # whose archive this is; with `number` it names the question
    number: int  # of answers given before in this dialogue
    objectives: tuple[Objective, ...]
    front: tuple[Policy, ...]  # N members, in the order of the state's arrays
    state: State
    points: tuple[IntermediatePoint, ...]  # at least one
    purpose: str = "enautilus"

    @property
    def representatives(self) -> tuple[Policy, ...]:
        """The policy that each point heads for."""
        return tuple(self.front[point.representative] for point in self.points)

    @property
    def shown(self) -> tuple[Policy, ...]:
        """The policies that the points head for."""
        return self.representatives

    def put_to(self, user: "DecisionMaker") -> Any:
        """Return `user.choose_point(self)`."""
        return user.choose_point(self)

    def checked(self, answer: Any) -> PointAnswer:
        """Return the answer if it is a point that is shown, or a way to go on. Raise AnswerError."""
        if not isinstance(answer, PointAnswer):
            raise AnswerError(f"choose_point must return Choose, Back or Adjust, not {shortly(answer)}")
        if isinstance(answer, Choose):
            point = whole_number("point", answer.point, 0)
            if point >= len(self.points):
                raise AnswerError(f"there is no point {point} among the {len(self.points)} shown, from 0")
            return Choose(point)
        return answer

    def to_json(self, answer: Any) -> dict[str, Any]:
        """Return the fields of the answer."""
        return asdict(answer)


class DecisionMaker(ABC):
    """Somebody, or something, that prefers one policy to another.

    Who is `patient` minds no questions, so that no stand-in answers for them.
    """

    patient = False
    signs = False  # whether they name the result of a run themselves, however clear it is

    @abstractmethod
    def answer(self, question: Question) -> Answer:
        """Return which member of the question's front is preferred."""

    def respond(self, question: AnyQuestion) -> Any:
        """Return the answer to a question of any kind. Raise AnswerError for an answer that it does not allow."""
        return question.checked(question.put_to(self))

    def decide(self, question: AnyQuestion) -> tuple[AnyQuestion, Any]:
        """Return the question as it was asked, and the answer: a stand-in may ask about fewer policies."""
        return question, self.respond(question)

    def follow_up(self, question: AnyQuestion, answer: Any) -> AnyQuestion | None:
        """Return a further question about an answer just given, which then takes its place; None if there is none."""
        return None

    def remembers(self, question: AnyQuestion) -> bool:
        """Return whether this question was answered before, so that the answer is given again without asking."""
        return False

    def wants_question(self, generation: int) -> bool:
        """Return whether to ask before this generation, though an earlier answer was to hold until later."""
        return False

    def compare(self, question: PairQuestion) -> int | None:
        """Return the id of the preferred one of two policies, or None for no difference; here: as `answer` has it."""
        unbounded = np.full(len(question.objectives), -np.inf)
        which = Question("pair", question.generation, question.objectives, question.pair, unbounded, previous=None)
        return which.checked(self.answer(which)).policy

    def weigh(self, question: WeightQuestion) -> Sequence[float]:
        """Return how much each objective matters [M], from zero upwards."""
        raise AnswerError(f"{type(self).__name__} cannot say how much each objective matters: it has no `weigh`")

    def choose_point(self, question: PointQuestion) -> PointAnswer:
        """Return the answer to a question of E-NAUTILUS.

        Here: the point that heads for the policy that `answer` prefers among those that the points head for.
        A representative is a policy, so that any decision maker can judge it; an intermediate point is not, and
        the best reachable values seldom belong to a single one. All points mix the same previous point with
        their representatives in the same proportion: for a linear utility this is the best point, too.
        """
        policies = question.representatives
        which = Question(
            "enautilus", question.generation, question.objectives, policies, bounds=question.state.point, previous=None
        )
        preferred = which.checked(self.answer(which)).policy
        return Choose(next(index for index, policy in enumerate(policies) if policy.id == preferred))

    def utility(self, values: np.ndarray) -> np.ndarray | None:
        """Return the utilities [N] of objective vectors [N, M], for the metrics; None if it has no such function."""
        return None

    def satisfied(self, values: np.ndarray) -> bool:
        """Return whether a run with the front `values` [N, M] may stop early."""
        return False

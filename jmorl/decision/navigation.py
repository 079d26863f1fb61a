"""E-NAUTILUS as a dialogue: questions to a decision maker until one policy is left."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import count

from envs.core import Objective
from jmorl.decision import enautilus
from jmorl.decision.answers import Adjust, Back, Choose, PointAnswer
from jmorl.decision.enautilus import State
from jmorl.decision.protocol import PointQuestion
from jmorl.search.policy import Policy, values_of


@dataclass(frozen=True)
class PointDecided:
    """The decision maker has preferred a point, stepped back, or changed how to go on."""

    question: PointQuestion
    answer: PointAnswer


@dataclass(frozen=True)
class NavigationFinished:
    """E-NAUTILUS has led to a policy."""

    chosen: Policy


def navigate(
    front: tuple[Policy, ...],
    objectives: tuple[Objective, ...],
    choose_point: Callable[[PointQuestion], PointAnswer],
    iterations: int,
    points: int,
    generation: int,
) -> Iterator[PointDecided | NavigationFinished]:
    """Lead `choose_point`, usually a decision maker's, to a member of the front, with an event for every answer.

    `generation` is the archive's, and only names the questions. Raises ValueError if the front is empty, if
    `iterations` or `points` is less than 1, or if an answer is impossible.
    """
    if not front:
        raise ValueError("E-NAUTILUS needs at least one policy")
    state = enautilus.begin(values_of(front), iterations, points)
    for number in count():
        if enautilus.finished(state):
            break
        question = PointQuestion(generation, number, objectives, front, state, enautilus.intermediate_points(state))
        answer = choose_point(question)
        state = respond(question, answer)
        yield PointDecided(question, answer)
    yield NavigationFinished(front[enautilus.result(state)])


def run_enautilus(
    front: tuple[Policy, ...],
    objectives: tuple[Objective, ...],
    choose_point: Callable[[PointQuestion], PointAnswer],
    iterations: int,
    points: int,
    generation: int,
) -> Policy:
    """Return the policy that `navigate` ends on."""
    *_, last = navigate(front, objectives, choose_point, iterations, points, generation)
    assert isinstance(last, NavigationFinished)
    return last.chosen


def respond(question: PointQuestion, answer: PointAnswer) -> State:
    """Return the state that an answer leads to. Raises ValueError if the question does not allow it."""
    match answer:
        case Choose(point):
            if not 0 <= point < len(question.points):
                raise ValueError(f"there is no point {point} among the {len(question.points)} shown")
            return enautilus.choose(question.state, question.points[point])
        case Back(steps):
            return enautilus.step_back(question.state, steps)
        case Adjust(iterations_left, points):
            return enautilus.adjust(question.state, iterations_left, points)

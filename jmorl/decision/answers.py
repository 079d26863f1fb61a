"""Answers to questions, and what makes a value a part of one."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from operator import index
from typing import Any

import numpy as np

from jmorl.search.policy import Policy


class AnswerError(ValueError):
    """An answer that its question does not allow. The message says what was wrong, and what it should be."""


@dataclass(frozen=True)
class Answer:
    """The preferred policy, by id, and what the run shall do next.

    Who likes none of those shown better than the policy chosen last answers with that one. Limits hold until others
    are set. NumPy's and other whole numbers become Python's, and a `Policy` its id. Raises AnswerError for anything
    else.
    """

    policy: int
    stop: bool = False  # end the run here, with this policy
    generations: int = 1  # how many generations to go on before the next question, at least 1
    stand_in: bool = False  # a stand-in answered, and nobody was asked (`jmorl.decision.stand_in`)
    reason: str = field(default="", compare=False)  # why a stand-in did
    ranking: tuple[int, ...] = ()  # of those shown, from the best down; who is not in it is worse than who is
    equal: bool = False  # no difference between those shown; `policy` is any of them, or the one chosen last
    limits: tuple[float, ...] | None = None  # [M] what each objective must reach, -inf: anything; None: as before

    def __post_init__(self) -> None:
        ranking = tuple(_policy_id("ranking", each) for each in _listed("ranking", self.ranking))
        if len(set(ranking)) < len(ranking):
            raise AnswerError(f"a policy is twice in the ranking {list(ranking)}")
        if ranking and self.equal:
            raise AnswerError("policies between which there is no difference cannot be ranked")
        for name, value in (
            ("policy", _policy_id("policy", self.policy)),
            ("generations", whole_number("generations", self.generations, 1)),
            ("stop", _truth("stop", self.stop)),
            ("equal", _truth("equal", self.equal)),
            ("ranking", ranking),
            ("limits", None if self.limits is None else tuple(map(_limit, _listed("limits", self.limits)))),
        ):
            object.__setattr__(self, name, value)


class Instead(Exception):
    """What a decision maker raises instead of an answer. `limits` as in an `Answer`: they hold from now on."""

    def __init__(self, limits: tuple[float, ...] | None = None):
        super().__init__(type(self).__doc__)
        self.limits = limits


class Skip(Instead):
    """Go on without an answer: the stand-in chooses by the earlier ones, and nothing is learnt from this question."""


class AskPair(Instead):
    """Ask about two policies instead: the pair whose comparison tells most."""


@dataclass(frozen=True)
class Choose:
    """Move on to a point, by its index among those shown."""

    point: int


@dataclass(frozen=True)
class Back:
    """Undo the last choices."""

    steps: int


@dataclass(frozen=True)
class Adjust:
    """Go on in another number of iterations, or with more or fewer points in each."""

    iterations_left: int  # 0: end here
    points: int


PointAnswer = Choose | Back | Adjust


def _policy_id(name: str, value: Any) -> int:
    """Return the id that a policy has, or that a value is. Raise AnswerError."""
    return value.id if isinstance(value, Policy) else whole_number(name, value, 0)


def _listed(name: str, value: Any) -> Sequence[Any]:
    """Return a sequence, which no text is. Raise AnswerError if it is none."""
    if isinstance(value, (str, bytes)) or not hasattr(value, "__len__") or not hasattr(value, "__iter__"):
        raise AnswerError(f"{name} must be a list, not {shortly(value)}")
    return list(value)


def _truth(name: str, value: Any) -> bool:
    """Return a truth value as Python's `bool`. Raise AnswerError if it is none."""
    if not isinstance(value, (bool, np.bool_)):
        raise AnswerError(f"{name} must be True or False, not {shortly(value)}")
    return bool(value)


def _limit(value: Any) -> float:
    """Return a limit as Python's `float`; None is no limit. Raise AnswerError if it is no number."""
    try:
        number = -math.inf if value is None else float(value)
    except (TypeError, ValueError):
        number = math.nan
    if math.isnan(number) or number == math.inf:
        raise AnswerError(f"a limit must be a number, or -inf for none, not {shortly(value)}")
    return number


def whole_number(name: str, value: Any, least: int) -> int:
    """Return a whole number as Python's `int`. Raise AnswerError if it is none, or less than `least`."""
    try:
        number = int(value) if isinstance(value, (float, np.floating)) and float(value).is_integer() else index(value)
    except TypeError:
        raise AnswerError(f"{name} must be a whole number, not {shortly(value)}") from None
    if isinstance(value, (bool, np.bool_)) or number < least:
        raise AnswerError(f"{name} must be a whole number, at least {least}, not {shortly(value)}")
    return number


def shortly(value: Any) -> str:
    """Return how a value is written, cut where it is long."""
    text = repr(value)
    return text if len(text) <= 80 else f"{text[:77]}..."

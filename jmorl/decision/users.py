"""Decision makers by name, as a config or the command line writes them.

A, B, C                          the paper's artificial users, for two objectives
weights=0.6,0.4                  greatest weighted sum; any number of objectives
weights=0.6,0.4,chebyshev        least weighted distance to the ideal point of the front
weights=0.6,0.4,chebyshev=-60,0  the same, to a utopian point in raw units
target=-80,-42                   nearest to a target in raw units, until one reaches it
target=-80,-42,unscaled          the same, without scaling by the front's range, as in the paper
terminal                         a person at this terminal
script=FILE                      the decisions of an earlier run, from its decision log
"""

import math
from collections.abc import Callable
from contextlib import suppress
from functools import partial

import numpy as np

from envs.core import Objective
from envs.names import did_you_mean, nearest
from jmorl.decision.protocol import DecisionMaker
from jmorl.decision.target import TargetUser
from jmorl.decision.utility import USERS, UtilityUser, chebyshev_utility, linear_utility
from jmorl.display.characters import to_path

KNOWN = (
    f"{', '.join(USERS)}, weights=W1,W2,...[,chebyshev[=Z1,Z2,...]], target=Z1,Z2,...[,unscaled], terminal, script=FILE"
)


def make_user(spec: str, objectives: tuple[Objective, ...]) -> DecisionMaker:
    """Return the decision maker that `spec` names, ready to be asked.

    Raises ValueError if there is none, or if its script is not there or cannot be read.
    """
    return parse_user(spec, len(objectives))()


def parse_user(spec: str, objectives: int | None) -> Callable[[], DecisionMaker]:
    """Check `spec` and return what makes its decision maker.

    `objectives` is their number M; None if it is not known, and then nothing is checked against it. A script is only
    looked for when the decision maker is made. Raises ValueError with a sentence saying what is wrong.
    """
    kind, has_value, value = spec.strip().partition("=")
    if spec.strip() in USERS:
        return _paper_user(spec.strip(), objectives)
    if kind == "weights" and has_value:
        return _weighted_user(value, objectives)
    if kind == "target" and has_value:
        return _target_user(value, objectives)
    if kind == "script" and has_value:
        return _scripted_user(value)
    if spec.strip() == "terminal":
        return _terminal_user
    near = did_you_mean(nearest(kind, (*USERS, "weights", "target", "terminal", "script")))
    raise ValueError(f"unknown user {spec!r}; known: {KNOWN}{near}")


def _paper_user(name: str, objectives: int | None) -> Callable[[], DecisionMaker]:
    if objectives not in (None, 2):
        raise ValueError(
            f"user {name} has weights for two objectives, but there are {objectives}; write weights=W1,W2,... instead"
        )
    return partial(UtilityUser, linear_utility(USERS[name]))


def _weighted_user(value: str, objectives: int | None) -> Callable[[], DecisionMaker]:
    listed, chebyshev, utopian = value.partition(",chebyshev")
    weights = _numbers(listed, "weights", objectives)
    if min(weights) < 0:
        raise ValueError(f"weights must not be negative: {listed}")
    total = sum(weights)
    if not 0 < total < math.inf:
        raise ValueError(f"weights must have a finite sum above zero: {listed}")
    weights = [weight / total for weight in weights]
    if not chebyshev:
        return partial(UtilityUser, linear_utility(weights))
    if not utopian:
        return partial(UtilityUser, chebyshev_utility(weights), comparable=False)
    point = _numbers(utopian.removeprefix("="), "chebyshev", len(weights))
    return partial(UtilityUser, chebyshev_utility(weights, point))


def _target_user(value: str, objectives: int | None) -> Callable[[], DecisionMaker]:
    listed, unscaled, rest = value.partition(",unscaled")
    if rest:
        raise ValueError(f"nothing may follow 'unscaled' in a target, but {rest!r} does")
    return partial(TargetUser, np.array(_numbers(listed, "target", objectives)), scaled=not unscaled)


def _scripted_user(value: str) -> Callable[[], DecisionMaker]:
    def make() -> DecisionMaker:
        from jmorl.decision.scripted import ScriptedUser

        path = to_path(value)
        with suppress(RuntimeError):  # there is no home folder for the `~`
            path = path.expanduser()
        if not path.is_file():
            raise ValueError(f"there is no decision log {value!r}: {path.absolute()} is not a file")
        return ScriptedUser(path)

    return make


def _terminal_user() -> DecisionMaker:
    from jmorl.decision.terminal import TerminalUser  # its libraries are only needed with a person

    return TerminalUser()


def _numbers(listed: str, name: str, count: int | None) -> list[float]:
    """Return the comma-separated finite numbers of a spec, as many as there are objectives."""
    numbers = []
    for word in listed.split(","):
        try:
            number = float(word)
        except ValueError:
            raise ValueError(f"{name} must be numbers separated by commas, but {word.strip()!r} is none") from None
        if not math.isfinite(number):
            raise ValueError(f"{name} must be finite numbers, but {word.strip()!r} is not")
        numbers.append(number)
    if count is not None and len(numbers) != count:
        raise ValueError(f"{name} must have one number for each of {count} objectives, not {len(numbers)}: {listed}")
    return numbers

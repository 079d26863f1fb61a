"""Decision makers by name, as a config or the command line writes them.

A, B, C                          the paper's artificial users, for two objectives
weights=0.6,0.4                  greatest weighted sum; any number of objectives
weights=0.6,0.4,chebyshev        least weighted distance to the ideal point of the front
weights=0.6,0.4,chebyshev=-60,0  the same, to a utopian point in raw units
weights=0.6,0.4,concave=-120,-60,-60,-30  less and less for more of one: first what is worth 0, then what is worth most
target=-80,-42                   nearest to a target in raw units, until one reaches it
target=-80,-42,unscaled          the same, without scaling by the front's range, as in the paper
terminal                         a person at this terminal
script=FILE                      the decisions of an earlier run, from its decision log

A user with weights may have options, behind a comma:

random=0.2                       one answer in five is any of the policies shown
temperature=0.05                 errs between policies whose utilities differ by little, in shares of their range
before=0.2,0.8,until=6           had other weights before round 6
limits=none,-45                  rules out what has less; none: anything will do
"""

import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from typing import TypeVar

import numpy as np

from envs.core import Objective
from envs.names import did_you_mean, nearest
from jmorl.decision.protocol import DecisionMaker
from jmorl.decision.target import TargetUser
from jmorl.decision.utility import (
    USERS,
    Slips,
    Utility,
    UtilityUser,
    chebyshev_utility,
    concave_utility,
    limited_utility,
    linear_utility,
)
from jmorl.display.characters import to_path

T = TypeVar("T")
VALUED = {  # users that are nothing without a value
    "weights": "weights=W1,W2,...",
    "target": "target=Z1,Z2,...",
    "script": "script=FILE",
}
OPTIONS = {  # of users with weights, and how they are written
    "chebyshev": "chebyshev[=Z1,Z2,...]",
    "concave": "concave=WORST1,WORST2,...,BEST1,BEST2,...",
    "random": "random=SHARE",
    "temperature": "temperature=T",
    "before": "before=W1,W2,...",
    "until": "until=GENERATION",
    "limits": "limits=Z1,none,...",
}
KNOWN = (
    f"{', '.join(USERS)} or weights=W1,W2,..., each with options ({', '.join(OPTIONS.values())}); "
    "target=Z1,Z2,...[,unscaled]; terminal; script=FILE"
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
    name, has_options, options = spec.strip().partition(",")
    if name in USERS and (options or not has_options):
        return _paper_user(name, options, objectives)
    if kind == "weights" and value:
        return _weighted_user(value, objectives)
    if kind == "target" and value:
        return _target_user(value, objectives)
    if kind == "script" and value:
        return _scripted_user(value)
    if spec.strip() == "terminal":
        return _terminal_user
    if kind in VALUED:
        raise ValueError(f"user {kind} has no value; write {VALUED[kind]}")
    near = did_you_mean(nearest(kind, (*USERS, *VALUED, "terminal")))
    raise ValueError(f"unknown user {spec!r}; known: {KNOWN}{near}")


def _paper_user(name: str, options: str, objectives: int | None) -> Callable[[], DecisionMaker]:
    if objectives not in (None, 2):
        raise ValueError(
            f"user {name} has weights for two objectives, but there are {objectives}; write weights=W1,W2,... instead"
        )
    weights = ",".join(str(weight) for weight in USERS[name])
    return _weighted_user(f"{weights},{options}" if options else weights, objectives)


def _weighted_user(written: str, objectives: int | None) -> Callable[[], DecisionMaker]:
    """Return a user of weights, and options as in `OPTIONS`, all separated by commas."""
    options = _options(written)
    problems: list[str] = []

    def read(what: Callable[[], T], otherwise: T) -> T:
        """Return what is written, or note why it cannot be."""
        try:
            return what()
        except ValueError as error:
            problems.append(str(error))
            return otherwise

    count = objectives or len(options["weights"].split(","))
    weights = read(lambda: _weights(options["weights"], "weights", objectives), [1.0] * count)
    linear: Callable[[list[float]], Utility] = linear_utility
    shape = read(lambda: _shape(options, count), linear)
    limits = read(lambda: tuple(_limits(options["limits"], count)), None) if "limits" in options else None
    slips = Slips(
        read(lambda: _number(options, "random", most=1.0), 0.0), read(lambda: _number(options, "temperature"), 0.0)
    )
    before = read(lambda: _weights(options["before"], "before", count), weights) if "before" in options else None
    changes_in = read(lambda: _number(options, "until"), 1.0)
    if (before is None) != ("until" not in options) or not changes_in.is_integer() or (before and changes_in < 1):
        problems.append("who changes their mind needs before=W1,W2,... and until=GENERATION, a whole number from 1")
    if problems:
        raise ValueError("; ".join(problems))

    def utility(some: list[float]) -> Utility:
        return limited_utility(shape(some), limits) if limits else shape(some)

    return partial(
        UtilityUser,
        utility(weights),
        comparable=options.get("chebyshev", "given") != "",
        slips=slips,
        before=utility(before) if before else None,
        changes_in=int(changes_in),
        limits=limits,
    )


def _options(written: str) -> dict[str, str]:
    """Return what is written of weights and of each option; a word without an option's name goes on with the last."""
    listed: dict[str, list[str]] = {"weights": []}
    name = "weights"
    for word in written.split(","):
        key, has_value, value = word.strip().partition("=")
        if key in listed and has_value:
            raise ValueError(f"{key} is given twice")
        if key in OPTIONS:
            if not has_value and key != "chebyshev":
                raise ValueError(f"{key} has no value; write {OPTIONS[key]}")
            if has_value and not value.strip():
                raise ValueError(f"{key} must be numbers separated by commas, but {value!r} is none")
            name = key
            listed[name] = [value] if has_value else []
        elif has_value:
            near = did_you_mean(nearest(key, OPTIONS))
            raise ValueError(f"a user has no option {key!r}; known: {', '.join(OPTIONS.values())}{near}")
        else:
            listed[name].append(word)
    return {name: ",".join(words) for name, words in listed.items()}


def _shape(options: Mapping[str, str], count: int) -> Callable[[list[float]], Utility]:
    """Return what makes a utility of weights: linear, Chebyshev or concave."""
    if "chebyshev" in options and "concave" in options:
        raise ValueError("a utility is either chebyshev or concave, not both")
    if "chebyshev" in options:
        utopian = _numbers(options["chebyshev"], "chebyshev", count) if options["chebyshev"] else None
        return partial(chebyshev_utility, utopian=utopian)
    if "concave" not in options:
        return linear_utility
    points = _numbers(options["concave"], "concave", None)
    if len(points) != 2 * count:
        raise ValueError(f"concave needs two numbers for each of {count} objectives, {OPTIONS['concave']}")
    worst, best = points[:count], points[count:]
    if not all(low < high for low, high in zip(worst, best, strict=True)):
        raise ValueError(f"concave has the worst value of each objective first, then better ones: {options['concave']}")
    return partial(concave_utility, worst=worst, best=best)


def _weights(listed: str, name: str, count: int | None) -> list[float]:
    """Return weights that sum to one."""
    weights = _numbers(listed, name, count)
    if min(weights) < 0:
        raise ValueError(f"{name} must not be negative: {listed}")
    total = sum(weights)
    if not 0 < total < math.inf:
        raise ValueError(f"{name} must have a finite sum above zero: {listed}")
    return [weight / total for weight in weights]


def _limits(listed: str, count: int) -> list[float]:
    """Return limits, -inf for each `none`."""
    words = [word.strip().lower() for word in listed.split(",")]
    if len(words) != count:
        raise ValueError(
            f"limits must have a number or none for each of {count} objectives, not {len(words)}: {listed}"
        )
    numbers = iter(_numbers(",".join("0" if word == "none" else word for word in words), "limits", count))
    return [-math.inf if word == "none" else number for word, number in zip(words, numbers, strict=True)]


def _number(options: Mapping[str, str], name: str, most: float = math.inf) -> float:
    """Return the number of an option; 0 without it."""
    if name not in options:
        return 0.0
    try:
        [number] = [float(word) for word in options[name].split(",")]
    except ValueError:
        raise ValueError(f"{name} must be one number, not {options[name]!r}") from None
    if not 0 <= number <= most:
        allowed = "at least 0" if most == math.inf else f"from 0 to {most:g}"
        raise ValueError(f"{name} must be {allowed}, not {number:g}")
    return number


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

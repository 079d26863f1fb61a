"""Whether an environment is what it says it is, found out before anything is computed with it."""

import math
from collections.abc import Iterator
from numbers import Integral
from typing import Any
from weakref import WeakValueDictionary

import jax
import jax.numpy as jnp
import numpy as np

from envs.core import Environment, Objective, Reading, Transition
from envs.failures import failure
from envs.tracing import Traced, kept_tracers, traced

COUNTS = ("observation_size", "action_size", "time_limit")
FEWEST_OBJECTIVES = 2
MOST = np.iinfo(np.int32).max  # what steps are counted with

_checked: WeakValueDictionary[int, Environment[Any]] = WeakValueDictionary()  # by `id`: tracing takes a while


class NotAsDeclared(ValueError):
    """An environment that breaks the contract; the message names everything that is wrong."""


def check_declaration(environment: Environment[Any]) -> None:
    """Raise NotAsDeclared unless an environment says of itself what it has to. Traces nothing."""
    wrong = [*_wrong_counts(environment), *_wrong_objectives(environment)]
    if not any(problem.startswith("action_size") for problem in wrong):
        wrong += _wrong_bounds(environment)
    if wrong:
        raise NotAsDeclared(f"environment {name_of(environment)} declares what cannot be: {'; '.join(wrong)}")


def check_environment(environment: Environment[Any], again: Environment[Any] | None = None) -> None:
    """Raise NotAsDeclared unless an environment's functions are pure and give what it declares.

    They are traced, twice each, and not computed; if the environment is given as it is when it is made `again`, those
    of that one must be the same.
    """
    if _checked.get(id(environment)) is environment:
        return
    if not isinstance(environment, Environment):
        raise NotAsDeclared(f"{environment!r} is no environment: it must be an instance of a subclass of Environment")
    check_declaration(environment)
    start = _result(environment, again, "initial_state", jax.eval_shape(lambda: jax.random.key(0)))
    observation = _result(environment, again, "observe", start)
    action = jax.ShapeDtypeStruct((environment.action_size,), np.float32)
    transition = _result(environment, again, "transition", start, action)
    wrong = list(_wrong_array("observation", observation, int(environment.observation_size), "concatenate its parts"))
    if not isinstance(transition, tuple) or len(transition) != len(Transition._fields):
        wrong.append(f"transition gives {_kind(transition)}, not Transition(state, reward, terminated)")
    else:
        after, reward, terminated = transition
        wrong += _wrong_array("reward", reward, len(environment.objectives), "stack the objectives")
        wrong += _wrong_terminated(terminated)
        wrong += _changes(start, after)
    if wrong:
        raise NotAsDeclared(f"environment {name_of(environment)} is not as it declares: {'; '.join(wrong)}")
    _checked[id(environment)] = environment


def name_of(environment: Environment[Any]) -> str:
    """Its id, or, if it has none, that of its class."""
    return str(getattr(environment, "id", type(environment).__name__))


def _wrong_counts(environment: Environment[Any]) -> Iterator[str]:
    for name in COUNTS:
        count = getattr(environment, name, None)
        if not isinstance(count, Integral) or isinstance(count, bool) or int(count) < 1:
            yield f"{name} is {count!r}, not a whole number above zero"
        elif int(count) > MOST:
            yield f"{name} is {count}, more than {MOST}"


def _wrong_objectives(environment: Environment[Any]) -> Iterator[str]:
    objectives = getattr(environment, "objectives", ())
    if not isinstance(objectives, tuple | list):
        yield f"objectives are {objectives!r}, not a tuple"
        return
    if len(objectives) < FEWEST_OBJECTIVES:
        yield f"there must be {FEWEST_OBJECTIVES} objectives or more, not {len(objectives)}"
    if not all(isinstance(objective, Objective) for objective in objectives):
        yield "objectives are not all of the kind envs.Objective"
        return
    if not all(isinstance(text, str) for each in objectives for text in (each.name, each.label, each.unit)):
        yield "the name, label and unit of an objective are not all texts"
    if not all(isinstance(each.highest, int | float) and each.highest > -math.inf for each in objectives):
        yield "the highest return of an objective is not a number"
    if not all(each.reading is None or isinstance(each.reading, Reading) for each in objectives):
        yield "the reading of an objective is not of the kind envs.Reading"
    elif not all(isinstance(each.read.mean_over, int) and each.read.mean_over >= 1 for each in objectives):
        yield "mean_over, the steps that a reading is the mean of, is not a whole number of at least 1"
    if len({objective.name for objective in objectives}) < len(objectives):
        yield "two objectives have the same name"


def _wrong_bounds(environment: Environment[Any]) -> Iterator[str]:
    try:
        _ = environment.action_box
    except ValueError as error:
        yield str(error)


def _result(environment: Environment[Any], again: Environment[Any] | None, name: str, *arguments: Any) -> Any:
    """Return what a function gives, with a jax.ShapeDtypeStruct for each array. Raises NotAsDeclared."""
    first = _trace(environment, name, *arguments)
    if not first.same_program(_trace(environment, name, *arguments)):
        raise NotAsDeclared(
            f"environment {name_of(environment)} is not pure: {name} computes something else each time it is called; "
            "randomness comes from `key`, and what changes from step to step from `state`"
        )
    if again and not first.same_program(_trace(again, name, *arguments)):
        raise NotAsDeclared(
            f"environment {name_of(environment)} is another one each time it is made: {name} differs; what __init__ "
            "draws comes from a seed that is always the same, or is an option"
        )
    return first.result


def _trace(environment: Environment[Any], name: str, *arguments: Any) -> Traced:
    """Return a function of the environment, traced.

    Raises NotAsDeclared for one that raises, or that remembers a trace.
    """
    try:
        result = traced(getattr(environment, name), *arguments)
    except (Exception, SystemExit) as error:
        raise NotAsDeclared(f"environment {name_of(environment)} breaks down: {failure(error)}") from error
    kept = kept_tracers(environment)
    if kept:
        raise NotAsDeclared(
            f"environment {name_of(environment)} is not pure: {name} keeps a number in self.{kept[0]}; what an episode "
            "remembers belongs in `state`, what never changes is made in __init__, and randomness comes from `key`"
        )
    return result


def _wrong_array(name: str, found: Any, size: int, advice: str) -> Iterator[str]:
    """Yield what keeps a result from being a vector of `size` real numbers of any kind."""
    if not isinstance(found, jax.ShapeDtypeStruct):
        advice = "is a `return` missing?" if found is None else advice
        yield f"{name} is {_kind(found)}, not one array of shape {(size,)}: {advice}"
        return
    if found.shape != (size,):
        yield f"{name} has shape {found.shape}, not {(size,)}"
    if not any(jnp.issubdtype(found.dtype, kind) for kind in (np.floating, np.integer, np.bool_)):
        yield f"{name} is {found.dtype}, not real numbers"


def _wrong_terminated(found: Any) -> Iterator[str]:
    if not isinstance(found, jax.ShapeDtypeStruct):
        yield f"terminated is {_kind(found)}, not True or False"
        return
    if found.shape != ():
        yield f"terminated has shape {found.shape}, not ()"
    if found.dtype != bool:
        yield f"terminated is {found.dtype}, not bool"


def _kind(found: Any) -> str:
    """Name the kind of a result that is not a single array."""
    if isinstance(found, jax.ShapeDtypeStruct):
        return "an array"
    if isinstance(found, tuple | list):
        return f"a {type(found).__name__} of {len(found)}"
    return "None" if found is None else f"a {type(found).__name__}"


def _changes(start: Any, after: Any) -> list[str]:
    """Return the parts of the state whose form changes with a step."""
    if len({jax.tree.structure(start), jax.tree.structure(after)}) > 1:
        return ["the state after a step has other parts than that of a reset"]
    changes = []
    for (path, before), now in zip(jax.tree_util.tree_leaves_with_path(start), jax.tree.leaves(after), strict=True):
        name = f"state{jax.tree_util.keystr(path)}"
        if before.shape != now.shape:
            changes.append(f"{name} has shape {now.shape} after a step, not {before.shape}")
        if before.dtype != now.dtype and not before.weak_type:
            changes.append(f"{name} is {now.dtype} after a step, not {before.dtype}")
    return changes


def check_same(environment: Environment[Any], expected: Environment[Any], name: str) -> None:
    """Raise NotAsDeclared unless an environment is the `expected` one, called `name`, as far as a run can tell.

    It may be of another class if it declares the same, or of the same class with another id.
    """
    names = ["objectives", *COUNTS, "action_low", "action_high"]
    if type(environment) is not type(expected):
        names.append("id")
    pairs = {each: (getattr(environment, each, None), getattr(expected, each, None)) for each in names}
    wrong = [f"{each} is {one!r}, not {other!r}" for each, (one, other) in pairs.items() if not _equal(one, other)]
    if wrong:
        raise NotAsDeclared(
            f"environment {name_of(environment)} is not {name}, which the config names: {'; '.join(wrong)}; name the "
            "one that is to be used in the config, and register it first if it is your own"
        )


def _equal(one: Any, other: Any) -> bool:
    """Return whether two values, or arrays, are the same."""
    return bool(np.array_equal(one, other))

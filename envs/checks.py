"""Whether an environment is what it says it is, found out before anything is computed with it."""

from numbers import Integral
from typing import Any
from weakref import WeakValueDictionary

import jax
import numpy as np

from envs.core import Environment, Objective
from envs.failures import failure

COUNTS = ("observation_size", "action_size", "time_limit")
FEWEST_OBJECTIVES = 2

_checked: WeakValueDictionary[int, Environment[Any]] = WeakValueDictionary()  # by `id`: tracing takes a while


class NotAsDeclared(ValueError):
    """An environment that breaks the contract; the message names everything that is wrong."""


def check_declaration(environment: Environment[Any]) -> None:
    """Raise NotAsDeclared unless an environment says of itself what it has to. Traces nothing."""
    counts = {name: getattr(environment, name, None) for name in COUNTS}
    wrong = [
        f"{name} is {count!r}, not a whole number above zero"
        for name, count in counts.items()
        if not isinstance(count, Integral) or count < 1
    ]
    objectives = tuple(getattr(environment, "objectives", ()))
    if len(objectives) < FEWEST_OBJECTIVES:
        wrong.append(f"there must be {FEWEST_OBJECTIVES} objectives or more, not {len(objectives)}")
    if not all(isinstance(objective, Objective) for objective in objectives):
        wrong.append("objectives are not all of the kind envs.Objective")
    elif len({objective.name for objective in objectives}) < len(objectives):
        wrong.append("two objectives have the same name")
    if wrong:
        raise NotAsDeclared(f"environment {_name(environment)} declares what cannot be: {'; '.join(wrong)}")


def check_environment(environment: Environment[Any]) -> None:
    """Raise NotAsDeclared unless a reset and a step, traced and not computed, give what an environment declares."""
    if _checked.get(id(environment)) is environment:
        return
    check_declaration(environment)
    try:
        start, observation = jax.eval_shape(environment.reset, jax.eval_shape(lambda: jax.random.key(0)))
        action = jax.ShapeDtypeStruct((environment.action_size,), np.float32)
        after, reward, terminated = jax.eval_shape(environment.transition, start.physics, action)
        shapes = {
            "observation": (observation.shape, (environment.observation_size,)),
            "reward": (reward.shape, (len(environment.objectives),)),
            "terminated": (terminated.shape, ()),
        }
    except Exception as error:
        raise NotAsDeclared(f"environment {_name(environment)} breaks down: {failure(error)}") from error
    wrong = [f"{name} has shape {real}, not {said}" for name, (real, said) in shapes.items() if real != said]
    if terminated.dtype != bool:
        wrong.append(f"terminated is {terminated.dtype}, not bool")
    wrong += _changes(start.physics, after)
    if wrong:
        raise NotAsDeclared(f"environment {_name(environment)} is not as it declares: {'; '.join(wrong)}")
    _checked[id(environment)] = environment


def _changes(start: Any, after: Any) -> list[str]:
    """What has another form after a step than after a reset."""
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


def _name(environment: Environment[Any]) -> str:
    return getattr(environment, "id", type(environment).__name__)


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
            f"environment {_name(environment)} is not {name}, which the config names: {'; '.join(wrong)}; name the one "
            "that is to be used in the config, and register it first if it is your own"
        )


def _equal(one: Any, other: Any) -> bool:
    """Return whether two values, or arrays, are the same."""
    return bool(np.array_equal(one, other))

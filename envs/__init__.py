"""Multi-objective environments in pure JAX, by their MO-Gymnasium ids.

`envs.make(id)` gives one, `envs.ids()` lists them, `envs.register` adds yours; `envs.make("module:id")` imports the
module that does so. An id may carry options of its environment: `envs.make("mo-halfcheetah-v5,physics=mjx")`.
"""

import importlib
import inspect
from collections.abc import Callable
from typing import Any

from envs.checks import NotAsDeclared, check_declaration, check_environment
from envs.core import Environment, EpisodeState, Objective, Step, Transition
from envs.failures import failure
from envs.half_cheetah import HalfCheetah
from envs.mountain_car import MountainCar

__all__ = [
    "Environment",
    "EpisodeState",
    "NotAsDeclared",
    "Objective",
    "Step",
    "Transition",
    "check_environment",
    "ids",
    "make",
    "plain_id",
    "register",
]

_registry: dict[str, Callable[..., Environment[Any]]] = {}


def register(id: str, factory: Callable[..., Environment[Any]]) -> None:
    """Make `factory` available as `make(id)`; its parameters are the environment's options.

    Raises ValueError if the id is taken by another factory.
    """
    if _registry.setdefault(id, factory) is not factory:
        raise ValueError(f"environment id {id!r} is already registered")


def make(id: str, **options: Any) -> Environment[Any]:
    """The environment called `id`; `module:id` imports `module`, which registers it, first.

    `id,option=value` is another way to give options, as texts. Raises ValueError, naming what is known, for a module,
    an id or an option that there is none of, for a value that the environment refuses, for a module or an environment
    that breaks down, and NotAsDeclared for one that declares what cannot be.
    """
    module, name, written = _parts(id)
    if module:
        _import(id, module)
    if name not in _registry:
        raise ValueError(f"unknown environment {name!r}; known: {', '.join(ids())}")
    factory, options = _registry[name], written | options
    _check_options(name, factory, options)
    try:
        environment = factory(**options)
    except ValueError:
        raise
    except (Exception, SystemExit) as error:
        raise ValueError(f"environment {name!r} cannot be made: {failure(error)}") from error
    check_declaration(environment)
    return environment


def ids() -> list[str]:
    """All registered environment ids, sorted."""
    return sorted(_registry)


def plain_id(id: str) -> str:
    """The id without module and options: what MO-Gymnasium calls the environment."""
    return id.partition(",")[0].rpartition(":")[2]


def _import(id: str, module: str) -> None:
    try:
        importlib.import_module(module)
    except (Exception, SystemExit) as error:
        said = str(error) if isinstance(error, ImportError) else failure(error)
        raise ValueError(f"environment {id!r}: cannot import {module!r}: {said}") from error


def _check_options(name: str, factory: Callable[..., Environment[Any]], options: dict[str, Any]) -> None:
    """Raise ValueError for an option that there is none of, and for those that are missing."""
    parameters = inspect.signature(factory).parameters
    for option in options:
        if option not in parameters:
            known = ", ".join(parameters) or "none"
            raise ValueError(f"environment {name!r} has no option {option!r}; known: {known}")
    variadic = inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD
    needed = [each.name for each in parameters.values() if each.default is each.empty and each.kind not in variadic]
    missing = [option for option in needed if option not in options]
    if missing:
        written = ",".join([name, *(f"{option}=VALUE" for option in missing)])
        raise ValueError(f"environment {name!r} needs {', '.join(missing)}: write {written}")


def _parts(id: str) -> tuple[str, str, dict[str, str]]:
    """Module, plain id and options of an id as written."""
    place, *options = id.split(",")
    module = place.rpartition(":")[0]
    pairs = [option.partition("=") for option in options]
    if not all(option and equals for option, equals, _ in pairs):
        raise ValueError(f"environment {id!r}: an option is written name=value, after a comma")
    names = [option for option, _, _ in pairs]
    twice = [option for option in dict.fromkeys(names) if names.count(option) > 1]
    if twice:
        raise ValueError(f"environment {id!r}: option {', '.join(twice)} is given more than once")
    return module, plain_id(id), {option: value for option, _, value in pairs}


register(MountainCar.id, MountainCar)
register(HalfCheetah.id, HalfCheetah)

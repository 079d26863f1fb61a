"""Multi-objective environments in pure JAX, by their MO-Gymnasium ids.

`envs.make(id)` gives one, `envs.ids()` lists them, `envs.register` adds yours; `envs.make("module:id")` imports the
module that does so. An id may carry options of its environment: `envs.make("mo-halfcheetah-v5,physics=mjx")`.
`brax:NAME` and `playground:NAME` are environments of those libraries (`envs.brax`, `envs.playground`).
"""

import importlib
import importlib.util
import inspect
import re
import sys
from collections.abc import Callable, Hashable
from functools import cache, partial
from pathlib import Path
from typing import Any

from envs.checks import NotAsDeclared, check_declaration, check_environment
from envs.core import Environment, EpisodeState, Objective, Reading, Step, Transition
from envs.failures import failure
from envs.half_cheetah import HalfCheetah
from envs.hopper import Hopper, Hopper2
from envs.mountain_car import MountainCar
from envs.names import did_you_mean, nearest
from envs.pgmorl import PgmorlHalfCheetah, PgmorlHopper, PgmorlHopper3, PgmorlWalker2d
from envs.walker2d import Walker2d

__all__ = [
    "Environment",
    "EpisodeState",
    "NotAsDeclared",
    "Objective",
    "Reading",
    "Step",
    "Transition",
    "check_environment",
    "ids",
    "make",
    "module_of",
    "plain_id",
    "register",
    "registry",
]

ID = re.compile(r"[^\s,:]+")
OUTSIDE_BRACKETS = re.compile(r",(?![^(\[]*[)\]])")  # commas between options, and not within a value
LIBRARIES = {"brax": "brax", "playground": "mujoco_playground"}  # whose environments can be made, and their packages
registry: dict[str, Callable[..., Environment[Any]]] = {}  # what `register` fills: factories by id
_made: dict[
    Hashable, Environment[Any]
] = {}  # by factory and options: they hold no state, and programs are kept for each


def register(id: str, factory: Callable[..., Environment[Any]]) -> None:
    """Make `factory` available as `make(id)`; its parameters are the environment's options.

    Raises ValueError if the id is taken by another factory, or cannot be one, and for a factory that cannot be called.
    """
    if not isinstance(id, str) or not ID.fullmatch(id):
        raise ValueError(f"an environment id is a text without spaces, commas and colons, not {id!r}")
    if not callable(factory):
        raise ValueError(
            f"environment {id!r} cannot be made by {type(factory).__name__}: register the class itself, without (), or "
            "a function that returns an environment"
        )
    if registry.setdefault(id, factory) is not factory:
        raise ValueError(f"environment id {id!r} is already registered")


def make(id: str, **options: Any) -> Environment[Any]:
    """Return the environment called `id`, always the same; `module:id` imports `module`, which registers it, first.

    `id,option=value` is another way to give options, as texts; options must be hashable. Raises ValueError, naming
    what is known, for a module, an id or an option that there is none of, for a value that the environment refuses,
    for a module or an environment that breaks down, and NotAsDeclared for one that declares what cannot be.
    """
    name, factory, written = _found(id)
    options = written | options
    _check_options(name, factory, options)
    key = (name, factory, *sorted(options.items()))
    if key not in _made:
        _made[key] = _new(name, factory, options)
    return _made[key]


def _found(id: str) -> tuple[str, Callable[..., Environment[Any]], dict[str, str]]:
    """Return name, factory and options of what an id stands for. Raises ValueError."""
    module, name, written = _parts(id)
    if module in LIBRARIES:
        return f"{module}:{name}", _of_library(module, name), written
    if module:
        _import(id, module)
    if name not in registry:
        families = ", ".join(f"{library}:NAME" for library in LIBRARIES)
        known = f"known: {', '.join(ids())}, {families}{did_you_mean(nearest(name, ids()))}"
        raise ValueError(f"unknown environment {name!r}; {known}{_hidden(module)}")
    return name, registry[name], written


@cache
def _of_library(library: str, name: str) -> Callable[..., Environment[Any]]:
    """Return what makes a library's environment. Raises ValueError if the library is not installed."""
    package = LIBRARIES[library]
    if importlib.util.find_spec(package) is None:
        raise ValueError(f"environment '{library}:{name}' needs {package}: pip install 'jmorl[{library}]'")
    return partial(importlib.import_module(f"envs.{library}").make, name)


def _new(name: str, factory: Callable[..., Environment[Any]], options: dict[str, Any]) -> Environment[Any]:
    try:
        environment = factory(**options)
    except ValueError as error:
        raise ValueError(f"environment {name!r} cannot be made{_with_options(options)}: {error}") from error
    except (Exception, SystemExit) as error:
        raise ValueError(f"environment {name!r} cannot be made{_with_options(options)}: {failure(error)}") from error
    if not isinstance(environment, Environment):
        raise ValueError(
            f"environment {name!r} cannot be made: what is registered returns {environment!r}, not an envs.Environment"
        )
    check_declaration(environment)
    return environment


def _with_options(options: dict[str, Any]) -> str:
    return f" with {','.join(f'{name}={value}' for name, value in options.items())}" if options else ""


def make_anew(id: str) -> Environment[Any]:
    """Return another instance of what `make(id)` returns, to compare with. Raises ValueError as `make` does."""
    make(id)  # which checks
    return _new(*_found(id))


def ids() -> list[str]:
    """All registered environment ids, sorted."""
    return sorted(registry)


def plain_id(id: str) -> str:
    """Return the id without module and options: what MO-Gymnasium calls the environment."""
    return id.partition(",")[0].rpartition(":")[2]


def module_of(id: str) -> str:
    """Return the module that `make(id)` imports first; nothing if the id names none, or one of the known libraries."""
    module = OUTSIDE_BRACKETS.split(id)[0].rpartition(":")[0]
    return "" if module in LIBRARIES else module


def _import(id: str, module: str) -> None:
    try:
        importlib.import_module(module)
    except (Exception, SystemExit) as error:
        said = str(error) if isinstance(error, ImportError) else failure(error)
        raise ValueError(f"environment {id!r}: cannot import {module!r}: {said}{_hidden(module)}") from error


def _hidden(module: str) -> str:
    """Name the module of the working directory that was meant, if another one of the same name hides it."""
    name = module.partition(".")[0]
    meant = [path for path in (Path(name).absolute(), Path(f"{name}.py").absolute()) if name and path.exists()]
    found = sys.modules.get(name)
    if not meant or found is None:
        return ""
    place = getattr(found, "__file__", None) or next(iter(getattr(found, "__path__", ())), "Python")
    if any(Path(place).resolve().is_relative_to(path.resolve()) for path in meant):
        return ""
    return f"; {meant[0]} is hidden by {place}, which has the same name: rename yours"


def _check_options(name: str, factory: Callable[..., Environment[Any]], options: dict[str, Any]) -> None:
    """Raise ValueError for an option that there is none of, and for those that are missing."""
    parameters = inspect.signature(factory).parameters
    any_other = any(each.kind is each.VAR_KEYWORD for each in parameters.values())
    for option in options:
        if option not in parameters and not any_other:
            known = ", ".join(parameters) or "none"
            near = did_you_mean(nearest(option, parameters))
            raise ValueError(f"environment {name!r} has no option {option!r}; known: {known}{near}")
    variadic = inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD
    needed = [each.name for each in parameters.values() if each.default is each.empty and each.kind not in variadic]
    missing = [option for option in needed if option not in options]
    if missing:
        written = ",".join([name, *(f"{option}=VALUE" for option in missing)])
        raise ValueError(f"environment {name!r} needs {', '.join(missing)}: write {written}")


def _parts(id: str) -> tuple[str, str, dict[str, str]]:
    """Return module, plain id and options of an id as written."""
    place, *options = OUTSIDE_BRACKETS.split(id)
    module = place.rpartition(":")[0]
    pairs = [option.partition("=") for option in options]
    if not all(option and equals for option, equals, _ in pairs):
        raise ValueError(f"environment {id!r}: an option is written name=value, after a comma")
    names = [option for option, _, _ in pairs]
    twice = [option for option in dict.fromkeys(names) if names.count(option) > 1]
    if twice:
        raise ValueError(f"environment {id!r}: option {', '.join(twice)} is given more than once")
    return module, plain_id(id), {option: value for option, _, value in pairs}


for _environment in (
    *(MountainCar, HalfCheetah, Walker2d, Hopper, Hopper2),
    *(PgmorlHalfCheetah, PgmorlWalker2d, PgmorlHopper, PgmorlHopper3),
):
    register(_environment.id, _environment)

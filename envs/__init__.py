"""Multi-objective environments in pure JAX, by their MO-Gymnasium ids.

`envs.make(id)` gives one, `envs.ids()` lists them, `envs.register` adds yours; `envs.make("module:id")` imports the
module that does so.
"""

import importlib
from collections.abc import Callable
from typing import Any

from envs.core import Environment, EpisodeState, Objective, Step, Transition
from envs.mountain_car import MountainCar

__all__ = ["Environment", "EpisodeState", "Objective", "Step", "Transition", "ids", "make", "register"]

_registry: dict[str, Callable[[], Environment[Any]]] = {}


def register(id: str, factory: Callable[[], Environment[Any]]) -> None:
    """Make `factory` available as `make(id)`. Raises ValueError if the id is taken by another factory."""
    if _registry.setdefault(id, factory) is not factory:
        raise ValueError(f"environment id {id!r} is already registered")


def make(id: str) -> Environment[Any]:
    """The environment called `id`; `module:id` imports `module`, which registers it, first.

    Raises ValueError, naming the module or the known ids, if there is none.
    """
    module, _, name = id.rpartition(":")
    if module:
        try:
            importlib.import_module(module)
        except ImportError as error:
            raise ValueError(f"environment {id!r}: cannot import {module!r}: {error}") from error
    if name not in _registry:
        raise ValueError(f"unknown environment {name!r}; known: {', '.join(ids())}")
    return _registry[name]()


def ids() -> list[str]:
    """All registered environment ids, sorted."""
    return sorted(_registry)


register(MountainCar.id, MountainCar)

"""Methods by name. `MODULE:NAME` imports a module of your own, which registers its method, first."""

import importlib
from typing import TYPE_CHECKING

from envs.failures import failure
from envs.names import did_you_mean, nearest

if TYPE_CHECKING:
    from jmorl.methods.base import Method, Problem

# Imported when first needed: `jmorl --help` needs the names alone.
_registry: dict[str, "type[Method] | str"] = {
    "interactive": "jmorl.methods.interactive:Interactive",
    "pgmorl": "jmorl.methods.pgmorl:PGMORL",
    "fixed": "jmorl.methods.fixed:FixedWeights",
}


def register_method(name: str, method: "type[Method]") -> None:
    """Make a method available by a name. Raise ValueError if another method has it, or if it is no whole method."""
    from jmorl.methods.base import Method

    if not (isinstance(method, type) and issubclass(method, Method)):
        raise ValueError(f"method {name!r} must be a subclass of jmorl.Method, not {method!r}")
    if method.__abstractmethods__:
        raise ValueError(f"method {name!r} lacks {', '.join(sorted(method.__abstractmethods__))}")
    if _registry.setdefault(name, method) is not method:
        raise ValueError(f"method {name!r} is already registered")


def names() -> list[str]:
    """Return the names of all methods, sorted."""
    return sorted(_registry)


def check(name: str) -> None:
    """Raise ValueError, naming what is known, if there is no method of this name."""
    module, _, plain = name.rpartition(":")
    if module:
        try:
            importlib.import_module(module)
        except Exception as error:
            said = str(error) if isinstance(error, ImportError) else failure(error)
            raise ValueError(f"method {name!r}: cannot import {module!r}: {said}") from error
    if plain not in _registry:
        meant = did_you_mean(nearest(plain, names()))
        raise ValueError(f"unknown method {plain!r}; known: {', '.join(names())}{meant}")


def make(name: str, problem: "Problem") -> "Method":
    """Return the method of a name, for a problem. Raise ValueError as `check` does."""
    check(name)
    plain = name.rpartition(":")[2]
    found = _registry[plain]
    if isinstance(found, str):
        module, _, kind = found.partition(":")
        found = getattr(importlib.import_module(module), kind)
    return found(problem)

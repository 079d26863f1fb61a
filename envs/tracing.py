"""A function as JAX sees it: traced, and not computed."""

import re
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.extend.core import ClosedJaxpr, Jaxpr, Literal

ADDRESS = re.compile(r"0x[0-9a-f]+")  # of an object that a program is printed with; another one each time


class Traced(NamedTuple):
    """What a function gives, and the program that computes it. Programs are compared by the last two."""

    result: Any  # as the function gives it, with a jax.ShapeDtypeStruct for each array
    text: str
    constants: tuple[bytes, ...]  # numbers that the program has and its text may not

    def same_program(self, other: "Traced") -> bool:
        """Whether equal arguments give equal results."""
        return self[1:] == other[1:]


def traced(function: Callable[..., Any], *arguments: Any) -> Traced:
    """Trace a function anew, whatever JAX remembers of it. Raises what the function raises."""
    program, result = jax.make_jaxpr(lambda *arguments: function(*arguments), return_shape=True)(*arguments)
    return Traced(result, ADDRESS.sub("", str(program)), tuple(map(_bytes, _constants(program))))


def kept_tracers(instance: object) -> list[str]:
    """Return the attributes in which an instance keeps what was traced and is gone."""
    attributes = getattr(instance, "__dict__", {})
    return [
        name
        for name, value in attributes.items()
        if any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves(value))
    ]


def _constants(program: Any) -> Iterator[Any]:
    """Yield the constants of a program and of the programs within it."""
    if isinstance(program, ClosedJaxpr):
        yield from program.consts
        yield from _constants(program.jaxpr)
    elif isinstance(program, Jaxpr):
        for equation in program.eqns:
            yield from (each.val for each in equation.invars if isinstance(each, Literal))
            for within in jax.tree.leaves(equation.params):
                yield from _constants(within)


def _bytes(constant: Any) -> bytes:
    if jnp.issubdtype(jnp.result_type(constant), jax.dtypes.prng_key):
        constant = jax.random.key_data(constant)
    return np.asarray(constant).tobytes()

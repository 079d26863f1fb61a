"""How compiled programs are made and called: under settings of their own, awaited, and their failures in a sentence."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

import jax


class ComputationFailed(RuntimeError):
    """JAX could not compile or run a program, most often for want of memory."""


@contextmanager
def own_settings() -> Iterator[None]:
    """Within the block JAX is set as the programs need it, whatever its variables or somebody's module say.

    In 64 bits or with another promotion of types they would be other programs, without compilation they would take
    days, and numbers that are not finite are found and named by the programs themselves.
    """
    with ExitStack() as stack:
        for setting in (
            jax.enable_x64(False),
            jax.disable_jit(False),
            jax.numpy_dtype_promotion("standard"),
            jax.numpy_rank_promotion("allow"),
            jax.debug_nans(False),
            jax.debug_infs(False),
            jax.transfer_guard("allow"),
        ):
            stack.enter_context(setting)
        yield


def compile_for(function: Any, *arguments: Any) -> Any:
    """Return a jitted function, compiled for arguments of such shapes. Raises ComputationFailed."""
    with _failures_in_a_sentence(), own_settings():
        return function.lower(*arguments).compile()


def result_of(program: Callable[..., Any], *arguments: Any) -> Any:
    """Return what a jitted or compiled function gives for the arguments, as host arrays. Raises ComputationFailed.

    The result is waited for before it is fetched: where an allocation fails in the background, fetching would wait
    for ever.
    """
    with _failures_in_a_sentence(), own_settings():
        return jax.device_get(jax.block_until_ready(program(*arguments)))


@contextmanager
def _failures_in_a_sentence() -> Iterator[None]:
    try:
        yield
    except jax.errors.JaxRuntimeError as error:
        said = str(error).strip().partition("\n")[0]
        advice = "; smaller settings or fewer episodes need less memory" if "RESOURCE_EXHAUSTED" in said else ""
        raise ComputationFailed(f"JAX cannot compute this: {said}{advice}") from error

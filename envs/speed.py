"""What a step of an environment costs on this machine."""

import time
from typing import Any, NamedTuple

import jax

from envs.core import Environment

SECONDS = 0.5  # to measure for, at least
ROLLOUT = 20  # steps in one call of the program


class Speed(NamedTuple):
    """Measured with random actions, resets included, on one device."""

    steps_per_second: float  # of all environments together
    compile_seconds: float


def measure_speed(environment: Environment[Any], count: int) -> Speed:
    """Step `count` environments at once, and measure how long that takes."""
    box = environment.action_box

    def act(state: Any, key: jax.Array) -> tuple[Any, None]:
        action_key, step_key = jax.random.split(key)
        action = jax.random.uniform(action_key, (count, environment.action_size), minval=-1.0)
        state, _ = jax.vmap(environment.step)(jax.random.split(step_key, count), state, box.action(action))
        return state, None

    @jax.jit
    def rollout(state: Any, key: jax.Array) -> Any:
        return jax.lax.scan(act, state, jax.random.split(key, ROLLOUT))[0]

    key = jax.random.key(0)
    state, _ = jax.jit(jax.vmap(environment.reset))(jax.random.split(key, count))
    begin = time.perf_counter()
    state = jax.block_until_ready(rollout(state, key))
    compile_seconds = time.perf_counter() - begin
    begin, calls = time.perf_counter(), 0
    while time.perf_counter() - begin < SECONDS:
        state = jax.block_until_ready(rollout(state, jax.random.key(calls)))
        calls += 1
    return Speed(calls * ROLLOUT * count / (time.perf_counter() - begin), compile_seconds)

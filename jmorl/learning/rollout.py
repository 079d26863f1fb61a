"""Acting in the environment: trajectories to learn from, and episodes to be scored by."""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from envs.core import Environment, EpisodeState

PolicyFunction = Callable[[jax.Array], tuple[jax.Array, jax.Array]]  # observation [O] -> mean [A], log_std [A]


class Trajectory(NamedTuple):
    """Steps of one environment. After `lax.scan` every field has a leading T axis."""

    observation: jax.Array  # [O] acted on
    action: jax.Array  # [A] as sampled; the environment clips
    reward: jax.Array  # [M] raw
    terminated: jax.Array  # [] bool
    truncated: jax.Array  # [] bool
    final_observation: jax.Array  # [O] the true successor


def rollout(
    environment: Environment[Any],
    policy: PolicyFunction,
    key: jax.Array,
    start: tuple[EpisodeState[Any], jax.Array],  # state and observation [O]
    steps: int,
    noise_correlation: float,
) -> tuple[tuple[EpisodeState[Any], jax.Array], Trajectory]:
    """Act for `steps` steps with sampled actions, across episode ends.

    The noise of successive actions has this correlation; that of each action stays standard normal.
    Returns where to continue, and the trajectory [T, ...].
    """
    noise_key, reset_key = jax.random.split(key)
    # Drawn outside the scan: one large draw is much cheaper than T small ones.
    noise = correlated_noise(noise_key, (steps, environment.action_size), noise_correlation)
    reset_keys = jax.random.split(reset_key, steps)

    def act(
        carry: tuple[EpisodeState[Any], jax.Array], randomness: tuple[jax.Array, jax.Array]
    ) -> tuple[tuple[EpisodeState[Any], jax.Array], Trajectory]:
        state, observation = carry
        noise_t, key_t = randomness
        mean, log_std = policy(observation)
        action = mean + jnp.exp(log_std) * noise_t
        state, step = environment.step(key_t, state, action)
        transition = Trajectory(
            observation, action, step.reward, step.terminated, step.truncated, step.final_observation
        )
        return (state, step.observation), transition

    return jax.lax.scan(act, start, (noise, reset_keys))


def correlated_noise(key: jax.Array, shape: tuple[int, int], correlation: float) -> jax.Array:
    """Standard normal noise [T, A], correlated from one step to the next as a first-order autoregression.

    Correlated noise explores further than independent noise of the same size (Hollenstein et al. 2024).
    """
    white = jax.random.normal(key, shape)
    if not correlation:
        return white
    innovation = jnp.sqrt(1 - correlation**2)

    def step(previous: jax.Array, fresh: jax.Array) -> tuple[jax.Array, jax.Array]:
        noise = correlation * previous + innovation * fresh
        return noise, noise

    return jnp.concatenate([white[:1], jax.lax.scan(step, white[0], white[1:])[1]])


class Trace(NamedTuple):
    """The rewards of one episode, for scores that are no plain sum of them."""

    rewards: jax.Array  # [T, M] raw; zero from the episode's length on
    terminated: jax.Array  # [] bool: ended by itself, not by the time limit


class EpisodeReturns(NamedTuple):
    """The vector returns of one episode."""

    undiscounted: jax.Array  # [M]
    discounted: jax.Array  # [M]
    length: jax.Array  # [] int32 steps
    trace: Trace | None = None  # only if it was asked for


def episode_returns(
    environment: Environment[Any],
    policy: PolicyFunction,
    key: jax.Array,
    discount: float,
    sampled: bool = False,
    traced: bool = False,
) -> EpisodeReturns:
    """One episode, its start drawn from `key`, to its end or the time limit.

    Actions are the mean, or, if `sampled`, drawn from the policy. `traced`: every reward is kept. The scan always
    runs to the time limit; what comes after the end is masked.
    """
    start_key, noise = key, None
    if sampled:
        start_key, noise_key = jax.random.split(key)
        noise = jax.random.normal(noise_key, (environment.time_limit, environment.action_size))

    def act(
        carry: tuple[EpisodeState[Any], jax.Array, jax.Array, EpisodeReturns], noise_t: jax.Array | None
    ) -> tuple[tuple[EpisodeState[Any], jax.Array, jax.Array, EpisodeReturns], tuple[jax.Array, jax.Array] | None]:
        state, observation, running, returns = carry
        mean, log_std = policy(observation)
        state, step = environment.advance(state, mean if noise_t is None else mean + jnp.exp(log_std) * noise_t)
        # A weight of zero would let a NaN from beyond the end through; a where does not.
        reward = jnp.where(running, step.reward, 0.0)
        kept = (reward, running & step.terminated) if traced else None
        returns = EpisodeReturns(
            returns.undiscounted + reward,
            returns.discounted + discount**returns.length * reward,
            returns.length + running,
        )
        running = running & ~(step.terminated | step.truncated)
        return (state, step.observation, running, returns), kept

    state, observation = environment.reset(start_key)
    zeros = jnp.zeros(len(environment.objectives))
    start = (state, observation, jnp.array(True), EpisodeReturns(zeros, zeros, jnp.array(0)))
    (_, _, _, returns), kept = jax.lax.scan(act, start, noise, length=environment.time_limit)
    if kept is None:
        return returns
    rewards, terminated = kept
    return returns._replace(trace=Trace(rewards, terminated.any()))

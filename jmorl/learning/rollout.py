"""Acting in the environment: trajectories to learn from, and episodes to be scored by."""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from envs.core import Environment, EpisodeState

# Observation [O] -> mean [A] and log_std [A] of the normalised action (`envs.actions`).
PolicyFunction = Callable[[jax.Array], tuple[jax.Array, jax.Array]]
# Observation [O] and standard normal noise [A], or None for the mean -> action [A] in the environment's own units.
ActFunction = Callable[[jax.Array, jax.Array | None], jax.Array]

CHUNK = 64  # steps at most, between two looks at whether every episode has ended


class Trajectory(NamedTuple):
    """Steps of one environment. After `lax.scan` every field has a leading T axis."""

    observation: jax.Array  # [O] acted on
    action: jax.Array  # [A] normalised, as sampled
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
    box = environment.action_box
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
        state, step = environment.step(key_t, state, box.action(action))
        transition = Trajectory(
            observation, action, step.reward, step.terminated, step.truncated, step.final_observation
        )
        return (state, step.observation), transition

    return jax.lax.scan(act, start, (noise, reset_keys))


def correlated_noise(key: jax.Array, shape: tuple[int, int], correlation: float) -> jax.Array:
    """Return standard normal noise [T, A], correlated from one step to the next as a first-order autoregression.

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


class _Episode(NamedTuple):
    """An episode under way, or at its end."""

    state: EpisodeState[Any]
    observation: jax.Array  # [O]
    running: jax.Array  # [] bool
    returns: EpisodeReturns  # so far


def episode_returns(
    environment: Environment[Any],
    act: ActFunction,
    key: jax.Array,
    discount: float,
    sampled: bool = False,
    traced: bool = False,
) -> EpisodeReturns:
    """One episode, its start drawn from `key`, to its end or the time limit.

    Actions are without noise unless `sampled`. `traced`: every reward is kept, which takes room for all steps up to
    the time limit. What comes after the end is masked.
    """
    start_key, noise = key, None
    if sampled:
        start_key, noise_key = jax.random.split(key)
        noise = jax.random.normal(noise_key, (environment.time_limit, environment.action_size))

    def advance(episode: _Episode, noise_t: jax.Array | None) -> tuple[_Episode, Any]:
        state, observation, running, returns = episode
        state, step = environment.advance(state, act(observation, noise_t))
        # A weight of zero would let a NaN from beyond the end through; a where does not.
        reward = jnp.where(running, step.reward, 0.0)
        kept = (reward, running & step.terminated) if traced else None
        returns = EpisodeReturns(
            returns.undiscounted + reward,
            returns.discounted + discount ** returns.length.astype(reward.dtype) * reward,
            returns.length + running.astype(returns.length.dtype),
        )
        return _Episode(state, step.observation, running & ~(step.terminated | step.truncated), returns), kept

    state, observation = environment.reset(start_key)
    zeros = jnp.zeros(len(environment.objectives))
    start = _Episode(state, observation, jnp.array(True), EpisodeReturns(zeros, zeros, jnp.array(0)))
    if not traced:
        return _at_its_end(advance, start, noise, environment.time_limit).returns
    episode, (rewards, terminated) = jax.lax.scan(advance, start, noise, length=environment.time_limit)
    return episode.returns._replace(trace=Trace(rewards, terminated.any()))


def _at_its_end(
    advance: Callable[[_Episode, jax.Array | None], tuple[_Episode, Any]],
    start: _Episode,
    noise: jax.Array | None,  # [T, A]
    time_limit: int,  # T
) -> _Episode:
    """Advance until the episode has ended, or, under `vmap`, until all have, whatever the time limit is.

    Equal chunks of steps, or the question whether to go on would cost as much as a cheap step.
    """
    chunks = -(-time_limit // CHUNK)
    steps = -(-time_limit // chunks)
    if noise is not None:
        padded = jnp.pad(noise, ((0, chunks * steps - time_limit), (0, 0)))
        noise = padded.reshape(chunks, steps, -1)

    def chunk(carry: tuple[jax.Array, _Episode]) -> tuple[jax.Array, _Episode]:
        index, episode = carry
        noise_of_chunk = None if noise is None else noise[index]
        return index + 1, jax.lax.scan(advance, episode, noise_of_chunk, length=steps)[0]

    return jax.lax.while_loop(lambda carry: carry[1].running, chunk, (jnp.array(0), start))[1]

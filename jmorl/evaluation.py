"""Stored policies, and blends of them, on fresh episodes: in their own environment, and in MO-Gymnasium's."""

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

import envs
from envs.mujoco_model import quiet_mujoco
from jmorl.learning.execution import result_of
from jmorl.learning.rollout import EpisodeReturns, episode_returns
from jmorl.search.policy import Blend
from jmorl.storage.blend_file import mix
from jmorl.storage.policy_file import (
    PolicyFileError,
    StoredPolicy,
    check_target,
    load_policy,
    policy_environment,
    policy_path,
    write_stored_policy,
)

BLEND_EPISODES = 100  # that score a blend
BLEND_SEED = 2**32 - 1  # of their starts: not the one that `jmorl evaluate` has by default


class NotInGymnasium(ValueError):
    """A policy that cannot be scored in MO-Gymnasium."""


def evaluate_stored(policy: StoredPolicy, keys: jax.Array) -> EpisodeReturns:
    """Deterministic episodes of a stored policy in its environment, one for each start key [episodes].

    Another number of episodes is another compiled program: the last bits of a return may differ. Raises
    PolicyFileError if the environment cannot be made here, and ComputationFailed.
    """
    program = _program(policy.header["environment"], policy.header["discount"])
    returns: EpisodeReturns = result_of(program, policy.arrays(), keys)
    return returns


@lru_cache(maxsize=4)
def _program(environment_id: str, discount: float) -> Callable[..., EpisodeReturns]:
    """Return what scores any policy of an environment, given by its arrays, from start keys [episodes]."""
    environment = policy_environment(environment_id)

    def episode(arrays: dict[str, Any], key: jax.Array) -> EpisodeReturns:
        policy = StoredPolicy.of_arrays(arrays)
        return episode_returns(environment, lambda observation, _: policy.action(observation, jnp), key, discount)

    return jax.jit(jax.vmap(episode, in_axes=(None, 0)))


def export_blend(place: Path | str, blend: Blend, target: Path | str, force: bool = False) -> StoredPolicy:
    """Mix policies of the run in a folder, score the blend by fresh episodes, and write it to a file.

    Raises PolicyFileError, and ComputationFailed.
    """
    place, target = Path(place), Path(target)
    check_target(target, force)
    scored = score_blend(mix([load_policy(policy_path(place, parent)) for parent in blend.parents], blend))
    try:
        write_stored_policy(target, scored)
    except OSError as error:
        raise PolicyFileError(f"{target} cannot be written: {error.strerror}") from error
    return scored


def score_blend(policy: StoredPolicy) -> StoredPolicy:
    """Return a blend with the score of fresh episodes. Raises PolicyFileError if they have none, ComputationFailed."""
    returns = evaluate_stored(policy, jax.random.split(jax.random.key(BLEND_SEED), BLEND_EPISODES))
    undiscounted = np.asarray(returns.undiscounted, np.float64)
    if not np.isfinite(undiscounted).all():
        raise PolicyFileError("the returns of this blend are not finite")
    scores = {
        "values": undiscounted.mean(axis=0).tolist(),
        "score": undiscounted.mean(axis=0).tolist(),
        "std": undiscounted.std(axis=0).tolist(),
        "discounted": np.asarray(returns.discounted, np.float64).mean(axis=0).tolist(),
        "evaluation_episodes": BLEND_EPISODES,
    }
    return replace(policy, header=policy.header | scores)


def evaluate_in_gymnasium(policy: StoredPolicy, episodes: int, seed: int) -> np.ndarray:
    """Undiscounted returns [episodes, M] of deterministic episodes in MO-Gymnasium's environment of the same id.

    Raises NotInGymnasium, saying what to do, without the `gymnasium` extra or such an environment there.
    """
    environment = _original(policy.header["environment"], len(policy.header["objectives"]))
    with quiet_mujoco():
        returns = [_episode_return(environment, policy, seed if index == 0 else None) for index in range(episodes)]
    environment.close()
    return np.stack(returns)


def _episode_return(environment: Any, policy: StoredPolicy, seed: int | None) -> np.ndarray:  # [M]
    observation, _ = environment.reset(seed=seed)
    rewards, ended = [], False
    while not ended:
        observation, reward, terminated, truncated, _ = environment.step(policy(observation))
        rewards.append(reward)
        ended = terminated or truncated
    return np.stack(rewards).sum(axis=0, dtype=np.float64)


def _original(id: str, objectives: int) -> Any:
    """Return the environment there, or NotInGymnasium."""
    try:
        import gymnasium

        from envs.gymnasium import original
    except ImportError as error:
        raise NotInGymnasium(f"MO-Gymnasium is not installed ({error}): pip install 'jmorl[gymnasium]'") from error
    try:
        environment = original(id)
    except (gymnasium.error.Error, ImportError) as error:
        raise NotInGymnasium(f"MO-Gymnasium has no environment {envs.plain_id(id)!r} here: {error}") from error
    there = environment.unwrapped.reward_space.shape[0]
    if there != objectives:
        raise NotInGymnasium(f"{envs.plain_id(id)!r} has {there} objectives in MO-Gymnasium, and {objectives} here")
    return environment


def difference_in_errors(ours: np.ndarray, theirs: np.ndarray) -> np.ndarray:
    """How many standard errors the mean of `theirs` [N, M] is above that of `ours` [N, M], for each objective.

    NaN where both never vary or there is only one episode.
    """
    if min(len(ours), len(theirs)) < 2:
        return np.full(ours.shape[1], np.nan)
    variance = ours.var(axis=0, ddof=1) / len(ours) + theirs.var(axis=0, ddof=1) / len(theirs)
    with np.errstate(divide="ignore", invalid="ignore"):
        z: np.ndarray = np.where(variance > 0, (theirs.mean(axis=0) - ours.mean(axis=0)) / np.sqrt(variance), np.nan)
    return z

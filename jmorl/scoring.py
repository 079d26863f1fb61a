"""From episodes to scores: what a policy is worth, in raw units.

A score is the mean undiscounted return over the evaluation episodes: it means the same in every run and at
every time of a run.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

import envs
from jmorl.learning.rollout import EpisodeReturns, episode_returns
from jmorl.storage.policy_file import StoredPolicy


class Scores(NamedTuple):
    """The scores of P policies."""

    values: np.ndarray  # [P, M] mean undiscounted return
    spread: np.ndarray  # [P, M] standard deviation over the episodes
    discounted: np.ndarray  # [P, M] mean discounted return
    steps: int  # environment steps of all episodes


def raw_scores(returns: EpisodeReturns) -> Scores:
    """Score `EpisodeReturns` [P, episodes, M]. Means are taken in float64."""
    undiscounted = np.asarray(returns.undiscounted, np.float64)
    discounted = np.asarray(returns.discounted, np.float64)
    return Scores(undiscounted.mean(1), undiscounted.std(1), discounted.mean(1), int(returns.length.sum()))


def evaluate_stored(policy: StoredPolicy, keys: jax.Array) -> EpisodeReturns:
    """Deterministic episodes of a stored policy in its environment, one for each start key [episodes].

    Another number of episodes is another compiled program: the last bits of a return may differ.
    """
    environment = envs.make(policy.header["environment"])
    discount = policy.header["discount"]

    def act(observation: jax.Array) -> tuple[jax.Array, jax.Array]:
        return policy.mean_action(observation, jnp), jnp.asarray(policy.log_std)

    def episode(key: jax.Array) -> EpisodeReturns:
        return episode_returns(environment, act, key, discount)

    returns: EpisodeReturns = jax.device_get(jax.jit(jax.vmap(episode))(keys))
    return returns

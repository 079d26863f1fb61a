"""From episodes to scores: what a policy is worth, in raw or in the paper's units.

A raw score is the mean undiscounted return over the evaluation episodes: it means the same in every run and at
every time of a run. For the paper's see `jmorl.units`.
"""

from typing import NamedTuple

import numpy as np

from jmorl.learning.rollout import EpisodeReturns
from jmorl.units import RunningUnits, in_running_units


class Scores(NamedTuple):
    """The scores of P policies."""

    values: np.ndarray  # [P, M] in the units of the scorer
    std: np.ndarray  # [P, M] standard deviation over the episodes
    discounted: np.ndarray  # [P, M] mean discounted return, raw
    steps: int  # environment steps of all episodes
    raw: np.ndarray | None = None  # [P, M] mean undiscounted return, where `values` are in other units


def raw_scores(returns: EpisodeReturns) -> Scores:
    """Score `EpisodeReturns` [P, episodes, M]. Means are taken in float64."""
    undiscounted = np.asarray(returns.undiscounted, np.float64)
    discounted = np.asarray(returns.discounted, np.float64)
    return Scores(undiscounted.mean(1), undiscounted.std(1), discounted.mean(1), int(returns.length.sum()))


def paper_scores(
    returns: EpisodeReturns, units: RunningUnits, discount: float, scale_discount: float
) -> tuple[Scores, RunningUnits]:
    """Score `EpisodeReturns` [P, episodes, M] with traces as the authors do, and the units after all of them.

    An episode is worth sum_t discount^t r_t, r_t in running units; those are fed agent by agent, episode by episode,
    as the authors' one evaluation environment is. `scale_discount` is that of the units' own sums.
    """
    assert returns.trace is not None, "evaluation in paper units keeps every reward"
    rewards, terminated, lengths = map(np.asarray, (*returns.trace, returns.length))
    powers = discount ** np.arange(rewards.shape[2])
    worth = np.empty(np.shape(returns.undiscounted))  # [P, episodes, M]
    for each in np.ndindex(*lengths.shape):
        length = lengths[each]
        scaled, units = in_running_units(rewards[each][:length], bool(terminated[each]), units, scale_discount)
        worth[each] = powers[:length] @ scaled
    raw = raw_scores(returns)
    return raw._replace(values=worth.mean(1), std=worth.std(1), raw=raw.values), units

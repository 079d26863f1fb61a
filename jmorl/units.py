"""The paper's units: rewards divided by a running deviation that every episode scored so far has moved.

The authors score policies in one environment whose reward wrappers are never reset, so that a score depends on all
that was scored before it in the same run: the units drift. They are here to compare with the published numbers.

Letters: T steps of an episode, M objectives.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from envs.core import Objective

VARIANCE_FLOOR = 1e-8  # added under the root
REWARD_CLIP = 10.0
DRIFTING = "running deviations"  # what an objective is measured in


@dataclass(frozen=True)
class RunningUnits:
    """Mean and population variance of every discounted sum so far, per objective, and where the sums stand.

    The state of MO-Gymnasium's `MONormalizeReward`, one for each objective.
    """

    count: np.ndarray  # [M]
    mean: np.ndarray  # [M]
    variance: np.ndarray  # [M]
    discounted_sum: np.ndarray  # [M] G after the last step; only termination ends it, never a time limit or a reset

    @property
    def deviation(self) -> np.ndarray:  # [M]
        """Sigma: what a reward would be divided by now."""
        return np.asarray(np.sqrt(self.variance + VARIANCE_FLOOR))


def initial_units(objectives: int) -> RunningUnits:
    """Before the first reward: mean 0 and variance 1, with next to no weight of their own."""
    return RunningUnits(np.full(objectives, 1e-4), np.zeros(objectives), np.ones(objectives), np.zeros(objectives))


def in_running_units(
    rewards: np.ndarray,  # [T, M] of one episode, T >= 1, raw
    terminated: bool,  # at the last step, by itself and not by a time limit
    units: RunningUnits,
    discount: float,
) -> tuple[np.ndarray, RunningUnits]:
    """Return the episode's rewards [T, M] as the wrappers give them out, and the units after it.

    Step by step `G <- discount G (1 - terminated) + r` enters mean and variance (Welford 1962, Chan et al. 1979), and
    r is divided by the deviation of all G up to this one, and clipped. The merging of single numbers is summed up:
    after n of them, with d = G - mean_0, mean_n = mean_0 + sum d / (count_0 + n), and the squared deviations from it
    are those from mean_0 less (sum d)^2 / (count_0 + n).
    """
    rewards = np.asarray(rewards, np.float64)
    sums = _discounted_sums(rewards, terminated, units.discounted_sum, discount)
    differences = sums - units.mean
    total = np.cumsum(differences, axis=0)
    count = units.count + np.arange(1, len(rewards) + 1)[:, None]
    squares = units.count * units.variance + np.cumsum(differences**2, axis=0) - total**2 / count
    variance = squares / count
    scaled = np.clip(rewards / np.sqrt(variance + VARIANCE_FLOOR), -REWARD_CLIP, REWARD_CLIP)
    return scaled, RunningUnits(count[-1], units.mean + total[-1] / count[-1], variance[-1], sums[-1])


def _discounted_sums(rewards: np.ndarray, terminated: bool, before: np.ndarray, discount: float) -> np.ndarray:
    """G after every step [T, M]."""
    sums = np.empty_like(rewards)
    for step, reward in enumerate(rewards):
        before = sums[step] = discount * before + reward
    if terminated:
        sums[-1] = rewards[-1]
    return sums


def measured_in(units: str, objectives: Sequence[Objective]) -> tuple[Objective, ...]:
    """Return the objectives as scores have them: in "paper" units they have lost those of the environment."""
    if units == "raw":
        return tuple(objectives)
    return tuple(replace(objective, unit=DRIFTING, highest=math.inf, reading=None) for objective in objectives)

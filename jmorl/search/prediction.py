"""What training a policy with given weights is expected to lead to (Xu et al. 2020).

All values here are scaled by the range of the front (`jmorl.search.scaling`), so no constant depends on units.
"""

from dataclasses import dataclass

import numpy as np

from jmorl.search.fitting import fit_tanh, tanh_curve
from jmorl.search.scaling import Scale

NEARNESS = 0.1  # tau: a record is near if its parent is, in every objective
KERNEL_WIDTH = 0.03  # sigma of the records' importance
ENOUGH_WEIGHTS = 4  # tau and sigma double until the near records have this many different weights


@dataclass(frozen=True)
class Records:
    """What came of every trained task: one row is a true edge from a parent to its child."""

    parents: np.ndarray  # [R, M]
    weights: np.ndarray  # [R, M]
    children: np.ndarray  # [R, M]

    @classmethod
    def empty(cls, objectives: int) -> "Records":
        """Return no records of a number of objectives."""
        return cls(*np.zeros((3, 0, objectives)))

    def add(self, parents: np.ndarray, weights: np.ndarray, children: np.ndarray) -> "Records":
        """With the tasks of a generation, [P, M] each, at the end."""
        return Records(
            np.concatenate([self.parents, parents]),
            np.concatenate([self.weights, weights]),
            np.concatenate([self.children, children]),
        )

    def scaled(self, scale: Scale) -> "Records":
        """Return the same records in the current scale; weights have none."""
        return Records(scale.apply(self.parents), self.weights, scale.apply(self.children))


def predict(candidates: np.ndarray, weights: np.ndarray, records: Records) -> np.ndarray:
    """Return the children expected from training each candidate with each of the weights, [C, M], [W, M] -> [C, W, M].

    Per candidate and objective one curve is fitted to the near records' (weight, change), and evaluated
    at all weights. Without records no change is expected. Candidates and records in scaled values.
    """
    (c, m), w, r = candidates.shape, len(weights), len(records.parents)
    if r == 0:
        return np.repeat(candidates[:, None, :], w, axis=1)
    importance, nearest = neighbourhoods(candidates, records)  # [K, C]
    changes = records.children - records.parents
    parameters = fit_tanh(  # [4, C*M]
        records.weights[nearest].reshape(-1, c * m),
        changes[nearest].reshape(-1, c * m),
        np.repeat(importance, m, axis=1),
    )
    curves = tanh_curve(parameters, np.tile(weights, (1, c))).reshape(w, c, m)
    return candidates[:, None, :] + np.swapaxes(curves, 0, 1)


def neighbourhoods(candidates: np.ndarray, records: Records) -> tuple[np.ndarray, np.ndarray]:
    """Return importance and index, [K, C] each, of the records near each candidate; importance 0 fills a column up.

    How often tau and sigma double is computed, not searched for, so no record is too far away.
    """
    offsets = records.parents[None] - candidates[:, None]  # [C, R, M]
    doublings = _doublings_until_near(np.abs(offsets).max(axis=2))  # [C, R]
    needed = _doublings_needed(doublings, records.weights)[:, None]
    near = doublings <= needed
    nearest = np.argsort(~near, axis=1, kind="stable")[:, : near.sum(axis=1).max()]
    widths = KERNEL_WIDTH * 2.0**needed
    importance = np.where(near, np.exp(-(offsets**2).sum(axis=2) / (2 * widths**2)), 0.0)
    return np.take_along_axis(importance, nearest, axis=1).T, nearest.T


def _doublings_until_near(distances: np.ndarray) -> np.ndarray:
    """Return the least k >= 0 with distance < tau 2^k; of any shape."""
    # distance / tau = mantissa 2^exponent with mantissa in [0.5, 1), so it is < 2^exponent and >= 2^(exponent - 1)
    _, exponent = np.frexp(distances / NEARNESS)
    return np.maximum(exponent, 0)


def _doublings_needed(doublings: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Per candidate, the least number of doublings with enough different weights near; else with all records, [C]."""
    _, kind = np.unique(weights.round(9), axis=0, return_inverse=True)
    if kind.max() + 1 < ENOUGH_WEIGHTS:
        return doublings.max(axis=1)
    first = np.stack([doublings[:, kind == k].min(axis=1) for k in range(kind.max() + 1)], axis=1)
    return np.sort(first, axis=1)[:, ENOUGH_WEIGHTS - 1]

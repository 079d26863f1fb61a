"""What training a policy with given weights is expected to lead to (Xu et al. 2020), and how far off that may be.

The spread of a prediction follows from the residuals of the curve that it comes from. How far what comes lies from what
was predicted, in units of that spread, is remembered; the last of these surprises calibrate the intervals of the next
predictions (split conformal prediction with a moving window: Lei et al. 2018, Gibbs and Candes 2021).

All values here are scaled by the range of the front (`jmorl.search.scaling`), so no constant depends on units.
Letters: C candidates, W candidate weights, R records, K records near a candidate, M objectives.
"""

from dataclasses import dataclass, fields
from statistics import NormalDist

import numpy as np

from jmorl.search.fitting import fit_tanh, tanh_curve
from jmorl.search.scaling import Scale

NEARNESS = 0.1  # tau: a record is near if its parent is, in every objective
KERNEL_WIDTH = 0.03  # sigma of the records' importance
ENOUGH_WEIGHTS = 4  # tau and sigma double until the near records have this many different weights

COVERAGE = 0.8  # share of what comes that shall lie within a prediction's interval
REMEMBERED = 36  # surprises, the last ones, that calibrate intervals
ENOUGH = 12  # surprises that an interval needs no assumption beside
PRIOR_RECORDS = 2  # that a candidate's spread counts as beside its own, with the usual change as their residual


@dataclass(frozen=True)
class Records:
    """What came of every trained task: one row is a true edge from a parent to its child."""

    parents: np.ndarray  # [R, M]
    weights: np.ndarray  # [R, M]
    children: np.ndarray  # [R, M]
    surprises: np.ndarray  # [R, M] children less their predictions, in units of the spread; NaN where there was none

    @classmethod
    def empty(cls, objectives: int) -> "Records":
        """Return no records of a number of objectives."""
        return cls(*np.zeros((len(fields(cls)), 0, objectives)))

    def add(
        self, parents: np.ndarray, weights: np.ndarray, children: np.ndarray, surprises: np.ndarray | None = None
    ) -> "Records":
        """With the tasks of a generation, [P, M] each, at the end."""
        nothing = np.full_like(parents, np.nan)
        added = (parents, weights, children, nothing if surprises is None else surprises)
        return Records(*(np.concatenate(pair) for pair in zip(vars(self).values(), added, strict=True)))

    def scaled(self, scale: Scale) -> "Records":
        """Return the same records in the current scale; weights and surprises have none."""
        return Records(scale.apply(self.parents), self.weights, scale.apply(self.children), self.surprises)

    def odds(self) -> float:
        """Return how likely a child is at least as good as predicted in every objective: as often as remembered ones.

        While there are few, one in two is assumed in each objective.
        """
        known = self._remembered()
        assumed = float(0.5 ** known.shape[1])
        share = min(len(known) / ENOUGH, 1.0)
        return assumed if not len(known) else float(share * (known >= 0).all(axis=1).mean() + (1 - share) * assumed)

    def interval_ends(self) -> np.ndarray:
        """Return between which surprises [2, M] the middle `COVERAGE` of those to come lies: as of the remembered ones.

        While there are few, they are taken for normally distributed in part.
        """
        known = self._remembered()
        tails = [(1 - COVERAGE) / 2, (1 + COVERAGE) / 2]
        normal = np.array([[NormalDist().inv_cdf(tail)] * known.shape[1] for tail in tails])
        if not len(known):
            return normal
        share = min(len(known) / ENOUGH, 1.0)
        return share * np.quantile(known, tails, axis=0, method="weibull") + (1 - share) * normal

    def _remembered(self) -> np.ndarray:
        """Return the last surprises [K, M], without those of tasks that came without a prediction."""
        return self.surprises[~np.isnan(self.surprises).any(axis=1)][-REMEMBERED:]


@dataclass(frozen=True)
class Prediction:
    """The children expected from training candidates with weights."""

    expected: np.ndarray  # [C, W, M]
    spread: np.ndarray  # [C, M] standard deviation, at least, of what comes about that; 0 without records


def predict(candidates: np.ndarray, weights: np.ndarray, records: Records) -> Prediction:
    """Return what to expect from training each candidate [C, M] with each of the weights [W, M].

    Per candidate and objective one curve is fitted to the near records' (weight, change), and evaluated
    at all weights. Without records no change is expected. Candidates and records in scaled values.
    """
    (c, m), w, r = candidates.shape, len(weights), len(records.parents)
    if r == 0:
        return Prediction(np.repeat(candidates[:, None, :], w, axis=1), np.zeros_like(candidates))
    importance, nearest = neighbourhoods(candidates, records)  # [K, C]
    changes = records.children - records.parents
    near_weights, near_changes = (each[nearest].reshape(-1, c * m) for each in (records.weights, changes))
    parameters = fit_tanh(near_weights, near_changes, np.repeat(importance, m, axis=1))  # [4, C*M]
    curves = tanh_curve(parameters, np.tile(weights, (1, c))).reshape(w, c, m)
    residuals = (tanh_curve(parameters, near_weights) - near_changes).reshape(-1, c, m)  # [K, C, M]
    usual = np.sqrt((changes**2).mean(axis=0))  # [M]
    return Prediction(candidates[:, None, :] + np.swapaxes(curves, 0, 1), _spread(residuals, importance, usual))


def _spread(residuals: np.ndarray, importance: np.ndarray, usual: np.ndarray) -> np.ndarray:
    """Return the spread [C, M] that residuals [K, C, M] of records with importance [K, C] suggest.

    Few or far records say little: the spread is then near the `usual` change [M].
    """
    total = importance.sum(axis=0)
    effective = total**2 / (importance**2).sum(axis=0)  # number of records, [C] (Kish 1965)
    mean_square = np.einsum("kc,kcm->cm", importance / total, residuals**2)
    share = (effective / (effective + PRIOR_RECORDS))[:, None]
    return np.sqrt((share * mean_square + (1 - share) * usual**2) * (1 + 1 / (effective + 1))[:, None])


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

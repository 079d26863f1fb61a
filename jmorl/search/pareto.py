"""Sets of objective vectors: which are non-dominated, and how good the set is. Maximisation, any M."""

import moocore
import numpy as np


def non_dominated(values: np.ndarray) -> np.ndarray:
    """Which of the vectors [N, M] no other dominates, [N]; of equal ones only the first. N may be zero."""
    if len(values) == 0:
        return np.zeros(0, bool)
    return np.asarray(moocore.is_nondominated(values, maximise=True))


def hypervolume(values: np.ndarray, reference: np.ndarray) -> float:
    """The volume that the vectors [N, M] dominate above the reference point [M].

    Vectors that are not above it in every objective contribute nothing; N may be zero.
    """
    return float(moocore.hypervolume(values, ref=reference, maximise=True))


def sparsity(values: np.ndarray) -> float:
    """Mean squared gap between neighbours, objective by objective (Xu et al. 2020).

    Over the non-dominated subset of the vectors [N, M], sorted in each objective; 0 with fewer than two.
    """
    front = np.sort(values[non_dominated(values)], axis=0)
    return float((np.diff(front, axis=0) ** 2).sum() / (len(front) - 1)) if len(front) > 1 else 0.0


def expected_utility(values: np.ndarray, weights: np.ndarray) -> float:
    """Mean over the weights [W, M] of the best linear utility among the vectors [N, M], N >= 1.

    (Zintgraf et al. 2015, with the weights given instead of drawn.)
    """
    return float((values @ weights.T).max(axis=0).mean())

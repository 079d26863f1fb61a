"""Sets of objective vectors: which are non-dominated, how good the set is, what it lacks. Maximisation, any M."""

import moocore
import numpy as np

QUICK_OBJECTIVES = 4  # with so many an exact hypervolume takes milliseconds whatever the size of the set
QUICK_WORK = 6_400  # vectors times two to the power of the objectives: with more of both, what is exact takes seconds
SAMPLES = 2**16  # of an approximate hypervolume


def non_dominated(values: np.ndarray) -> np.ndarray:
    """Which of the vectors [N, M] no other dominates, [N]; of equal ones only the first. N may be zero."""
    if len(values) == 0:
        return np.zeros(0, bool)
    return np.asarray(moocore.is_nondominated(values, maximise=True))


def hypervolume(values: np.ndarray, reference: np.ndarray) -> float:
    """Return the volume that the vectors [N, M] dominate above the reference point [M].

    Vectors that are not above it in every objective contribute nothing; N may be zero. Exact where `exact_is_quick`,
    else approximate: the same for the same vectors, and within a hundredth where that was compared.
    """
    values = np.array(values, float)  # a copy: moocore negates its argument in place if that was unpickled
    if exact_is_quick(*values.shape):
        return float(moocore.hypervolume(values, ref=reference, maximise=True))
    return float(moocore.hv_approx(values, ref=reference, maximise=True, nsamples=SAMPLES))


def exact_is_quick(vectors: int, objectives: int) -> bool:
    """Whether the exact hypervolume of a set of this size takes some hundredths of a second at most."""
    return objectives <= QUICK_OBJECTIVES or vectors * 2**objectives <= QUICK_WORK


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


def farthest_first(values: np.ndarray, taken: np.ndarray, count: int) -> list[int]:
    """Return the indices of so many of the vectors [N, M], or of all: each is the one farthest from all before it.

    Before the first one come those that are `taken` [K, M], K >= 1 (Gonzalez 1985).
    """
    distances = np.linalg.norm(values[:, None] - taken[None], axis=2).min(axis=1)
    chosen: list[int] = []
    while len(chosen) < min(count, len(values)):
        chosen.append(int(distances.argmax()))
        distances = np.minimum(distances, np.linalg.norm(values - values[chosen[-1]], axis=1))
        distances[chosen] = -1.0
    return chosen

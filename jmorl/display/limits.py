"""Which part of objective space a picture shows, so that a few hopeless policies do not squash all others."""

import numpy as np

FEW = 5  # values whose spread says nothing
TINY = 1e-300  # too near to 0 to calculate with
HUGE = 1e300  # and too far from it


def core(values: np.ndarray) -> np.ndarray:
    """Which of the vectors [N, M] are not far out in any objective, [N].

    Far out: more than three interquartile ranges beyond the quartiles (Tukey 1977), or not finite. Of few vectors, all
    that are finite are core.
    """
    near = _finite(values)
    if near.sum() < FEW:
        return near
    low, high = np.quantile(values[near], [0.25, 0.75], axis=0)
    reach = np.where(high > low, 3 * (high - low), np.inf)
    return near & ((values >= low - reach) & (values <= high + reach)).all(axis=1)


def hopeful(values: np.ndarray) -> np.ndarray:
    """Which of the vectors [N, M] are not far below the best nine tenths in any objective, [N].

    Far below: by more than three times the extent of those nine tenths.
    """
    low, best = np.quantile(values, 0.1, axis=0), values.max(axis=0)
    return (values >= low - 3 * (best - low)).all(axis=1)


def around(values: np.ndarray, margin: float = 0.06) -> np.ndarray:
    """Return limits of axes around the vectors [N, M], with a share of their extent as margin: lows and highs [2, M].

    Those that are not finite do not count; without any the limits are 0 and 1.
    """
    values = values[_finite(values)]
    if not len(values):
        return np.repeat([[0.0], [1.0]], values.shape[1], axis=1)
    low, high = values.min(axis=0), values.max(axis=0)
    size = np.maximum(np.abs(low), np.abs(high))
    without_range = np.where(size > TINY, 0.1 * size, 1.0)
    extent = np.where(high - low > 1e-9 * size, high - low, without_range)
    return np.stack([low - margin * extent, high + margin * extent])


def inside(values: np.ndarray, limits: np.ndarray) -> np.ndarray:
    """Which of the vectors [..., M] lie within the limits [2, M], [...]."""
    return ((values >= limits[0]) & (values <= limits[1])).all(axis=-1)


def _finite(values: np.ndarray) -> np.ndarray:
    """Which of the vectors [N, M] can be calculated with, [N]."""
    return (np.abs(values) < HUGE).all(axis=1)

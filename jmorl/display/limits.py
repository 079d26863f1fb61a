"""Which part of objective space a picture shows, so that a few hopeless policies do not squash all others."""

import numpy as np

FEW = 5  # values whose spread says nothing
TINY = 1e-300  # too near to 0 to calculate with


def core(values: np.ndarray) -> np.ndarray:
    """Which of the vectors [N, M] are not far out in any objective, [N].

    Far out: more than three interquartile ranges beyond the quartiles (Tukey 1977). Of few vectors, all are core.
    """
    if len(values) < FEW:
        return np.ones(len(values), bool)
    low, high = np.quantile(values, [0.25, 0.75], axis=0)
    reach = np.where(high > low, 3 * (high - low), np.inf)
    return ((values >= low - reach) & (values <= high + reach)).all(axis=1)


def hopeful(values: np.ndarray) -> np.ndarray:
    """Which of the vectors [N, M] are not far below the best nine tenths in any objective, [N].

    Far below: by more than three times the extent of those nine tenths.
    """
    low, best = np.quantile(values, 0.1, axis=0), values.max(axis=0)
    return (values >= low - 3 * (best - low)).all(axis=1)


def around(values: np.ndarray, margin: float = 0.06) -> np.ndarray:
    """The limits of axes around the vectors [N, M], with a share of their extent as margin: lows and highs [2, M]."""
    low, high = values.min(axis=0), values.max(axis=0)
    size = np.maximum(np.abs(low), np.abs(high))
    without_range = np.where(size > TINY, 0.1 * size, 1.0)
    extent = np.where(high - low > 1e-9 * size, high - low, without_range)
    return np.stack([low - margin * extent, high + margin * extent])


def inside(values: np.ndarray, limits: np.ndarray) -> np.ndarray:
    """Which of the vectors [..., M] lie within the limits [2, M], [...]."""
    return ((values >= limits[0]) & (values <= limits[1])).all(axis=-1)

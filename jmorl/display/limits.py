"""Which part of objective space a picture shows, so that a few hopeless policies do not squash all others."""

import numpy as np

from jmorl.search.scaling import finite

TINY = 1e-300  # too near to 0 to calculate with


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
    values = values[finite(values)]
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

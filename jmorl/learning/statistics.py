"""Running mean and variance, merged batch by batch (Chan et al. 1979)."""

import jax
import jax.numpy as jnp
from flax import struct

NORMALIZED_CLIP = 10.0
VARIANCE_FLOOR = 1e-8  # added under the root


@struct.dataclass
class RunningStatistics:
    """Mean and population variance of everything seen so far."""

    mean: jax.Array  # [...]
    variance: jax.Array  # [...]
    count: jax.Array  # [] float32


def initial_statistics(shape: tuple[int, ...]) -> RunningStatistics:
    """Mean 0 and variance 1, with next to no weight of their own."""
    return RunningStatistics(jnp.zeros(shape), jnp.ones(shape), jnp.array(1e-4))


def update_statistics(statistics: RunningStatistics, batch: jax.Array) -> RunningStatistics:
    """Merge `batch` [..., *shape]; all axes before the statistics' own are samples."""
    sample_axes = tuple(range(batch.ndim - statistics.mean.ndim))
    batch_count = batch.size / statistics.mean.size
    batch_mean = batch.mean(sample_axes)
    batch_variance = batch.var(sample_axes)
    count = statistics.count + batch_count
    delta = batch_mean - statistics.mean
    mean = statistics.mean + delta * batch_count / count
    variance = (
        statistics.variance * (statistics.count / count)
        + batch_variance * (batch_count / count)
        + delta**2 * (statistics.count / count) * (batch_count / count)
    )
    return RunningStatistics(mean, variance, count)


def normalize(statistics: RunningStatistics, x: jax.Array) -> jax.Array:
    """`x` [..., *shape] in standard deviations from the mean, clipped to ±10."""
    deviation = jnp.sqrt(statistics.variance + VARIANCE_FLOOR)
    mean, deviation = (jax.lax.broadcast_to_rank(each, x.ndim) for each in (statistics.mean, deviation))
    normalized = (x - mean) / deviation
    return jnp.clip(normalized, -NORMALIZED_CLIP, NORMALIZED_CLIP)


def return_scale(statistics: RunningStatistics) -> jax.Array:
    """Return the divisor of rewards: the standard deviation of their discounted sums, [M].

    An objective whose sums (next to) never vary has no scale of that kind and takes their size instead.
    """
    deviation = jnp.sqrt(statistics.variance + VARIANCE_FLOOR)
    size = jnp.abs(statistics.mean)
    return jnp.where(deviation < 1e-3 * size, size, deviation)

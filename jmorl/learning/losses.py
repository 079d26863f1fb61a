"""The PPO losses (Schulman et al. 2017), with one value per objective."""

import jax
import jax.numpy as jnp


def normalize_advantages(advantages: jax.Array) -> jax.Array:  # [B] -> [B]
    """Zero mean and unit standard deviation (ddof 1); a batch of one, or a constant one, becomes zero."""
    centred = advantages - advantages.mean()
    degrees_of_freedom = max(advantages.shape[0] - 1, 1)
    # The square root's gradient is infinite at zero, but advantages carry no gradient.
    return centred / (jnp.sqrt((centred**2).sum() / degrees_of_freedom) + 1e-8)


def clipped_surrogate_loss(
    log_probability: jax.Array,  # [B] under the current policy
    old_log_probability: jax.Array,  # [B] when the action was taken
    advantages: jax.Array,  # [B]
    clip: float,
) -> jax.Array:
    """Minus the mean of min(rho A, clip(rho, 1 ± clip) A) (Schulman et al. 2017, eq. 7)."""
    ratio = jnp.exp(log_probability - old_log_probability)
    clipped_ratio = jnp.clip(ratio, 1.0 - clip, 1.0 + clip)
    return -jnp.minimum(ratio * advantages, clipped_ratio * advantages).mean()


def clipped_value_loss(
    values: jax.Array,  # [B, M]
    old_values: jax.Array,  # [B, M]
    returns: jax.Array,  # [B, M]
    clip: float,
) -> jax.Array:
    """Half the larger of the plain and the clipped squared error, mean over batch and objectives."""
    clipped_values = old_values + jnp.clip(values - old_values, -clip, clip)
    squared_error = jnp.maximum((values - returns) ** 2, (clipped_values - returns) ** 2)
    return 0.5 * squared_error.mean()


def action_bound_loss(
    mean: jax.Array,  # [B, A] normalised
    low: jax.typing.ArrayLike,  # [] or [A] normalised, as `ActionBox.normalized_bounds`
    high: jax.typing.ArrayLike,
) -> jax.Array:  # []
    """Return the squared distance of the mean actions from the box [low, high], summed over A, mean over the batch.

    Beyond the box all samples do the same, so nothing else pulls a mean back that was driven there while the
    noise was large. (The "bounds loss" of rl_games, Makoviichuk and Makoviychuk 2021.)
    """
    lows, highs = (jax.lax.broadcast_to_rank(jnp.asarray(bound, mean.dtype), mean.ndim) for bound in (low, high))
    nearest = jnp.clip(mean, lows, highs)
    return ((mean - nearest) ** 2).sum(-1).mean()

"""Discounted sums along one trajectory. No batch axis: the caller vmaps."""

import jax
import jax.numpy as jnp


def generalized_advantages(
    r_t: jax.Array,  # [T, M]
    v_t: jax.Array,  # [T, M] value of the observation acted on
    v_tp1: jax.Array,  # [T, M] value of the true successor, also where the episode ended
    terminated_t: jax.Array,  # [T] bool
    truncated_t: jax.Array,  # [T] bool
    discount: float,
    lambda_: float,
) -> jax.Array:  # [T, M]
    """Generalised advantage estimation per objective (Schulman et al. 2016, eq. 16).

    delta_t = r_t + gamma v_tp1 (1 - terminated_t) - v_t;  A_t = delta_t + gamma lambda A_{t+1},
    where either kind of ending cuts the trace and only a termination cuts the bootstrap.
    """
    continuing_t = 1.0 - terminated_t.astype(r_t.dtype)
    delta_t = r_t + discount * v_tp1 * continuing_t[:, None] - v_t
    trace_t = discount * lambda_ * (1.0 - (terminated_t | truncated_t).astype(r_t.dtype))

    def backward(a_tp1: jax.Array, inputs: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        delta, trace = inputs
        a_t = delta + trace * a_tp1
        return a_t, a_t

    _, a_t = jax.lax.scan(backward, jnp.zeros_like(delta_t[0]), (delta_t, trace_t), reverse=True)
    return a_t


def discounted_sums(
    r_t: jax.Array,  # [T, M]
    ended_t: jax.Array,  # [T] bool
    g_tm1: jax.Array,  # [M] the sum carried over from the previous rollout
    discount: float,
) -> tuple[jax.Array, jax.Array]:
    """G_t = gamma G_{t-1} + r_t, forgotten after an ending: (G_t [T, M], the sum to carry [M]).

    Its standard deviation is the scale of the rewards (as in Gymnasium's NormalizeReward).
    """

    def forward(g: jax.Array, inputs: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        r, ended = inputs
        g_t = discount * g + r
        return jnp.where(ended, 0.0, g_t), g_t

    carried, g_t = jax.lax.scan(forward, g_tm1, (r_t, ended_t))
    return g_t, carried

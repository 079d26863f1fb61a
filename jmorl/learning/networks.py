"""The actor and the vector-valued critic: tanh MLPs with orthogonal initialisation (Huang et al. 2022)."""

import math
from collections.abc import Sequence

import flax.linen as nn
import jax
import jax.numpy as jnp


class MLP(nn.Module):
    """Tanh hidden layers with gain sqrt(2), a linear output layer with its own gain, zero biases."""

    hidden_sizes: Sequence[int]
    output_size: int
    output_gain: float

    @nn.compact
    def __call__(self, x: jax.Array) -> jax.Array:  # [..., O] -> [..., output_size]
        for size in self.hidden_sizes:
            x = nn.tanh(nn.Dense(size, kernel_init=nn.initializers.orthogonal(math.sqrt(2)))(x))
        return nn.Dense(self.output_size, kernel_init=nn.initializers.orthogonal(self.output_gain))(x)


class Actor(nn.Module):
    """A diagonal Gaussian policy: the mean is an MLP of the observation, the log-std a free vector."""

    hidden_sizes: Sequence[int]
    action_size: int
    initial_log_std: float

    @nn.compact
    def __call__(self, observation: jax.Array) -> tuple[jax.Array, jax.Array]:
        """Observations [..., O] to (mean [..., A], log standard deviation [A])."""
        mean = MLP(self.hidden_sizes, self.action_size, output_gain=0.01)(observation)
        log_std = self.param("log_std", nn.initializers.constant(self.initial_log_std), (self.action_size,))
        return mean, log_std


def critic_network(hidden_sizes: Sequence[int], objectives: int) -> MLP:
    """Observations [..., O] to one value per objective [..., M]."""
    return MLP(hidden_sizes, objectives, output_gain=1.0)


def gaussian_log_probability(mean: jax.Array, log_std: jax.Array, action: jax.Array) -> jax.Array:
    """log N(action; mean, diag exp(2 log_std)): means and actions [..., A] to [...]."""
    z = (action - mean) * jnp.exp(-log_std)
    return (-0.5 * z**2 - log_std - 0.5 * math.log(2 * math.pi)).sum(-1)


def gaussian_entropy(log_std: jax.Array) -> jax.Array:
    """The entropy in nats of a diagonal Gaussian with log standard deviations [A]."""
    return (log_std + 0.5 * math.log(2 * math.pi * math.e)).sum()

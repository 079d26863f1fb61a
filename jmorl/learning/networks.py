"""The actor and the vector-valued critic: tanh MLPs with orthogonal initialisation (Huang et al. 2022)."""

import math
from collections.abc import Sequence
from typing import Any

import flax.linen as nn
import jax
import jax.numpy as jnp


def orthogonal(gain: float) -> nn.initializers.Initializer:
    """Kernels [in, out] with orthonormal rows or columns, whichever are fewer, times `gain` (Saxe et al. 2014).

    By Gram-Schmidt, which takes no LAPACK: on a CPU, JAX 0.10's QR decomposition hangs once in some hundred calls
    of a compiled program that has several, and takes seconds to compile.
    """

    def initialize(key: jax.Array, shape: Sequence[int], dtype: Any = jnp.float32) -> jax.Array:
        few, many = sorted(shape)
        vectors = jax.random.normal(key, (few, many), dtype)

        def add(basis: jax.Array, index: jax.Array) -> tuple[jax.Array, None]:
            vector = vectors[index]
            for _ in range(2):  # once more, against what rounding left over
                vector = vector - basis.T @ (basis @ vector)
            return basis.at[index].set(vector / jnp.linalg.norm(vector)), None

        basis, _ = jax.lax.scan(add, jnp.zeros((few, many), dtype), jnp.arange(few))
        return gain * (basis if shape[0] == few else basis.T)

    return initialize


class MLP(nn.Module):
    """Tanh hidden layers with gain sqrt(2), a linear output layer with its own gain, zero biases."""

    hidden_sizes: Sequence[int]
    output_size: int
    output_gain: float

    @nn.compact
    def __call__(self, x: jax.Array) -> jax.Array:  # [..., O] -> [..., output_size]
        """Apply the network."""
        for size in self.hidden_sizes:
            x = nn.tanh(nn.Dense(size, kernel_init=orthogonal(math.sqrt(2)))(x))
        return nn.Dense(self.output_size, kernel_init=orthogonal(self.output_gain))(x)


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
    """Return log N(action; mean, diag exp(2 log_std)): means and actions [..., A] to [...]."""
    precision, log_std = (jax.lax.broadcast_to_rank(each, mean.ndim) for each in (jnp.exp(-log_std), log_std))
    z = (action - mean) * precision
    return (-0.5 * z**2 - log_std - 0.5 * math.log(2 * math.pi)).sum(-1)


def gaussian_entropy(log_std: jax.Array) -> jax.Array:
    """Return the entropy in nats of a diagonal Gaussian with log standard deviations [A]."""
    return (log_std + 0.5 * math.log(2 * math.pi * math.e)).sum()

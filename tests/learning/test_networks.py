"""Initialisation of the networks."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jmorl.learning.networks import Actor, critic_network, orthogonal


@pytest.mark.parametrize("shape", [(64, 64), (17, 64), (64, 2), (1, 64), (64, 1)])
def test_kernels_are_orthogonal_times_their_gain(shape):
    kernel = np.asarray(orthogonal(1.5)(jax.random.key(0), shape), np.float64)
    assert kernel.shape == shape
    product = kernel.T @ kernel if shape[0] >= shape[1] else kernel @ kernel.T
    np.testing.assert_allclose(product, 1.5**2 * np.eye(min(shape)), atol=1e-5)


def test_kernels_have_no_preferred_direction():
    """Uniform over orthogonal matrices: every entry has mean zero and mean square one over the size."""
    kernels = jax.vmap(lambda key: orthogonal(1.0)(key, (5, 5)))(jax.random.split(jax.random.key(0), 4000))
    np.testing.assert_allclose(kernels.mean(0), 0.0, atol=0.04)
    np.testing.assert_allclose((kernels**2).mean(0), 0.2, atol=0.02)


def test_a_new_agent_acts_near_zero_with_its_initial_deviation():
    actor = Actor((64, 64), 3, initial_log_std=-0.5)
    parameters = actor.init(jax.random.key(0), jnp.zeros(4))
    mean, log_std = actor.apply(parameters, jnp.ones((10, 4)))
    assert mean.shape == (10, 3) and np.abs(mean).max() < 0.05
    np.testing.assert_array_equal(log_std, np.full(3, -0.5))


def test_the_critic_has_a_value_for_each_objective():
    critic = critic_network((8,), 3)
    assert critic.apply(critic.init(jax.random.key(0), jnp.zeros(4)), jnp.zeros((10, 4))).shape == (10, 3)

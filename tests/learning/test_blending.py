"""Blends of train states: what lies at their ends, between and beyond them."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import envs
from jmorl.learning.blending import Normalization, blend, mixed_layers, mixed_normalization, positive_shares
from jmorl.learning.moppo import MOPPO
from jmorl.learning.networks import MLP
from jmorl.learning.settings import PPOConfig
from tests.probes import ThreeWays


@pytest.fixture(scope="module")
def moppo():
    return MOPPO(envs.make(ThreeWays.id), PPOConfig(hidden_sizes=(8, 8)))


def train_state(moppo, seed):
    """A new agent that has seen other observations than other ones."""
    state = jax.device_get(moppo.initial_train_state(jax.random.key(seed)))
    generator = np.random.default_rng(seed)
    statistics = state.observation_statistics.replace(
        mean=generator.normal(size=2).astype(np.float32),
        variance=generator.uniform(0.2, 3, size=2).astype(np.float32),
        count=np.float32(100 * seed),
    )
    return state.replace(observation_statistics=statistics)


def leaves(state):
    return [np.asarray(leaf) for leaf in jax.tree.leaves(state)]


def test_a_blend_that_is_all_of_one_policy_is_that_policy(moppo):
    states = [train_state(moppo, seed) for seed in (1, 2, 3)]
    for position, state in enumerate(states):
        blended = blend(states, np.eye(3)[position].tolist())
        for one, other in zip(leaves(blended), leaves(state), strict=True):
            np.testing.assert_array_equal(one, other)
            assert one.dtype == other.dtype


@pytest.mark.parametrize("coefficients", [(0.3, 0.7), (1.5, -0.5)])
def test_a_network_for_other_statistics_computes_the_same(moppo, coefficients):
    """Of the same network twice, once rewritten by hand for other statistics: any blend of the two is that network."""
    generator = np.random.default_rng(5)
    layers = tuple((generator.normal(size=shape), generator.normal(size=shape[1])) for shape in ((2, 6), (6, 3)))
    one, other = (Normalization(generator.normal(size=2), generator.uniform(0.5, 2, size=2)) for _ in range(2))
    ratio = np.sqrt((other.variance + 1e-8) / (one.variance + 1e-8))
    kernel, bias = layers[0]
    shifted = bias + ((other.mean - one.mean) / np.sqrt(one.variance + 1e-8)) @ kernel
    rewritten = ((kernel * ratio[:, None], shifted), layers[1])
    common = mixed_normalization([one, other], coefficients)
    blended = mixed_layers([layers, rewritten], [one, other], coefficients)
    observations = generator.normal(size=(50, 2))

    def output(network, statistics):
        x = (observations - statistics.mean) / np.sqrt(statistics.variance + 1e-8)
        return np.tanh(x @ network[0][0] + network[0][1]) @ network[1][0] + network[1][1]

    np.testing.assert_allclose(output(blended, common), output(layers, one), rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(output(rewritten, other), output(layers, one), rtol=1e-10, atol=1e-10)


def test_with_equal_statistics_parameters_are_mixed_as_they_are(moppo):
    states = [train_state(moppo, 1), train_state(moppo, 2)]
    states[1] = states[1].replace(observation_statistics=states[0].observation_statistics)
    blended = blend(states, [0.25, 0.75])
    for part in ("actor", "critic"):
        mixed = jax.tree.map(lambda one, other: 0.25 * one + 0.75 * other, *(s.parameters[part] for s in states))
        for one, other in zip(leaves(blended.parameters[part]), leaves(mixed), strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-5, atol=1e-7)
    for one, other in zip(leaves(blended.optimizer_state), leaves(states[1].optimizer_state), strict=True):
        np.testing.assert_array_equal(one, other)


def test_the_layers_are_those_that_the_network_applies(moppo):
    """With the names that flax gives them, in its order."""
    state = train_state(moppo, 4)
    observation = jnp.array([0.3, -0.2])
    mean, _ = moppo.actor.apply(state.parameters["actor"], observation)
    x = np.asarray(observation)
    mlp = state.parameters["actor"]["params"]["MLP_0"]
    for index in range(2):
        x = np.tanh(x @ mlp[f"Dense_{index}"]["kernel"] + mlp[f"Dense_{index}"]["bias"])
    x = x @ mlp["Dense_2"]["kernel"] + mlp["Dense_2"]["bias"]
    np.testing.assert_allclose(x, mean, atol=1e-6)
    assert len(mlp) == 3 and isinstance(moppo.critic, MLP)


def test_beyond_a_policy_statistics_stay_possible(moppo):
    states = [train_state(moppo, 1), train_state(moppo, 2)]
    blended = blend(states, [-1.0, 2.0])
    np.testing.assert_array_equal(blended.observation_statistics.variance, states[1].observation_statistics.variance)
    assert all(np.isfinite(leaf).all() for leaf in leaves(blended))
    assert positive_shares([-0.5, 0.5, 1.0]) == pytest.approx([0, 1 / 3, 2 / 3])

"""MOPPO's arithmetic against an independent PyTorch reference in float64 (benchmarks/peer/make_fixtures.py)."""

from pathlib import Path

import jax
import numpy as np
import pytest

from jmorl.config import PPOConfig
from jmorl.learning.losses import normalize_advantages
from jmorl.learning.moppo import MOPPO, Batch
from jmorl.learning.networks import gaussian_log_probability
from jmorl.learning.returns import generalized_advantages
from tests.probes import ThreeWays

REFERENCE = dict(np.load(Path(__file__).parent / "fixtures" / "ppo_reference.npz"))


class ReferenceSizes(ThreeWays):
    """Only its sizes matter: those of the reference."""

    objectives = ThreeWays.objectives[:2]
    observation_size = 3


@pytest.fixture(autouse=True)
def _float64():
    with jax.enable_x64(True):
        yield


@pytest.fixture
def moppo():
    names = ("clip", "value_coefficient", "entropy_coefficient", "max_gradient_norm", "learning_rate", "adam_epsilon")
    return MOPPO(ReferenceSizes(), PPOConfig(**{name: float(REFERENCE[f"settings/{name}"]) for name in names}))


def parameters(group):
    """A group of the reference's arrays as flax names them."""

    def layers(network):
        return {
            f"Dense_{index}": {kind: REFERENCE[f"{group}/{network}/{index}/{kind}"] for kind in ("kernel", "bias")}
            for index in range(3)
        }

    actor = {"params": {"MLP_0": layers("actor"), "log_std": REFERENCE[f"{group}/log_std"]}}
    return {"actor": actor, "critic": {"params": layers("critic")}}


def batch():
    b = {name.removeprefix("batch/"): array for name, array in REFERENCE.items() if name.startswith("batch/")}
    scalar = b["advantages"] @ b["weights"]
    return Batch(b["observations"], b["actions"], b["old_log_probabilities"], b["old_values"], scalar, b["returns"])


def assert_trees_close(left, right, **tolerance):
    assert jax.tree.structure(left) == jax.tree.structure(right)
    for a, b in zip(jax.tree.leaves(left), jax.tree.leaves(right), strict=True):
        np.testing.assert_allclose(a, b, **tolerance)


def test_the_reference_clips_often_enough_to_see_it():
    b = batch()
    ratio = np.exp(REFERENCE["expected/log_probabilities"] - b.log_probability)
    moved = np.abs(REFERENCE["expected/values"] - b.value)
    assert 0.1 < (np.abs(ratio - 1) > 0.2).mean() < 0.9
    assert 0.1 < (moved > 0.2).mean() < 0.9


def test_networks_and_log_probabilities(moppo):
    start, b = parameters("parameters"), batch()
    mean, log_std = moppo.actor.apply(start["actor"], b.observation)
    log_probability = gaussian_log_probability(mean, log_std, b.action)
    np.testing.assert_allclose(log_probability, REFERENCE["expected/log_probabilities"], rtol=1e-10)
    values = moppo.critic.apply(start["critic"], b.observation)
    np.testing.assert_allclose(values, REFERENCE["expected/values"], rtol=1e-10, atol=1e-12)


def test_advantage_normalisation():
    normalized = normalize_advantages(batch().advantage)
    np.testing.assert_allclose(normalized, REFERENCE["expected/normalized_advantages"], rtol=1e-10)


def test_loss_and_its_parts(moppo):
    loss, parts = moppo.loss(parameters("parameters"), batch())
    np.testing.assert_allclose(parts.policy_loss, REFERENCE["expected/policy_loss"], rtol=1e-10)
    np.testing.assert_allclose(parts.value_loss, REFERENCE["expected/value_loss"], rtol=1e-10)
    np.testing.assert_allclose(parts.entropy, REFERENCE["expected/entropy"], rtol=1e-10)
    np.testing.assert_allclose(loss, REFERENCE["expected/total_loss"], rtol=1e-10)


def test_gradients(moppo):
    gradients, _ = jax.grad(moppo.loss, has_aux=True)(parameters("parameters"), batch())
    assert_trees_close(gradients, parameters("gradients"), rtol=1e-8, atol=1e-12)


@pytest.mark.parametrize(("steps", "group"), [(1, "changes_after_1_step"), (3, "changes_after_3_steps")])
def test_optimiser_steps(moppo, steps, group):
    start = parameters("parameters")
    carry = start, moppo.optimizer.init(start)
    for _ in range(steps):
        carry, _ = jax.jit(moppo.gradient_step)(carry, batch(), moppo.config.learning_rate)
    changes = jax.tree.map(lambda after, before: after - before, carry[0], start)
    assert_trees_close(changes, parameters(group), rtol=1e-4, atol=1e-9)  # stored in float32


def test_advantages_of_a_trajectory():
    g = {name.removeprefix("gae/"): array for name, array in REFERENCE.items() if name.startswith("gae/")}
    assert g["terminated"].any() and g["truncated"].any()
    advantages = generalized_advantages(
        g["rewards"], g["values"], g["successor_values"], g["terminated"], g["truncated"], g["discount"], g["lambda"]
    )
    np.testing.assert_allclose(advantages, g["advantages"], rtol=1e-10, atol=1e-12)


def test_scalarising_before_or_after_is_the_same():
    g = {name.removeprefix("gae/"): array for name, array in REFERENCE.items() if name.startswith("gae/")}
    weights = np.array([0.3, 0.7])
    ends = g["terminated"], g["truncated"], g["discount"], g["lambda"]
    after = generalized_advantages(g["rewards"], g["values"], g["successor_values"], *ends) @ weights
    rewards, values, successor_values = (
        (g[name] @ weights)[:, None] for name in ("rewards", "values", "successor_values")
    )
    before = generalized_advantages(rewards, values, successor_values, *ends)[:, 0]
    np.testing.assert_allclose(before, after, rtol=1e-12)

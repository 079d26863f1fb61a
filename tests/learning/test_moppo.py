"""MOPPO's own steps, and what it learns on probe environments."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jmorl.config import PPOConfig
from jmorl.learning.losses import action_bound_loss, normalize_advantages
from jmorl.learning.moppo import MOPPO, Schedule, _random_order
from jmorl.learning.returns import discounted_sums
from jmorl.learning.rollout import correlated_noise
from jmorl.learning.statistics import normalize, return_scale
from tests.probes import Clipped, Compromise, Ending, Endless, Follow, OneStep, Onwards, Share, ThreeWays, TwoSteps

QUICK = {"environments": 8, "rollout_steps": 32, "minibatches": 4, "learning_rate": 3e-3, "discount": 0.9}


def learned(environment, weights=(0.5, 0.5), iterations=40, **settings):
    moppo = MOPPO(environment, PPOConfig(**{**QUICK, **settings}))
    start = moppo.initial_train_state(jax.random.key(0))
    schedule = Schedule(iterations, moppo.config.learning_rate)
    train_state, _ = jax.jit(moppo.train)(start, jnp.array(weights), jax.random.key(1), schedule)
    return moppo, train_state


def scaled_values(moppo, train_state, observations):
    """The critic's values in reward-scaled units."""
    x = normalize(train_state.observation_statistics, jnp.asarray(observations)[:, None])
    return moppo.critic.apply(train_state.parameters["critic"], x)


def values(moppo, train_state, observations):
    """The critic's values in raw units."""
    return scaled_values(moppo, train_state, observations) * return_scale(train_state.return_statistics)[None]


@pytest.mark.parametrize("size", [1, 2, 5, 4000])
def test_random_order_is_a_permutation_and_depends_on_the_key(size):
    orders = [np.asarray(_random_order(jax.random.key(seed), size)) for seed in range(3)]
    for order in orders:
        np.testing.assert_array_equal(np.sort(order), np.arange(size))
    if size > 100:
        assert not np.array_equal(orders[0], orders[1])
        assert abs(np.corrcoef(orders[0], np.arange(size))[0, 1]) < 0.1


def test_every_index_is_equally_likely_in_every_place():
    orders = jax.vmap(lambda key: _random_order(key, 4))(jax.random.split(jax.random.key(0), 4000))
    counts = np.array([[(np.asarray(orders)[:, place] == index).sum() for index in range(4)] for place in range(4)])
    assert np.abs(counts - 1000).max() < 150  # more than five standard deviations


def test_advantages_of_one_sample_or_all_equal_are_zero_not_nan():
    for advantages in (jnp.array([3.0]), jnp.full(8, -2.0)):
        np.testing.assert_array_equal(normalize_advantages(advantages), jnp.zeros_like(advantages))


def test_correlated_noise_is_standard_normal_with_its_correlation():
    noise = correlated_noise(jax.random.key(0), (100_000, 1), 0.8)[:, 0]
    np.testing.assert_allclose([noise.mean(), noise.std()], [0.0, 1.0], atol=0.03)
    np.testing.assert_allclose(np.corrcoef(noise[:-1], noise[1:])[0, 1], 0.8, atol=0.01)
    first = jax.vmap(lambda key: correlated_noise(key, (3, 1), 0.8)[:, 0])(jax.random.split(jax.random.key(1), 20_000))
    np.testing.assert_allclose(first.std(0), 1.0, atol=0.03)  # from the very first step


def test_discounted_sums_equal_a_loop():
    generator = np.random.default_rng(0)
    rewards, ended = generator.normal(size=(40, 2)).astype(np.float32), generator.random(40) < 0.2
    start = np.array([0.5, -1.0], np.float32)
    expected, carried = [], start
    for reward, end in zip(rewards, ended, strict=True):
        total = 0.9 * carried + reward
        expected.append(total)
        carried = np.zeros(2) if end else total
    sums, last = discounted_sums(rewards, ended, start, 0.9)
    np.testing.assert_allclose(sums, expected, rtol=1e-5)
    np.testing.assert_allclose(last, carried, rtol=1e-5)


def test_rollouts_continue_across_iterations():
    """Endless episodes of ten steps, seven in a rollout: the second one starts where the first one stopped."""
    moppo = MOPPO(Follow(), PPOConfig(environments=2, rollout_steps=7, minibatches=1))
    train_state = moppo.initial_train_state(jax.random.key(0))
    rollout_state = moppo.initial_rollout_state(jax.random.key(1))
    after, trajectory, _ = moppo.collect(train_state, rollout_state, jax.random.key(2))
    np.testing.assert_array_equal(trajectory.observation[:, 0], rollout_state.observations)
    _, following, _ = moppo.collect(train_state, after, jax.random.key(3))
    np.testing.assert_array_equal(following.observation[:, 0], after.observations)


def test_log_probability_is_of_the_unclipped_action_under_the_policy_that_acted():
    moppo = MOPPO(ThreeWays(), PPOConfig(environments=2, rollout_steps=50, minibatches=1))
    train_state = moppo.initial_train_state(jax.random.key(0))
    _, trajectory, statistics = moppo.collect(
        train_state, moppo.initial_rollout_state(jax.random.key(1)), jax.random.key(2)
    )
    batch = moppo.batch(train_state, trajectory, jnp.sqrt(statistics.variance), jnp.ones(3) / 3)
    assert (jnp.abs(trajectory.action) > 1).any()
    mean, log_std = jax.vmap(jax.vmap(moppo.policy(train_state)), in_axes=0)(trajectory.observation)
    z = (trajectory.action - mean) / jnp.exp(log_std)
    expected = (-0.5 * z**2 - log_std - 0.5 * jnp.log(2 * jnp.pi)).sum(-1).reshape(-1)
    np.testing.assert_allclose(batch.log_probability, expected, rtol=1e-5, atol=1e-5)


def test_weights_on_raw_objectives_are_weights_on_scaled_ones_times_the_scale():
    scale, weights = jnp.array([1.0, 4.0, 0.5]), jnp.array([0.2, 0.3, 0.5])
    raw = MOPPO(ThreeWays(), PPOConfig(environments=2, rollout_steps=20, minibatches=1, weights_on="raw"))
    scaled = MOPPO(ThreeWays(), PPOConfig(environments=2, rollout_steps=20, minibatches=1, weights_on="scaled"))
    train_state = raw.initial_train_state(jax.random.key(0))
    _, trajectory, _ = raw.collect(train_state, raw.initial_rollout_state(jax.random.key(1)), jax.random.key(2))
    np.testing.assert_allclose(
        raw.batch(train_state, trajectory, scale, weights).advantage,
        scaled.batch(train_state, trajectory, scale, weights * scale).advantage,
        rtol=1e-5,
        atol=1e-6,
    )


def test_a_truncated_step_is_bootstrapped_from_where_its_episode_ended():
    """And not from where the next one begins, which the rollout goes on from."""
    config = PPOConfig(environments=2, rollout_steps=25, minibatches=1, gae_lambda=0.0, weights_on="scaled")
    moppo = MOPPO(Onwards(), config)

    @jax.jit
    def one_batch(key):
        train_state = moppo.initial_train_state(key)
        _, trajectory, _ = moppo.collect(train_state, moppo.initial_rollout_state(key), key)
        batch = moppo.batch(train_state, trajectory, jnp.ones(2), jnp.array([1.0, 0.0]))
        return trajectory, batch.advantage[:25], scaled_values(moppo, train_state, jnp.arange(11.0))[:, 0]

    trajectory, advantage, value = one_batch(jax.random.key(0))
    steps = np.arange(25) % 10
    np.testing.assert_array_equal(trajectory.observation[..., 0], np.tile(steps, (2, 1)))
    np.testing.assert_array_equal(trajectory.truncated, np.tile(steps == 9, (2, 1)))
    np.testing.assert_allclose(advantage, 1.0 + config.discount * value[steps + 1] - value[steps], rtol=1e-5)
    assert abs(value[10] - value[0]) > 0.01


def test_the_critic_learns_one_value_for_each_objective():
    moppo, train_state = learned(OneStep())
    np.testing.assert_allclose(values(moppo, train_state, [0.0])[0], [1.0, -2.0], rtol=0.05)


def test_a_later_reward_is_discounted():
    moppo, train_state = learned(TwoSteps())
    np.testing.assert_allclose(values(moppo, train_state, [0.0])[0], [0.9, -1.8], rtol=0.05)
    np.testing.assert_allclose(values(moppo, train_state, [1.0])[0], [1.0, -2.0], rtol=0.05)


def test_a_time_limit_is_not_an_end():
    """Bootstrapped across the limit the value is 1 / (1 - 0.9) = 10; treated as an end it would be below 7."""
    moppo, train_state = learned(Endless(), iterations=150)
    np.testing.assert_allclose(values(moppo, train_state, [0.0])[0], [10.0, -20.0], rtol=0.1)


@pytest.mark.parametrize(("weights", "action"), [((1.0, 0.0), -0.8), ((0.25, 0.75), 0.4), ((0.0, 1.0), 0.8)])
def test_the_weights_decide_what_is_learned(weights, action):
    moppo, train_state = learned(Compromise(), weights, weights_on="raw", initial_log_std=-1.0)
    mean, _ = moppo.policy(train_state)(jnp.zeros(1))
    np.testing.assert_allclose(mean, [action], atol=0.1)


def test_the_policy_depends_on_the_observation():
    moppo, train_state = learned(Follow(), initial_log_std=-1.0, iterations=60)
    observations = jnp.linspace(-0.9, 0.9, 7)[:, None]
    mean, _ = jax.vmap(moppo.policy(train_state))(observations)
    np.testing.assert_allclose(mean, observations, atol=0.2)


@pytest.mark.parametrize(("low", "high"), [(-1, 1), (5, 35), (0, 1), (0, 1000), (-0.001, 0.001)])
def test_a_policy_finds_its_place_in_whatever_box(low, high):
    environment = Share(low, high)
    moppo, train_state = learned(environment, initial_log_std=-1.0)
    mean, _ = moppo.policy(train_state)(jnp.zeros(1))
    assert mean[0] == pytest.approx(0.5, abs=0.1)  # normalised
    assert environment.share(environment.action_box.action(mean)) == pytest.approx(0.75, abs=0.05)
    returns = moppo.evaluate(train_state, jax.random.split(jax.random.key(0), 2))
    np.testing.assert_allclose(returns.undiscounted[:, 0], 0, atol=0.05**2)


def test_rollouts_keep_the_normalised_action_and_give_the_environment_its_own():
    environment, config = Share(5, 35), PPOConfig(environments=2, rollout_steps=50, minibatches=1)
    moppo = MOPPO(environment, config)
    train_state = moppo.initial_train_state(jax.random.key(0))
    rollout_state = moppo.initial_rollout_state(jax.random.key(1))
    _, trajectory, _ = moppo.collect(train_state, rollout_state, jax.random.key(2))
    assert jnp.abs(trajectory.action).max() > 1.5  # as sampled, beyond the box
    share = jnp.clip(trajectory.action[..., 0], -1, 1) / 2 + 0.5
    np.testing.assert_allclose(trajectory.reward[..., 0], -((share - 0.75) ** 2), atol=1e-6)


def test_the_bound_loss_is_the_squared_distance_from_the_box():
    means = jnp.array([[0.5, -1.0], [3.0, -2.5], [1.0, 4.0]])
    assert action_bound_loss(means, -1.0, 2.0) == pytest.approx((0 + (1 + 1.5**2) + 2**2) / 3)
    low, high = np.array([-1, -np.inf]), np.array([1, np.inf])
    assert action_bound_loss(means, low, high) == pytest.approx((0 + 2**2 + 0) / 3)


@pytest.mark.parametrize("environment", [Clipped(), Share(5, 35)], ids=["clipped", "scaled"])
@pytest.mark.parametrize(("coefficient", "returns"), [(0.0, False), (1.0, True)])
def test_only_the_bound_loss_brings_back_a_mean_far_outside_the_box(environment, coefficient, returns):
    moppo = MOPPO(environment, PPOConfig(**QUICK, initial_log_std=-1.0, action_bound_coefficient=coefficient))
    train_state = moppo.initial_train_state(jax.random.key(0))
    train_state.parameters["actor"]["params"]["MLP_0"]["Dense_2"]["bias"] += 3.0
    schedule = Schedule(40, moppo.config.learning_rate)
    train_state, _ = jax.jit(moppo.train)(train_state, jnp.array([0.5, 0.5]), jax.random.key(1), schedule)
    mean, _ = moppo.policy(train_state)(jnp.zeros(1))
    # Where in the box it comes to lie differs from processor to processor: learning enlarges the last bits.
    assert (abs(mean[0]) < 1.2) if returns else (mean[0] > 1.5)


def test_evaluation_counts_an_episode_once_to_its_end():
    moppo, train_state = learned(TwoSteps(), iterations=1)
    returns = moppo.evaluate(train_state, jax.random.split(jax.random.key(0), 3))
    np.testing.assert_array_equal(returns.undiscounted, np.tile([1.0, -2.0], (3, 1)))
    np.testing.assert_allclose(returns.discounted, np.tile([0.9, -1.8], (3, 1)), rtol=1e-6)
    np.testing.assert_array_equal(returns.length, [2, 2, 2])
    endless = MOPPO(Endless(), PPOConfig(**QUICK)).evaluate(train_state, jax.random.split(jax.random.key(0), 3))
    np.testing.assert_array_equal(endless.length, [10, 10, 10])


@pytest.mark.parametrize("sampled", [False, True])
@pytest.mark.parametrize("limit", [1, 3, 64, 65, 150])
def test_evaluation_to_the_end_is_that_of_every_step_up_to_the_limit(limit, sampled):
    """Episodes end after 1 to 200 steps, or at the limit, which the chunks of an evaluation do not divide."""
    moppo = MOPPO(Ending(limit, 200), PPOConfig(**QUICK))
    train_state, keys = moppo.initial_train_state(jax.random.key(0)), jax.random.split(jax.random.key(1), 16)
    stopping, whole = (
        jax.jit(lambda train_state, keys, traced=traced: moppo.evaluate(train_state, keys, sampled, traced))(
            train_state, keys
        )
        for traced in (False, True)
    )
    starts = jax.vmap(moppo.environment.initial_state)(jax.vmap(_start_key)(keys) if sampled else keys)
    np.testing.assert_array_equal(stopping.length, np.minimum(starts[:, 1], limit))
    np.testing.assert_array_equal(whole.length, stopping.length)
    np.testing.assert_allclose(stopping.undiscounted, whole.undiscounted, rtol=1e-6)
    np.testing.assert_allclose(stopping.discounted, whole.discounted, rtol=1e-6)
    np.testing.assert_allclose(whole.trace.rewards.sum(1), whole.undiscounted, rtol=1e-5, atol=1e-4)


def _start_key(key):
    return jax.random.split(key)[0]


def test_evaluation_does_not_wait_for_a_limit_that_no_episode_reaches():
    moppo = MOPPO(Ending(2**31 - 1, 40), PPOConfig(**QUICK))
    returns = moppo.evaluate(moppo.initial_train_state(jax.random.key(0)), jax.random.split(jax.random.key(1), 8))
    assert 1 <= returns.length.min() < returns.length.max() <= 40

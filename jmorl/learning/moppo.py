"""Multi-objective PPO for one agent: collect, estimate advantages per objective, update.

No population axis here; `jmorl.learning.population` vmaps. PPO after Schulman et al. 2017, its multi-objective
form after Xu et al. 2020 (PGMORL).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import chex
import jax
import jax.numpy as jnp
import optax
from flax import struct

from envs.core import Environment, EpisodeState, Objective
from jmorl.learning.losses import action_bound_loss, clipped_surrogate_loss, clipped_value_loss, normalize_advantages
from jmorl.learning.networks import Actor, critic_network, gaussian_entropy, gaussian_log_probability
from jmorl.learning.returns import discounted_sums, generalized_advantages
from jmorl.learning.rollout import EpisodeReturns, Trajectory, episode_returns, rollout
from jmorl.learning.settings import PPOConfig
from jmorl.learning.statistics import (
    RunningStatistics,
    initial_statistics,
    normalize,
    return_scale,
    update_statistics,
)

Parameters = Any  # {"actor": ..., "critic": ...}, pytrees of flax.linen


@struct.dataclass
class TrainState:
    """All that an offspring inherits and that is stored with a policy."""

    parameters: Parameters
    optimizer_state: optax.OptState
    observation_statistics: RunningStatistics  # [O]
    return_statistics: RunningStatistics  # [M] of the discounted reward sums; their deviation scales rewards


@struct.dataclass
class RolloutState:
    """The environments of one agent, between two rollouts."""

    states: EpisodeState[Any]  # [E]
    observations: jax.Array  # [E, O]
    discounted_sums: jax.Array  # [E, M]


class Batch(NamedTuple):
    """What one update learns from; minibatches are slices of its leading axis."""

    observation: jax.Array  # [B, O] normalised
    action: jax.Array  # [B, A] normalised
    log_probability: jax.Array  # [B]
    value: jax.Array  # [B, M] in reward-scaled units
    advantage: jax.Array  # [B] scalarised
    returns: jax.Array  # [B, M] in reward-scaled units


class Schedule(NamedTuple):
    """What changes between the calls of `train`: data, so that all share one compilation."""

    iterations: jax.typing.ArrayLike  # [] int32
    learning_rate: jax.typing.ArrayLike  # [] float32


class Diagnostics(NamedTuple):
    """Of one iteration: means over the last epoch's minibatches, and where numbers stopped being finite."""

    policy_loss: jax.Array  # []
    value_loss: jax.Array  # []
    entropy: jax.Array  # []
    approximate_kl: jax.Array  # [] between the policy that acted and the updated one
    fault: jax.Array  # [] int32 index into FAULTS
    fault_component: jax.Array  # [] int32, the first of the observation or reward; meaningless of other faults
    fault_iteration: jax.Array  # [] int32, from 1; meaningless without a fault

    @classmethod
    def names(cls) -> list[str]:
        """Return the names of the numbers that have a mean."""
        return [name for name in cls._fields if not name.startswith("fault")]

    def means(self) -> dict[str, float]:
        """Return the numbers of a population [P], averaged over its agents."""
        return {name: float(getattr(self, name).mean()) for name in self.names()}

    def cause(self, agent: int, objectives: Sequence[Objective]) -> str:
        """Name the number that stopped being finite for an agent: `observation[3]`, `reward of energy`, or `loss`."""
        fault, component = FAULTS[self.fault[agent]], int(self.fault_component[agent])
        match fault:
            case "observation":
                return f"observation[{component}]"
            case "reward":
                return f"reward of {objectives[component].name}"
        return fault


FAULTS = ("none", "observation", "reward", "loss")


@dataclass(frozen=True, eq=False)
class MOPPO:
    """The algorithm for one environment and one setting; its methods are pure functions."""

    environment: Environment[Any]
    config: PPOConfig

    @cached_property
    def actor(self) -> Any:  # Actor; flax types what `apply` returns too widely
        """The network of the policy."""
        return Actor(self.config.hidden_sizes, self.environment.action_size, self.config.initial_log_std)

    @cached_property
    def critic(self) -> Any:
        """The network of the values."""
        return critic_network(self.config.hidden_sizes, len(self.environment.objectives))

    @cached_property
    def optimizer(self) -> optax.GradientTransformation:
        """Clipping and Adam, but for the learning rate, which is data.

        Flattened: one vector operation instead of one for each of a dozen small arrays.
        """
        clip = optax.clip_by_global_norm(self.config.max_gradient_norm)
        return optax.flatten(optax.chain(clip, optax.scale_by_adam(eps=self.config.adam_epsilon)))

    def initial_train_state(self, key: jax.Array) -> TrainState:
        """Return a new agent's networks, optimiser and statistics."""
        actor_key, critic_key = jax.random.split(key)
        observation = jnp.zeros(self.environment.observation_size)
        parameters = {
            "actor": self.actor.init(actor_key, observation),
            "critic": self.critic.init(critic_key, observation),
        }
        return TrainState(
            parameters,
            self.optimizer.init(parameters),
            initial_statistics((self.environment.observation_size,)),
            initial_statistics((len(self.environment.objectives),)),
        )

    def train(
        self, train_state: TrainState, weights: jax.Array, key: jax.Array, schedule: Schedule
    ) -> tuple[TrainState, Diagnostics]:
        """PPO iterations with `weights` [M], from freshly reset environments.

        Rollouts continue from one iteration to the next.
        """
        rollout_state_key, iterations_key = jax.random.split(key)
        zero = jnp.zeros(())
        start = Diagnostics(zero, zero, zero, zero, jnp.array(0), jnp.array(0), jnp.array(0))

        def body(index: jax.Array, carry: Any) -> Any:
            train_state, rollout_state, previous = carry
            iteration_key = jax.random.fold_in(iterations_key, index)
            train_state, rollout_state, diagnostics = self.iteration(
                train_state, rollout_state, weights, iteration_key, schedule.learning_rate
            )
            return train_state, rollout_state, _keep_first_fault(previous, diagnostics, index + 1)

        train_state, _, diagnostics = jax.lax.fori_loop(
            0, schedule.iterations, body, (train_state, self.initial_rollout_state(rollout_state_key), start)
        )
        return train_state, diagnostics

    def initial_rollout_state(self, key: jax.Array) -> RolloutState:
        """E environments at the start of an episode."""
        states, observations = jax.vmap(self.environment.reset)(jax.random.split(key, self.config.environments))
        sums = jnp.zeros((self.config.environments, len(self.environment.objectives)))
        return RolloutState(states, observations, sums)

    def iteration(
        self,
        train_state: TrainState,
        rollout_state: RolloutState,
        weights: jax.Array,
        key: jax.Array,
        learning_rate: jax.typing.ArrayLike,
    ) -> tuple[TrainState, RolloutState, Diagnostics]:
        """Collect E*T steps, then update on them."""
        rollout_key, update_key = jax.random.split(key)
        rollout_state, trajectory, return_statistics = self.collect(train_state, rollout_state, rollout_key)
        batch = self.batch(train_state, trajectory, return_scale(return_statistics), weights)
        parameters, optimizer_state, diagnostics = self.update(train_state, batch, update_key, learning_rate)
        updated = TrainState(
            parameters,
            optimizer_state,
            update_statistics(train_state.observation_statistics, trajectory.observation),
            return_statistics,
        )
        fault, component = _fault(trajectory, parameters, diagnostics)
        return updated, rollout_state, diagnostics._replace(fault=fault, fault_component=component)

    def collect(
        self, train_state: TrainState, rollout_state: RolloutState, key: jax.Array
    ) -> tuple[RolloutState, Trajectory, RunningStatistics]:
        """T steps in every environment: where to continue, the trajectories [E, T, ...], the updated reward scale."""
        policy = self.policy(train_state)
        keys = jax.random.split(key, self.config.environments)
        (states, observations), trajectory = jax.vmap(
            lambda key, state, observation: rollout(
                self.environment,
                policy,
                key,
                (state, observation),
                self.config.rollout_steps,
                self.config.noise_correlation,
            )
        )(keys, rollout_state.states, rollout_state.observations)
        ended = trajectory.terminated | trajectory.truncated
        sums, carried = jax.vmap(discounted_sums, in_axes=(0, 0, 0, None))(
            trajectory.reward, ended, rollout_state.discounted_sums, self.config.discount
        )
        statistics = update_statistics(train_state.return_statistics, sums)
        return RolloutState(states, observations, carried), trajectory, statistics

    def batch(
        self, train_state: TrainState, trajectory: Trajectory, reward_scale: jax.Array, weights: jax.Array
    ) -> Batch:
        """Trajectories [E, T, ...] to what PPO learns from [E*T, ...], with advantages scalarised by `weights`.

        Values are learned in reward-scaled units whatever the weights act on: only then does one learning rate
        suit every objective. The statistics are those the policy acted with.
        """
        observation = normalize(train_state.observation_statistics, trajectory.observation)
        mean, log_std = self.actor.apply(train_state.parameters["actor"], observation)
        value = self.critic.apply(train_state.parameters["critic"], observation)
        final_observation = normalize(train_state.observation_statistics, trajectory.final_observation)
        final_value = self.critic.apply(train_state.parameters["critic"], final_observation)
        advantage = jax.vmap(generalized_advantages, in_axes=(0, 0, 0, 0, 0, None, None))(
            trajectory.reward / jax.lax.broadcast_to_rank(reward_scale, trajectory.reward.ndim),
            value,
            final_value,
            trajectory.terminated,
            trajectory.truncated,
            self.config.discount,
            self.config.gae_lambda,
        )
        chex.assert_equal_shape([value, final_value, advantage, trajectory.reward])
        objective_weights = weights * reward_scale if self.config.weights_on == "raw" else weights
        batch = Batch(
            observation,
            trajectory.action,
            gaussian_log_probability(mean, log_std, trajectory.action),
            value,
            advantage @ objective_weights,
            advantage + value,
        )
        return jax.tree.map(lambda x: x.reshape(-1, *x.shape[2:]), batch)

    def update(
        self, train_state: TrainState, batch: Batch, key: jax.Array, learning_rate: jax.typing.ArrayLike
    ) -> tuple[Parameters, optax.OptState, Diagnostics]:
        """`epochs` passes over the batch, each in a new order and `minibatches` steps of the optimiser."""
        size = batch.advantage.shape[0]

        def epoch(carry: Any, epoch_key: jax.Array) -> Any:
            order = _random_order(epoch_key, size).reshape(self.config.minibatches, -1)
            return jax.lax.scan(minibatch, carry, order)

        def minibatch(carry: Any, indices: jax.Array) -> Any:
            return self.gradient_step(carry, jax.tree.map(lambda x: x[indices], batch), learning_rate)

        epoch_keys = jax.random.split(key, self.config.epochs)
        carry, diagnostics = jax.lax.scan(epoch, (train_state.parameters, train_state.optimizer_state), epoch_keys)
        return *carry, jax.tree.map(lambda x: x[-1].mean(0), diagnostics)

    def gradient_step(
        self, carry: tuple[Parameters, optax.OptState], minibatch: Batch, learning_rate: jax.typing.ArrayLike
    ) -> tuple[tuple[Parameters, optax.OptState], Diagnostics]:
        """One step of the optimiser down the loss of a minibatch."""
        parameters, optimizer_state = carry
        gradients, diagnostics = jax.grad(self.loss, has_aux=True)(parameters, minibatch)
        with jax.numpy_dtype_promotion("standard"):  # which Optax relies on
            directions, optimizer_state = self.optimizer.update(gradients, optimizer_state, parameters)
        parameters = jax.tree.map(lambda x, direction: x - learning_rate * direction, parameters, directions)
        return (parameters, optimizer_state), diagnostics

    def loss(self, parameters: Parameters, batch: Batch) -> tuple[jax.Array, Diagnostics]:
        """Return the PPO loss of one minibatch, and its parts."""
        mean, log_std = self.actor.apply(parameters["actor"], batch.observation)
        values = self.critic.apply(parameters["critic"], batch.observation)
        log_probability = gaussian_log_probability(mean, log_std, batch.action)
        policy_loss = clipped_surrogate_loss(
            log_probability, batch.log_probability, normalize_advantages(batch.advantage), self.config.clip
        )
        value_loss = clipped_value_loss(values, batch.value, batch.returns, self.config.clip)
        entropy = gaussian_entropy(log_std)
        bound_loss = action_bound_loss(mean, *self.environment.action_box.normalized_bounds)
        loss = (
            policy_loss
            + self.config.value_coefficient * value_loss
            + self.config.action_bound_coefficient * bound_loss
            - self.config.entropy_coefficient * entropy
        )
        kl = (batch.log_probability - log_probability).mean()
        return loss, Diagnostics(policy_loss, value_loss, entropy, kl, jnp.array(0), jnp.array(0), jnp.array(0))

    def policy(self, train_state: TrainState) -> Any:
        """Return the agent as a function of one raw observation [O]: mean and log-std [A] of the normalised action."""
        return lambda observation: self.actor.apply(
            train_state.parameters["actor"], normalize(train_state.observation_statistics, observation)
        )

    def evaluate(
        self, train_state: TrainState, keys: jax.Array, sampled: bool = False, traced: bool = False
    ) -> EpisodeReturns:
        """One episode for each key [episodes], as `episode_returns`, with the agent's frozen statistics."""
        policy, box = self.policy(train_state), self.environment.action_box

        def act(observation: jax.Array, noise: jax.Array | None) -> jax.Array:
            mean, log_std = policy(observation)
            return box.action(mean if noise is None else mean + jnp.exp(log_std) * noise)

        def episode(key: jax.Array) -> EpisodeReturns:
            return episode_returns(self.environment, act, key, self.config.discount, sampled, traced)

        return jax.vmap(episode)(keys)


def _random_order(key: jax.Array, size: int) -> jax.Array:
    """Return the indices below `size` in random order [size].

    Sorts words whose high bits are random and whose low bits are the index: nearly ten times as fast on a CPU as
    `jax.random.permutation`, which takes a fifth of a training iteration. Indices that draw equal high bits stay
    neighbours in order, which does not matter to minibatches.
    """
    index_bits = max(size - 1, 1).bit_length()
    random_bits = jax.random.bits(key, (size,)) >> index_bits << index_bits
    words = jnp.sort(random_bits | jnp.arange(size, dtype=jnp.uint32))
    return (words & ((1 << index_bits) - 1)).astype(jnp.int32)


def _fault(
    trajectory: Trajectory,  # [E, T, ...]
    parameters: Parameters,
    diagnostics: Diagnostics,
) -> tuple[jax.Array, jax.Array]:
    """Return the first cause, in the order in which one would bring about the next, of numbers that are not finite.

    With it comes the first component in which it is found, in the first step in which it is: an action that follows
    from it breaks the others.
    """

    def broken(*numbers: jax.Array) -> jax.Array:  # [E, T, N] each -> [N]
        steps = jnp.stack([~jnp.isfinite(each).all(0) for each in numbers]).any(0)  # [T, N]
        return steps[steps.any(1).argmax()]

    observation = broken(trajectory.observation, trajectory.final_observation)
    reward = broken(trajectory.reward)
    losses = (parameters, diagnostics.policy_loss, diagnostics.value_loss)
    loss = jnp.stack([~jnp.isfinite(leaf).all() for leaf in jax.tree.leaves(losses)])
    faults = jnp.stack([observation.any(), reward.any(), loss.any()])
    fault = jnp.where(faults.any(), 1 + faults.argmax(), 0)
    return fault, jnp.where(observation.any(), observation.argmax(), reward.argmax())


def _keep_first_fault(previous: Diagnostics, current: Diagnostics, iteration: jax.Array) -> Diagnostics:
    """Once a fault is recorded it stays: later iterations only compute with its consequences."""
    faulty = previous.fault > 0
    return current._replace(
        fault=jnp.where(faulty, previous.fault, current.fault),
        fault_component=jnp.where(faulty, previous.fault_component, current.fault_component),
        fault_iteration=jnp.where(faulty, previous.fault_iteration, iteration),
    )

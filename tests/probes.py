"""Probe environments: each so small that what must be learned is known, and able to fail for one reason."""

from typing import ClassVar

import jax
import jax.numpy as jnp

from envs.core import Environment, Objective, Transition


def objectives(*names):
    return tuple(Objective(name, name, "units") for name in names)


class Probe(Environment):
    """One observation, one action, two objectives; the state is the number of steps. Subclasses say the rest."""

    objectives: ClassVar = objectives("left", "right")
    observation_size = 1
    action_size = 1
    time_limit = 10
    id = "probe"

    def initial_state(self, key):
        return jnp.zeros(())

    def observe(self, state):
        return state[None]

    def reward(self, state, action):
        return jnp.array([1.0, -2.0])

    def transition(self, state, action):
        after = state + 1
        return Transition(after, self.reward(state, action), self.ends(after))

    def ends(self, state):
        return jnp.array(True)


class OneStep(Probe):
    """A constant reward, then the end: can the critic learn a value for each objective?"""


class TwoSteps(Probe):
    """The reward comes with the second step: is it discounted back to the first?"""

    def reward(self, state, action):
        return jnp.where(state == 1, 1.0, 0.0) * jnp.array([1.0, -2.0])

    def ends(self, state):
        return state >= 2


class Endless(Probe):
    """A constant reward until the time limit, always the same observation: does truncation bootstrap?"""

    def observe(self, state):
        return jnp.zeros(1)

    def ends(self, state):
        return jnp.array(False)


class Onwards(Probe):
    """The number of steps as observation, until the time limit: what follows the last step is not where one begins."""

    def ends(self, state):
        return jnp.array(False)


class Compromise(Probe):
    """Objectives that want the action at -0.8 and at 0.8: do the weights decide what is learned?"""

    def reward(self, state, action):
        return -jnp.stack([(action[0] + 0.8) ** 2, (action[0] - 0.8) ** 2])


class Clipped(Probe):
    """The action should be 0.5, but is clipped first: beyond the box all actions are equally bad."""

    def reward(self, state, action):
        return -jnp.full(2, (jnp.clip(action[0], -1.0, 1.0) - 0.5) ** 2)


class Share(Probe):
    """The action should be at three quarters of its box, whose bounds are options: does a policy know its units?"""

    id = "probe-share"

    def __init__(self, low="-1", high="1"):
        self.action_low, self.action_high = float(low), float(high)

    def share(self, action):
        return (action[0] - self.action_low) / (self.action_high - self.action_low)

    def reward(self, state, action):
        return jnp.stack([-((self.share(action) - 0.75) ** 2), -0.1 * jnp.abs(self.share(action) - 0.75)])


class Follow(Probe):
    """The action should equal the observation, drawn anew in each episode: does the policy look?"""

    def initial_state(self, key):
        return jax.random.uniform(key, (), minval=-1.0, maxval=1.0)

    def reward(self, state, action):
        return -jnp.full(2, (action[0] - state) ** 2)


class ThreeWays(Probe):
    """Three objectives, two actions, ten steps: each objective pulls towards a corner of a triangle."""

    id = "probe-three-ways"
    objectives: ClassVar = objectives("north", "east", "west")
    observation_size = 2
    action_size = 2
    corners: ClassVar = ((0.0, 1.0), (0.9, -0.5), (-0.9, -0.5))

    def initial_state(self, key):
        return jax.random.uniform(key, (2,), minval=-0.2, maxval=0.2)

    def observe(self, state):
        return state

    def transition(self, state, action):
        after = state + 0.3 * jnp.clip(action, -1.0, 1.0)
        distances = jnp.linalg.norm(jnp.array(self.corners) - after[None], axis=1)
        return Transition(after, -distances, jnp.array(False))


class UnevenBox(ThreeWays):
    """A component that is far from -1..1, and one that is open on a side."""

    id = "probe-uneven-box"
    action_low: ClassVar = (5.0, -0.5)
    action_high: ClassVar = (35.0, float("inf"))

    def transition(self, state, action):
        return super().transition(state, (action - jnp.array([20.0, 0.0])) / jnp.array([15.0, 1.0]))


class Ending(Probe):
    """Ends by itself after a number of steps that is drawn at the start, or at a limit that may be far away."""

    id = "probe-ending"

    def __init__(self, limit="10", most="40"):
        self.time_limit, self.most = int(limit), int(most)

    def initial_state(self, key):
        return jnp.stack([jnp.zeros((), jnp.int32), jax.random.randint(key, (), 1, self.most + 1)])

    def observe(self, state):
        return state[:1] / self.most

    def transition(self, state, action):
        after = state + jnp.array([1, 0])
        return Transition(after, jnp.stack([action[0], 1.0 + 0.1 * action[0]]), after[0] >= after[1])


class Faulty(ThreeWays):
    """Breaks in one component, or in all, in the step in which an episode passes `breaks_at`."""

    def __init__(self, where, breaks_at=5, value=jnp.nan, component=slice(None)):
        self.where, self.breaks_at, self.value, self.component = where, breaks_at, value, component

    def initial_state(self, key):
        return jnp.concatenate([super().initial_state(key), jnp.zeros(1)])

    def observe(self, state):
        broken = (state[2] >= self.breaks_at) & (self.where == "observation")
        return jnp.where(broken, state[:2].at[self.component].set(self.value), state[:2])

    def transition(self, state, action):
        result = super().transition(state[:2], action)
        steps = state[2] + 1
        broken = (steps >= self.breaks_at) & (self.where == "reward")
        reward = jnp.where(broken, result.reward.at[self.component].set(self.value), result.reward)
        return Transition(jnp.concatenate([result.state, steps[None]]), reward, result.terminated)


class FaultyLater(Compromise):
    """Breaks in the seventh step of an episode. An action that is repeated ends one: no evaluation goes so far."""

    id = "probe-faulty-later"

    def initial_state(self, key):
        return jnp.array([0.0, jnp.inf])  # steps, and the last action

    def observe(self, state):
        return jnp.zeros(1)

    def transition(self, state, action):
        steps = state[0] + 1
        reward = jnp.where(steps >= 7, jnp.nan, self.reward(state, action))
        return Transition(jnp.stack([steps, action[0]]), reward, action[0] == state[1])

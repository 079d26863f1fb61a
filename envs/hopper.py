"""`mo-hopper-v5` and `mo-hopper-2obj-v5`: hop fast, and high, on little torque, and do not fall.

Gymnasium's Hopper-v5 with MO-Gymnasium's vector rewards.
"""

from typing import ClassVar

import jax
import jax.numpy as jnp

from envs.core import Objective, Transition
from envs.drawing import Part
from envs.physics import BodyState
from envs.runner import Runner, near_rest, seen

FRAME_SKIP = 4
TIMESTEP = 0.002  # seconds, of the model
STANDING = (0.0, 1.25, 0.0, 0.0, 0.0, 0.0)  # qpos: x, z and angle of the torso, then three joints
RESET_NOISE = 5e-3
LOWEST = 0.7  # metres, of the torso of one that is healthy
STEEPEST = 0.2  # radians
FARTHEST = 100.0  # any angle or velocity, SI units
HEIGHT_WEIGHT = 10.0
ENERGY_WEIGHT = 1e-3  # where energy is no objective of its own


class Hopper(Runner):
    """A one-legged hopper in the vertical plane. Reward: forward speed; ten times the torso's height above standing.

    The third objective is minus the sum of the squared controls. All have one added while it is healthy: neither low,
    nor steep, nor out of bounds. The episode ends when it is not.
    """

    id = "mo-hopper-v5"
    objectives: ClassVar[tuple[Objective, ...]] = (
        Objective("speed", "speed", "(m/s + 1)·steps"),
        Objective("height", "height", "(10 m + 1)·steps"),
        Objective("energy", "energy", "(1 - control²)·steps", highest=1000.0),
    )
    observation_size = 2 * len(STANDING) - 1
    action_size = 3
    time_limit = 1000
    step_seconds = FRAME_SKIP * TIMESTEP
    model_name = "hopper"
    frame_skip = FRAME_SKIP
    view = (1.6, 0.25, 2.2)

    def initial_state(self, key: jax.Array) -> BodyState:
        """Return a state drawn from the start distribution."""
        return near_rest(key, STANDING, RESET_NOISE)

    def observe(self, state: BodyState) -> jax.Array:
        """Return what the agent sees of a state."""
        return seen(state)

    def transition(self, state: BodyState, action: jax.Array) -> Transition:
        """Apply the dynamics to a state and an action [A]."""
        state, speed, control = self.moved(state, action)
        z, angle = state.qpos[1], state.qpos[2]
        bounded = (jnp.abs(state.qpos[2:]) < FARTHEST).all() & (jnp.abs(state.qvel) < FARTHEST).all()
        healthy = (z > LOWEST) & (jnp.abs(angle) < STEEPEST) & bounded
        height = HEIGHT_WEIGHT * (z - STANDING[1])
        reward = self.reward(speed, height, control) + healthy.astype(speed.dtype)
        return Transition(state, reward, ~healthy)

    def reward(self, speed: jax.Array, height: jax.Array, control: jax.Array) -> jax.Array:
        """Return the reward [M], without what it gets for being healthy."""
        return jnp.stack([speed, height, -jnp.sum(control**2)])

    def part(self, geom: str) -> Part:
        """Return which part of the hopper a capsule of the model belongs to, by its name."""
        if geom == "torso_geom":
            return "body"
        return "fore" if geom == "foot_geom" else "hind"


class Hopper2(Hopper):
    """The same with two objectives: a thousandth of the squared controls is taken from each."""

    id = "mo-hopper-2obj-v5"
    objectives: ClassVar = (
        Objective("speed", "speed", "(m/s + 1 - control²/1000)·steps"),
        Objective("height", "height", "(10 m + 1 - control²/1000)·steps"),
    )

    def reward(self, speed: jax.Array, height: jax.Array, control: jax.Array) -> jax.Array:
        """Return the reward [2], without what it gets for being healthy."""
        return jnp.stack([speed, height]) - ENERGY_WEIGHT * jnp.sum(control**2)

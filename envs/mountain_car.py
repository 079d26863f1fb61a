"""`mo-mountaincarcontinuous-v0`: reach the flag fast, on little fuel.

Dynamics of Gymnasium's MountainCarContinuous-v0 with MO-Gymnasium's vector reward. Position is
about [-1.2, 0.6] along the x axis, velocity in position units per step, clipped to ±0.07.
"""

from typing import ClassVar

import jax
import jax.numpy as jnp
from flax import struct

from envs.core import Environment, Objective, Transition

POWER = 0.0015
GRAVITY = 0.0025
MAX_SPEED = 0.07
LEFT_WALL, RIGHT_WALL = -1.2, 0.6
GOAL_POSITION = 0.45


@struct.dataclass
class CarState:
    position: jax.Array  # []
    velocity: jax.Array  # [] position units per step


class MountainCar(Environment[CarState]):
    """A car too weak for the hill. Reward: -1 a step until the flag; minus the squared force."""

    id = "mo-mountaincarcontinuous-v0"
    objectives: ClassVar = (Objective("time", "time", "-steps"), Objective("fuel", "fuel", "-force²·steps"))
    observation_size = 2
    action_size = 1
    time_limit = 999

    def initial_state(self, key: jax.Array) -> CarState:
        return CarState(jax.random.uniform(key, (), minval=-0.6, maxval=-0.4), jnp.zeros(()))

    def observe(self, state: CarState) -> jax.Array:
        return jnp.stack([state.position, state.velocity])

    def transition(self, state: CarState, action: jax.Array) -> Transition:
        force = jnp.clip(action[0], -1.0, 1.0)
        velocity = state.velocity + POWER * force - GRAVITY * jnp.cos(3 * state.position)
        velocity = jnp.clip(velocity, -MAX_SPEED, MAX_SPEED)
        position = jnp.clip(state.position + velocity, LEFT_WALL, RIGHT_WALL)
        # The left wall is inelastic; the right end of the track lies behind the flag.
        velocity = jnp.where((position == LEFT_WALL) & (velocity < 0), 0.0, velocity)
        terminated = (position >= GOAL_POSITION) & (velocity >= 0)
        reward = jnp.stack([jnp.where(terminated, 0.0, -1.0), -(force**2)])
        return Transition(CarState(position, velocity), reward, terminated)

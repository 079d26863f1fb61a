"""`mo-mountaincarcontinuous-v0`: reach the flag fast, on little fuel.

Dynamics of Gymnasium's MountainCarContinuous-v0 with MO-Gymnasium's vector reward. Position is
about [-1.2, 0.6] along the x axis, velocity in position units per step, clipped to ±0.07.
"""

from typing import ClassVar

import jax
import jax.numpy as jnp
import numpy as np
from flax import struct

from envs.core import Environment, Objective, Reading, Transition
from envs.drawing import Disk, Point, Polygon, Polyline, Scene, Shape, Window

POWER = 0.0015
GRAVITY = 0.0025
MAX_SPEED = 0.07
LEFT_WALL, RIGHT_WALL = -1.2, 0.6
GOAL_POSITION = 0.45
VALLEY = Window((-1.3, 0.7), (0.0, 1.25))


@struct.dataclass
class CarState:
    """The car's place and speed."""

    position: jax.Array  # []
    velocity: jax.Array  # [] position units per step


class MountainCar(Environment[CarState]):
    """A car too weak for the hill. Reward: -1 a step until the flag; minus the squared force."""

    id = "mo-mountaincarcontinuous-v0"
    family = "MO-Gymnasium"
    objectives: ClassVar = (
        Objective("time", "time", "-steps", highest=0.0, reading=Reading("steps", less_is_better=True)),
        Objective("fuel", "fuel", "-force²·steps", highest=0.0, reading=Reading("force²·steps", less_is_better=True)),
    )
    observation_size = 2
    action_size = 1
    time_limit = 999

    def initial_state(self, key: jax.Array) -> CarState:
        """Return a state drawn from the start distribution."""
        return CarState(jax.random.uniform(key, (), minval=-0.6, maxval=-0.4), jnp.zeros(()))

    def observe(self, state: CarState) -> jax.Array:
        """Return what the agent sees of a state."""
        return jnp.stack([state.position, state.velocity])

    def transition(self, state: CarState, action: jax.Array) -> Transition:
        """Apply the dynamics to a state and an action [A]."""
        force = jnp.clip(action[0], -1.0, 1.0)
        velocity = state.velocity + POWER * force - GRAVITY * jnp.cos(3 * state.position)
        velocity = jnp.clip(velocity, -MAX_SPEED, MAX_SPEED)
        position = jnp.clip(state.position + velocity, LEFT_WALL, RIGHT_WALL)
        # The left wall is inelastic; the right end of the track lies behind the flag.
        velocity = jnp.where((position == LEFT_WALL) & (velocity < 0), 0.0, velocity)
        terminated = (position >= GOAL_POSITION) & (velocity >= 0)
        reward = jnp.stack([jnp.where(terminated, 0.0, -1.0), -(force**2)])
        return Transition(CarState(position, velocity), reward, terminated)

    def scene(self, state: CarState) -> Scene:
        """Return the whole valley, the flag, and the car upright on the slope."""
        x = np.linspace(*VALLEY.x, 101)
        hill = tuple(zip(x.tolist(), _height(x).tolist(), strict=True))
        (left, right), bottom = VALLEY.x, VALLEY.z[0]
        wall, foot = (LEFT_WALL, float(_height(LEFT_WALL))), (GOAL_POSITION, float(_height(GOAL_POSITION)))
        top = (foot[0], foot[1] + 0.17)
        pennant = (top, (foot[0] + 0.09, foot[1] + 0.14), (foot[0], foot[1] + 0.11))
        valley = (
            Polygon((*hill, (right, bottom), (left, bottom)), "ground"),
            Polyline(hill, "mark"),
            Polyline((wall, (wall[0], wall[1] + 0.2)), "mark"),
            Polyline((foot, top), "mark"),
            Polygon(pennant, "goal"),
        )
        return Scene((*valley, *_car(float(state.position))), VALLEY)


def _height(position: np.ndarray | float) -> np.ndarray:
    """Return the valley, as Gymnasium draws it."""
    return np.asarray(np.sin(3 * np.asarray(position)) * 0.45 + 0.55)


def _car(position: float) -> tuple[Shape, ...]:
    slope = np.arctan(1.35 * np.cos(3 * position))
    along, upwards = np.array([np.cos(slope), np.sin(slope)]), np.array([-np.sin(slope), np.cos(slope)])
    ground = np.array([position, float(_height(position))])

    def point(a: float, b: float) -> Point:
        x, z = ground + a * along + b * upwards
        return float(x), float(z)

    outline = [(-0.075, 0.025), (0.075, 0.025), (0.075, 0.06), (0.03, 0.07), (0.015, 0.105), (-0.06, 0.105)]
    body = Polygon(tuple(point(*corner) for corner in outline), "body")
    return body, Disk(point(-0.042, 0.026), 0.026, "body"), Disk(point(0.042, 0.026), 0.026, "body")

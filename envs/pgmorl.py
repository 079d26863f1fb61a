"""The runners of PGMORL's authors (Xu et al. 2020), which most published fronts are of. Never to be mixed with others.

They differ from Gymnasium's: episodes of 500 steps from the same state, other rewards and ends, and for walker and
hopper other parameters of the model. `change` has all that differs in a model from Gymnasium's file of version 5.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, ClassVar

import jax
import jax.numpy as jnp

from envs import hopper, walker2d
from envs.core import Objective, Transition
from envs.half_cheetah import JOINTS, HalfCheetah
from envs.hopper import Hopper
from envs.physics import BodyState
from envs.runner import at_rest
from envs.walker2d import Walker2d

if TYPE_CHECKING:
    import mujoco

FAMILY = "PGMORL's authors"
STEPS = 500
ALIVE = 1.0  # reward of a step in every objective, or part of it
FASTEST = 4.0  # m/s that the half cheetah gets anything for
ENERGY = 4.0  # reward of a step without control
CHEETAH_STEEPEST = math.radians(50)
HOPPER_STEEPEST = math.radians(90)  # of the torso and of every joint
HOPPER_LOWEST = 0.4  # metres
HOPPER_FRAME_SKIP = 5
SPEED_WEIGHT, HEIGHT_WEIGHT, CONTROL_WEIGHT = 1.5, 12.0, 2e-4  # of the hopper

_ENERGY = Objective("energy", "energy", "(5 - control²)·steps", highest=STEPS * (ENERGY + ALIVE))


def _energy(control: jax.Array) -> jax.Array:
    return ENERGY + ALIVE - jnp.sum(control**2)


class PgmorlHalfCheetah(HalfCheetah):
    """Reward: forward speed of up to 4 m/s, and one; five minus the sum of the squared controls.

    The episode ends when the torso leans by 50 degrees.
    """

    id = "pgmorl-halfcheetah-v2"
    family = FAMILY
    objectives: ClassVar = (Objective("speed", "speed", "(m/s + 1)·steps", highest=STEPS * (FASTEST + ALIVE)), _ENERGY)
    time_limit = STEPS

    def initial_state(self, key: jax.Array) -> BodyState:
        """Return the state that every episode starts from."""
        return BodyState(jnp.zeros(JOINTS), jnp.zeros(JOINTS))

    def transition(self, state: BodyState, action: jax.Array) -> Transition:
        """Apply the dynamics to a state and an action [A]."""
        state, speed, control = self.moved(state, action)
        reward = jnp.stack([jnp.minimum(speed, FASTEST) + ALIVE, _energy(control)])
        return Transition(state, reward, ~(jnp.abs(state.qpos[2]) < CHEETAH_STEEPEST))


class PgmorlWalker2d(Walker2d):
    """Reward: forward speed, and one; five minus the sum of the squared controls. Ends as Gymnasium's does."""

    id = "pgmorl-walker2d-v2"
    family = FAMILY
    objectives: ClassVar = (Objective("speed", "speed", "(m/s + 1)·steps"), _ENERGY)
    time_limit = STEPS

    def initial_state(self, key: jax.Array) -> BodyState:
        """Return the state that every episode starts from."""
        return at_rest(walker2d.STANDING)

    def change(self, model: mujoco.MjSpec) -> None:
        """Make the model heavier, its joints stiffer to move, and one of its feet smoother."""
        for joint in _driven(model):
            joint.damping[0] = 3.0
        for geom in model.geoms:
            geom.density = 1500.0
        model.geom("foot_geom").friction[0] = 0.9

    def transition(self, state: BodyState, action: jax.Array) -> Transition:
        """Apply the dynamics to a state and an action [A]."""
        state, speed, control = self.moved(state, action)
        return Transition(state, jnp.stack([speed + ALIVE, _energy(control)]), ~walker2d.healthy(state))


class PgmorlHopper(Hopper):
    """Reward: 1.5 times the forward speed; 12 times the height above standing; each with 1 - 0.0002 control² added.

    The episode ends when the torso is low, or it or any joint at a right angle.
    """

    id = "pgmorl-hopper-v2"
    family = FAMILY
    objectives: ClassVar[tuple[Objective, ...]] = (
        Objective("speed", "speed", "(1.5 m/s + 1 - 0.0002 control²)·steps"),
        Objective("height", "height", "(12 m + 1 - 0.0002 control²)·steps"),
    )
    time_limit = STEPS
    frame_skip = HOPPER_FRAME_SKIP
    step_seconds = HOPPER_FRAME_SKIP * hopper.TIMESTEP
    action_low = (-2.0, -2.0, -4.0)
    action_high = (2.0, 2.0, 4.0)

    def initial_state(self, key: jax.Array) -> BodyState:
        """Return the state that every episode starts from."""
        return at_rest(hopper.STANDING)

    def change(self, model: mujoco.MjSpec) -> None:
        """Make its motors stronger, its joints much stiffer to move and without limits.

        The margin of a contact was the greater of both geoms' when the authors trained; now it is their sum.
        """
        for joint in _driven(model):
            joint.damping[0] = 40.0
            joint.limited = False
        for geom in model.geoms:
            geom.margin = 0.0005
        for motor, gear, most in zip(model.actuators, (200.0, 200.0, 300.0), self.action_high, strict=True):
            motor.gear[0] = gear
            motor.ctrlrange = (-most, most)

    def transition(self, state: BodyState, action: jax.Array) -> Transition:
        """Apply the dynamics to a state and an action [A]."""
        state, speed, control = self.moved(state, action)
        healthy = (state.qpos[1] > HOPPER_LOWEST) & (jnp.abs(state.qpos[2:]) < HOPPER_STEEPEST).all()
        height = state.qpos[1] - hopper.STANDING[1]
        return Transition(state, self.reward(SPEED_WEIGHT * speed, HEIGHT_WEIGHT * height, control), ~healthy)

    def reward(self, speed: jax.Array, height: jax.Array, control: jax.Array) -> jax.Array:
        """Return the reward [M]."""
        return jnp.stack([speed, height]) + ALIVE - CONTROL_WEIGHT * jnp.sum(control**2)


class PgmorlHopper3(PgmorlHopper):
    """Reward: 1.5 times the forward speed, 12 times the height above standing, each and one; five less control²."""

    id = "pgmorl-hopper-v3"
    objectives: ClassVar = (
        Objective("speed", "speed", "(1.5 m/s + 1)·steps"),
        Objective("height", "height", "(12 m + 1)·steps"),
        _ENERGY,
    )

    def reward(self, speed: jax.Array, height: jax.Array, control: jax.Array) -> jax.Array:
        """Return the reward [3]."""
        return jnp.stack([speed + ALIVE, height + ALIVE, _energy(control)])


def _driven(model: mujoco.MjSpec) -> list[mujoco.MjsJoint]:
    """Return the joints besides the root's."""
    return [joint for joint in model.joints if not joint.name.startswith("root")]

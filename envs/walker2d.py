"""`mo-walker2d-v5`: walk fast, on little torque, and do not fall.

Gymnasium's Walker2d-v5 with MO-Gymnasium's vector reward.
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
STANDING = (0.0, 1.25, *(0.0,) * 7)  # qpos: x, z and angle of the torso, then three joints of each leg
RESET_NOISE = 5e-3
LOWEST, HIGHEST = 0.8, 2.0  # metres, of the torso of one that is healthy
STEEPEST = 1.0  # radians


class Walker2d(Runner):
    """A two-legged walker in the vertical plane. Reward: forward speed; minus the sum of the squared controls.

    Both have one added while it is healthy: neither low, nor high, nor steep. The episode ends when it is not.
    """

    id = "mo-walker2d-v5"
    objectives: ClassVar = (
        Objective("speed", "speed", "(m/s + 1)·steps"),
        Objective("energy", "energy", "(1 - control²)·steps", highest=1000.0),
    )
    observation_size = 2 * len(STANDING) - 1
    action_size = 6
    time_limit = 1000
    step_seconds = FRAME_SKIP * TIMESTEP
    model_name = "walker2d_v5"
    frame_skip = FRAME_SKIP
    view = (1.9, 0.25, 2.0)

    def initial_state(self, key: jax.Array) -> BodyState:
        """Return a state drawn from the start distribution."""
        return near_rest(key, STANDING, RESET_NOISE)

    def observe(self, state: BodyState) -> jax.Array:
        """Return what the agent sees of a state."""
        return seen(state)

    def transition(self, state: BodyState, action: jax.Array) -> Transition:
        """Apply the dynamics to a state and an action [A]."""
        state, speed, control = self.moved(state, action)
        well = healthy(state)
        return Transition(state, jnp.stack([speed, -jnp.sum(control**2)]) + well.astype(speed.dtype), ~well)

    def part(self, geom: str) -> Part:
        """Return which part of the walker a capsule of the model belongs to, by its name."""
        if geom == "torso_geom":
            return "body"
        return "fore" if "left" in geom else "hind"


def healthy(state: BodyState) -> jax.Array:
    """Return whether the torso is neither low, nor high, nor steep, [] bool."""
    z, angle = state.qpos[1], state.qpos[2]
    return (z > LOWEST) & (z < HIGHEST) & (jnp.abs(angle) < STEEPEST)

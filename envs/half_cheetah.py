"""`mo-halfcheetah-v5`: run fast, on little torque.

Gymnasium's HalfCheetah-v5 with MO-Gymnasium's vector reward. One task, and a choice of who computes its physics.
"""

from typing import ClassVar

import jax
import jax.numpy as jnp

from envs.core import Objective, Reading, Transition
from envs.drawing import Part
from envs.physics import BodyState
from envs.runner import Runner

FRAME_SKIP = 5
TIMESTEP = 0.01  # seconds, of the model
JOINTS = 9  # three of the torso, then three of each leg
RESET_NOISE = 0.1
STEPS = 1000  # of every episode


class HalfCheetah(Runner):
    """A two-legged runner in the vertical plane. Reward: forward speed; minus the sum of the squared controls."""

    id = "mo-halfcheetah-v5"
    objectives: ClassVar = (
        Objective("speed", "speed", "m/s·steps", reading=Reading("m/s", mean_over=STEPS)),
        Objective(
            "energy", "energy", "-control²·steps", 0.0, Reading("control²", less_is_better=True, mean_over=STEPS)
        ),
    )
    observation_size = 2 * JOINTS - 1
    action_size = 6
    time_limit = STEPS
    step_seconds = FRAME_SKIP * TIMESTEP
    model_name = "half_cheetah"
    frame_skip = FRAME_SKIP
    view = (1.6, 0.22, 1.3)

    def initial_state(self, key: jax.Array) -> BodyState:
        """Return a state drawn from the start distribution."""
        position_key, velocity_key = jax.random.split(key)
        qpos = jax.random.uniform(position_key, (JOINTS,), minval=-RESET_NOISE, maxval=RESET_NOISE)
        qvel = RESET_NOISE * jax.random.normal(velocity_key, (JOINTS,))
        return BodyState(qpos, qvel)

    def observe(self, state: BodyState) -> jax.Array:
        """Return what the agent sees of a state."""
        return jnp.concatenate([state.qpos[1:], state.qvel])

    def transition(self, state: BodyState, action: jax.Array) -> Transition:
        """Apply the dynamics to a state and an action [A]."""
        state, speed, control = self.moved(state, action)
        return Transition(state, jnp.stack([speed, -jnp.sum(control**2)]), jnp.array(False))

    def part(self, geom: str) -> Part:
        """Return which part of the runner a capsule of the model belongs to, by its name."""
        if geom in ("torso", "head"):
            return "body"
        return "hind" if geom.startswith("b") else "fore"

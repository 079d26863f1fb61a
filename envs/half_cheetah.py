"""`mo-halfcheetah-v5`: run fast, on little torque.

Gymnasium's HalfCheetah-v5 with MO-Gymnasium's vector reward. One task, and a choice of who computes its physics.
"""

from __future__ import annotations

import importlib.util
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import jax
import jax.numpy as jnp
import numpy as np

from envs.core import Environment, Objective, Transition
from envs.drawing import Capsule, Part, Scene, Window, level_ground
from envs.mujoco_model import load_model, planar_capsules
from envs.physics import BodyState, Physics

if TYPE_CHECKING:
    import mujoco

FRAME_SKIP = 5
TIMESTEP = 0.01  # seconds, of the model
JOINTS = 9  # three of the torso, then three of each leg
RESET_NOISE = 0.1
VIEW = 1.6  # metres to see on both sides of the torso
PHYSICS = ("planar", "mjx")


class HalfCheetah(Environment[BodyState]):
    """A two-legged runner in the vertical plane. Reward: forward speed; minus the sum of the squared controls.

    `physics` is "planar" (`envs.planar`: fast) or "mjx" (MuJoCo's own, slow on a CPU). Making one is cheap: the model
    is loaded when it is first needed.
    """

    id = "mo-halfcheetah-v5"
    objectives: ClassVar = (
        Objective("speed", "speed", "m/s·steps"),
        Objective("energy", "energy", "-control²·steps", highest=0.0),
    )
    observation_size = 2 * JOINTS - 1
    action_size = 6
    time_limit = 1000
    step_seconds = FRAME_SKIP * TIMESTEP

    def __init__(self, physics: str = "planar"):
        if physics not in PHYSICS:
            raise ValueError(f"physics must be {' or '.join(PHYSICS)}, not {physics!r}")
        if physics == "mjx" and importlib.util.find_spec("mujoco.mjx") is None:
            raise ValueError("physics=mjx needs MJX: pip install 'jmorl[mjx]'")
        self._backend = physics

    @cached_property
    def model(self) -> mujoco.MjModel:
        """Gymnasium's model, as MuJoCo compiles it."""
        return load_model("half_cheetah")

    @cached_property
    def physics(self) -> Physics:
        """Who computes the dynamics."""
        with jax.ensure_compile_time_eval():  # the first use may be under a trace, which its arrays must outlive
            if self._backend == "mjx":
                from envs.mjx import MjxPhysics

                return MjxPhysics(self.model)
            from envs.planar import PlanarPhysics

            return PlanarPhysics(self.model)

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
        control = jnp.clip(action, -1.0, 1.0)
        state, displacement = self.physics.advance(state, control, FRAME_SKIP)
        # Not from a difference of positions, which in float32 and 10 km away is wrong by 0.01 m/s and more.
        speed = displacement[0] / self.step_seconds
        return Transition(state, jnp.stack([speed, -jnp.sum(control**2)]), jnp.array(False))

    def scene(self, state: BodyState) -> Scene:
        """Return the runner and the ground around it."""
        qpos = np.asarray(state.qpos, np.float64)
        window = Window((qpos[0] - VIEW, qpos[0] + VIEW), (-0.22, 1.3))
        capsules = planar_capsules(self.model, qpos)
        shapes = (
            Capsule(tuple(each.start.tolist()), tuple(each.end.tolist()), each.radius, _part(each.name))
            for each in capsules
        )
        return Scene((*level_ground(window), *shapes), window)


def _part(geom: str) -> Part:
    """Which of the three parts a capsule of the model belongs to, by its name."""
    if geom in ("torso", "head"):
        return "body"
    return "hind" if geom.startswith("b") else "fore"

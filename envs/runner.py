"""What runners in the vertical plane share: a MuJoCo model, who computes its physics, and how it is drawn."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import jax
import jax.numpy as jnp
import numpy as np

from envs.core import Environment
from envs.drawing import Capsule, Part, Scene, Window, level_ground
from envs.mujoco_model import load_model, planar_capsules
from envs.physics import BodyState, Physics

if TYPE_CHECKING:
    import mujoco

PHYSICS = ("planar", "mjx")
FASTEST_SEEN = 10.0  # m/s or rad/s


class Runner(Environment[BodyState]):
    """A runner whose joints begin with slides along x and z and a hinge about y. Controls drive the other joints.

    `physics` is "planar" (`envs.planar`: fast) or "mjx" (MuJoCo's own, slow on a CPU). Making one is cheap: the model
    is loaded when it is first needed.
    """

    family = "MO-Gymnasium"
    model_name: ClassVar[str]  # of its file in `envs/assets`
    frame_skip: ClassVar[int]  # time steps of the model in a step of the environment
    view: ClassVar[tuple[float, float, float]]  # metres to see: beside the torso, below the ground, above it

    def __init__(self, physics: str = "planar"):
        if physics not in PHYSICS:
            raise ValueError(f"physics must be {' or '.join(PHYSICS)}, not {physics!r}")
        self._backend = physics

    @cached_property
    def model(self) -> mujoco.MjModel:
        """The model, as MuJoCo compiles it."""
        return load_model(self.model_name, self.change)

    def change(self, model: mujoco.MjSpec) -> None:
        """Change parameters of the model before it is compiled; here none."""

    @cached_property
    def physics(self) -> Physics:
        """Who computes the dynamics."""
        with jax.ensure_compile_time_eval():  # the first use may be under a trace, which its arrays must outlive
            if self._backend == "mjx":
                from envs.mjx import MjxPhysics

                return MjxPhysics(self.model)
            from envs.planar import PlanarPhysics

            return PlanarPhysics(self.model)

    def moved(self, state: BodyState, action: jax.Array) -> tuple[BodyState, jax.Array, jax.Array]:
        """Apply an action [A] for a step. Returns the state, the speed along x in m/s, and the clipped control [A]."""
        assert self.step_seconds is not None
        low, high = (jnp.asarray(bound, action.dtype) for bound in (self.action_low, self.action_high))
        control = jnp.clip(action, low, high)
        state, displacement = self.physics.advance(state, control, self.frame_skip)
        # Not from a difference of positions, which in float32 and 10 km away is wrong by 0.01 m/s and more.
        return state, displacement[0] / self.step_seconds, control

    def scene(self, state: BodyState) -> Scene:
        """Return the runner and the ground around it."""
        qpos = np.asarray(state.qpos, np.float64)
        beside, below, above = self.view
        window = Window((qpos[0] - beside, qpos[0] + beside), (-below, above))
        shapes = (
            Capsule(tuple(each.start.tolist()), tuple(each.end.tolist()), each.radius, self.part(each.name))
            for each in planar_capsules(self.model, qpos)
        )
        return Scene((*level_ground(window), *shapes), window)

    def part(self, geom: str) -> Part:
        """Return which part of the runner a capsule of the model belongs to, by its name."""
        raise NotImplementedError


def at_rest(qpos: Sequence[float]) -> BodyState:
    """Return the state at the positions `qpos` [nq] without velocity."""
    positions = jnp.array(qpos)
    return BodyState(positions, jnp.zeros_like(positions))


def near_rest(key: jax.Array, qpos: Sequence[float], noise: float) -> BodyState:
    """Return a state with uniform noise in every position, about `qpos` [nq], and velocity, about zero."""
    position_key, velocity_key = jax.random.split(key)
    offset = jax.random.uniform(position_key, (len(qpos),), minval=-noise, maxval=noise)
    velocity = jax.random.uniform(velocity_key, (len(qpos),), minval=-noise, maxval=noise)
    return BodyState(jnp.array(qpos, offset.dtype) + offset, velocity)


def seen(state: BodyState) -> jax.Array:
    """Return all positions but the one along x, and the velocities, cut off at 10 in SI units."""
    return jnp.concatenate([state.qpos[1:], jnp.clip(state.qvel, -FASTEST_SEEN, FASTEST_SEEN)])

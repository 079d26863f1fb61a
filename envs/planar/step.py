"""The time step: Euler with implicit joint damping, for a batch of states."""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from envs.planar.constraints import Contacts, Limits, contacts, limits
from envs.planar.kinematics import Kinematics, kinematics
from envs.planar.model import PlanarModel
from envs.planar.solver import Joints, Solution, accelerations, body_inertia, constrained
from envs.planar.tree import constant


class Forward(NamedTuple):
    """A batch of states, up to their constrained accelerations."""

    moving: Kinematics
    touching: Contacts
    stops: Limits
    bodies: jax.Array  # [9, slots, batch] inertia, and gravity and bias force
    smooth: Joints  # all but the constraints
    solution: Solution


def forward(model: PlanarModel, qpos: jax.Array, qvel: jax.Array, drive: jax.Array) -> Forward:
    """Everything at positions and velocities [V, batch], under joint forces `drive`. All in level order."""
    moving = kinematics(model, qpos, qvel)
    touching, stops = contacts(model, moving), limits(model, qpos, qvel)
    bodies = body_inertia(model, moving)
    springs = constant(model.joint_stiffness, qpos) * (qpos - constant(model.joint_rest, qpos))
    armature = jnp.broadcast_to(constant(model.armature, qpos), qpos.shape)
    smooth = Joints(armature, drive - springs - constant(model.joint_damping, qpos) * qvel)
    return Forward(moving, touching, stops, bodies, smooth, constrained(model, moving, touching, stops, bodies, smooth))


def time_step(model: PlanarModel, qpos: jax.Array, qvel: jax.Array, drive: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Positions and velocities [V, batch] a time step later, under joint forces `drive`. All in level order."""
    now = forward(model, qpos, qvel, drive)
    # The damping of the step's end instead of its beginning: (M + h B) a' = forces = M a, or a' = a less what h B a
    # brakes. Forces summed anew would have the rounding of a, times stiffness.
    damping = model.timestep * constant(model.joint_damping, qpos)
    unpulled = jnp.concatenate([now.bodies[:6], jnp.zeros_like(now.bodies[6:])])
    braking = Joints(now.smooth.inertia + damping, damping * now.solution.qacc)
    braked, _ = accelerations(model, now.moving.offsets, unpulled, braking)
    qacc = now.solution.qacc - braked
    qvel = qvel + model.timestep * qacc
    return qpos + model.timestep * qvel, qvel

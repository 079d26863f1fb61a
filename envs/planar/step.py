"""The time step: Euler with implicit joint damping, for a batch of states."""

import jax
import jax.numpy as jnp

from envs.planar.constraints import contact_forces, contacts, limit_forces, limits
from envs.planar.kinematics import kinematics
from envs.planar.model import PlanarModel
from envs.planar.solver import Joints, accelerations, body_inertia, constrained
from envs.planar.tree import constant


def time_step(model: PlanarModel, qpos: jax.Array, qvel: jax.Array, drive: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Positions and velocities [V, batch] a time step later, under joint forces `drive`. All in level order."""
    moving = kinematics(model, qpos, qvel)
    touching, stops = contacts(model, moving), limits(model, qpos, qvel)
    bodies = body_inertia(model, moving)
    damping = constant(model.joint_damping, qpos)
    springs = constant(model.joint_stiffness, qpos) * (qpos - constant(model.joint_rest, qpos))
    armature = jnp.broadcast_to(constant(model.armature, qpos), qpos.shape)
    smooth = Joints(armature, drive - springs - damping * qvel)
    held = constrained(model, moving, touching, stops, bodies, smooth)

    pulled = jnp.concatenate([bodies[:6], bodies[6:] + contact_forces(touching, held.contact_residuals)])
    force = smooth.force + limit_forces(stops, held.limit_residuals)
    # The damping of the step's end instead of its beginning: (M + h B) a = forces at the beginning.
    qacc, _ = accelerations(model, moving.anchors, pulled, Joints(armature + model.timestep * damping, force))
    qvel = qvel + model.timestep * qacc
    return qpos + model.timestep * qvel, qvel

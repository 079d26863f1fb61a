"""The time step, for a batch of states: Euler with implicit joint damping, or Runge and Kutta's of fourth order."""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from envs.planar.constraints import contacts, limits, mutual_contacts
from envs.planar.kinematics import Kinematics, kinematics
from envs.planar.model import PlanarModel
from envs.planar.solver import Joints, Rows, Solution, accelerations, body_inertia, constrained
from envs.planar.tree import constant

Carry = tuple[jax.Array, jax.Array, jax.Array, jax.Array]


class Forward(NamedTuple):
    """A batch of states, up to their constrained accelerations."""

    moving: Kinematics
    rows: Rows
    bodies: jax.Array  # [9, slots, batch] inertia, and gravity and bias force
    smooth: Joints  # all but the constraints
    solution: Solution


def forward(model: PlanarModel, qpos: jax.Array, qvel: jax.Array, drive: jax.Array) -> Forward:
    """Everything at positions and velocities [V, batch], under joint forces `drive`. All in level order."""
    moving = kinematics(model, qpos, qvel)
    rows = Rows(contacts(model, moving), limits(model, qpos, qvel), mutual_contacts(model, moving))
    bodies = body_inertia(model, moving)
    springs = constant(model.joint_stiffness, qpos) * (qpos - constant(model.joint_rest, qpos))
    armature = jnp.broadcast_to(constant(model.armature, qpos), qpos.shape)
    smooth = Joints(armature, drive - springs - constant(model.joint_damping, qpos) * qvel)
    return Forward(moving, rows, bodies, smooth, constrained(model, moving, rows, bodies, smooth))


class Moved(NamedTuple):
    """A batch of states a time step later, [V, batch] each, in level order."""

    qpos: jax.Array
    qvel: jax.Array
    displacement: jax.Array  # of the positions, which far from the origin keep fewer digits


def time_step(model: PlanarModel, qpos: jax.Array, qvel: jax.Array, drive: jax.Array) -> Moved:
    """Move positions and velocities [V, batch] by a time step, under joint forces `drive`. All in level order."""
    return (_runge_kutta if model.runge_kutta else _euler)(model, qpos, qvel, drive)


def _euler(model: PlanarModel, qpos: jax.Array, qvel: jax.Array, drive: jax.Array) -> Moved:
    now = forward(model, qpos, qvel, drive)
    # The damping of the step's end instead of its beginning: (M + h B) a' = forces = M a, or a' = a less what h B a
    # brakes. Forces summed anew would have the rounding of a, times stiffness.
    damping = model.timestep * constant(model.joint_damping, qpos)
    unpulled = jnp.concatenate([now.bodies[:6], jnp.zeros_like(now.bodies[6:])])
    braking = Joints(now.smooth.inertia + damping, damping * now.solution.qacc)
    braked, _ = accelerations(model, now.moving.offsets, unpulled, braking)
    qacc = now.solution.qacc - braked
    qvel = qvel + model.timestep * qacc
    displacement = model.timestep * qvel
    return Moved(qpos + displacement, qvel, displacement)


def _runge_kutta(model: PlanarModel, qpos: jax.Array, qvel: jax.Array, drive: jax.Array) -> Moved:
    """Each stage moves from the beginning of the step at the rates of the stage before: half-way, again, to its end."""
    step = model.timestep

    def stage(carry: Carry, weights: jax.Array) -> tuple[Carry, None]:
        velocity, acceleration, displacement, change = carry
        onwards, share = step * weights
        velocity, acceleration = (
            qvel + onwards * acceleration,
            forward(model, qpos + onwards * velocity, qvel + onwards * acceleration, drive).solution.qacc,
        )
        return (velocity, acceleration, displacement + share * velocity, change + share * acceleration), None

    still = jnp.zeros_like(qvel)
    weights = jnp.array([[0, 1 / 6], [1 / 2, 1 / 3], [1 / 2, 1 / 3], [1, 1 / 6]], qvel.dtype)
    (_, _, displacement, change), _ = jax.lax.scan(stage, (still, still, still, still), weights)
    return Moved(qpos + displacement, qvel + change, displacement)

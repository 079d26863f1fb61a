"""Soft contacts with the ground and joint limits, as MuJoCo's documentation of the constraint model has them.

A constraint row acts while its residual, acceleration less reference acceleration, is negative. A capsule end on the
ground has four edges of a friction pyramid, `n + mu t`, `n - mu t` and, as nothing moves along y, `n` twice; a joint at
a limit has one row.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from envs.planar.kinematics import Kinematics
from envs.planar.model import Constraints, PlanarModel
from envs.planar.tree import constant


class Contacts(NamedTuple):
    """Both ends of every capsule against the ground: [2 ends, slots, batch] each."""

    x: jax.Array  # contact point about the body's hinge, half-way into the overlap
    z: jax.Array
    strength: jax.Array  # D, the inverse regularisation; 0 where nothing touches
    reference_x: jax.Array  # the acceleration at which the constraint is content
    reference_z: jax.Array
    friction: jax.Array  # [slots, 1] mu


class Limits(NamedTuple):
    """The hinges' limits, one row for the nearer one: [V - 2, batch] each."""

    direction: jax.Array  # +1 at the lower limit, -1 at the upper
    strength: jax.Array  # D; 0 within the range
    reference: jax.Array


def contacts(model: PlanarModel, moving: Kinematics) -> Contacts:
    """Return the contacts of a state."""
    radius = constant(model.contact_distance, moving.end)
    x, end_z = moving.end
    depth = radius + model.ground - moving.height - moving.hinge[1] - end_z  # positive in the ground
    half = 0.5 * depth - radius  # from the end up to the contact point
    velocity_x, velocity_z = moving.end_velocity
    velocity_x = velocity_x + moving.turning * half
    impedance = _impedance(model.contact, depth)
    damping = constant(model.contact.damping, x)
    return Contacts(
        x=x,
        z=end_z + half,
        strength=_strength(model.contact, impedance, depth),
        reference_x=-damping * velocity_x,
        reference_z=-damping * velocity_z + constant(model.contact.stiffness, x) * impedance * depth,
        friction=constant(model.friction, x),
    )


def limits(model: PlanarModel, qpos: jax.Array, qvel: jax.Array) -> Limits:
    """Return the joint limits of a state [V, batch]; slides have none."""
    angle, velocity = qpos[2:], qvel[2:]
    low, high = (constant(bound, qpos) for bound in model.hinge_range)
    past_low, past_high = low - angle, angle - high
    direction = jnp.where(past_low > past_high, 1.0, -1.0).astype(qpos.dtype)
    depth = jnp.maximum(past_low, past_high)
    impedance = _impedance(model.limit, depth)
    return Limits(
        direction=direction,
        strength=_strength(model.limit, impedance, depth),
        reference=-constant(model.limit.damping, qpos) * direction * velocity
        + constant(model.limit.stiffness, qpos) * impedance * depth,
    )


def contact_residuals(touching: Contacts, acceleration: jax.Array) -> jax.Array:
    """Residuals [3 rows, 2 ends, slots, batch] of the edges n + mu t, n - mu t and n.

    `acceleration` [3, slots, batch] is each body's (w, u, v): angular, and of its point at its hinge.
    """
    angular, along_x, along_z = acceleration
    tangential = touching.friction * (along_x + angular * touching.z - touching.reference_x)
    normal = along_z - angular * touching.x - touching.reference_z
    return jnp.stack([normal + tangential, normal - tangential, normal])


def limit_residuals(stops: Limits, qacc: jax.Array) -> jax.Array:  # [V, batch] -> [V - 2, batch]
    """Residuals of the limits' rows."""
    return stops.direction * qacc[2:] - stops.reference


def contact_stiffness(touching: Contacts, active: jax.Array) -> jax.Array:
    """Return what the active rows [3, 2 ends, slots, batch] add to each slot's articulated inertia [9, slots, batch].

    A row's `J' D J` is stiffness in the plane at the contact point, told about the hinge as a symmetric 3x3; its
    `J' D aref` is a force.
    """
    plus, minus, normal = jnp.where(active, touching.strength, 0.0)
    xx = touching.friction**2 * (plus + minus)
    xz = touching.friction * (plus - minus)
    zz = plus + minus + 2 * normal
    x, z = touching.x, touching.z
    turn_x, turn_z = xx * z - xz * x, xz * z - zz * x
    force_x = xx * touching.reference_x + xz * touching.reference_z
    force_z = xz * touching.reference_x + zz * touching.reference_z
    moment = force_x * z - force_z * x
    ends = (turn_x * z - turn_z * x, turn_x, turn_z, xx, xz, zz, moment, force_x, force_z)
    return jnp.stack([component[0] + component[1] for component in ends])


def _impedance(constraints: Constraints, depth: jax.Array) -> jax.Array:
    """MuJoCo's d(r): how strongly a constraint is held, from its least value at the surface to its greatest."""
    least, greatest, width, middle, power = (constant(each, depth) for each in constraints.impedance)
    share = jnp.minimum(jnp.abs(depth) / width, 1.0)
    if (constraints.impedance[4] == 2).all():  # the default, without slow powers
        rising, settling = share * share / middle, 1 - (1 - share) ** 2 / (1 - middle)
    else:
        rising = share**power / middle ** (power - 1)
        settling = 1 - (1 - share) ** power / (1 - middle) ** (power - 1)
    return least + jnp.where(share <= middle, rising, settling) * (greatest - least)


def _strength(constraints: Constraints, impedance: jax.Array, depth: jax.Array) -> jax.Array:
    diagonal = constant(constraints.diagonal, depth)
    return jnp.where(depth > 0, impedance / (diagonal * (1 - impedance)), 0.0)

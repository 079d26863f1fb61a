"""Soft contacts and joint limits, as MuJoCo's documentation of the constraint model has them.

A constraint row acts while its residual, acceleration less reference acceleration, is negative. A capsule end on the
ground has four edges of a friction pyramid, `n + mu t`, `n - mu t` and, as nothing moves along y, `n` twice; capsules
that touch each other have one row, without friction, and so has a joint at a limit.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from envs.planar.kinematics import Kinematics
from envs.planar.model import Constraints, PlanarModel
from envs.planar.tree import constant, pick

TINY = 1e-30  # square metres: less than any length of a model


class Contacts(NamedTuple):
    """Both ends of every capsule against the ground: [2 ends, slots, batch] each."""

    x: jax.Array  # contact point about the body's hinge, half-way into the overlap
    z: jax.Array
    strength: jax.Array  # D, the inverse regularisation; 0 where nothing touches
    reference_x: jax.Array  # the acceleration at which the constraint is content
    reference_z: jax.Array
    friction: jax.Array  # [slots, 1] mu


class Touching(NamedTuple):
    """Capsules against each other: [K, batch] each, but where both are told about."""

    x: jax.Array  # [2, K, batch] contact point about the hinge of either body, half-way into the overlap
    z: jax.Array  # [2, K, batch]
    normal: jax.Array  # [2, K, batch] x and z, from the first to the second
    strength: jax.Array  # D; 0 where they do not touch
    reference: jax.Array


class Limits(NamedTuple):
    """The hinges' limits, one row for the nearer one: [V - 2, batch] each."""

    direction: jax.Array  # +1 at the lower limit, -1 at the upper
    strength: jax.Array  # D; 0 within the range
    reference: jax.Array


def contacts(model: PlanarModel, moving: Kinematics) -> Contacts:
    """Return the contacts of a state."""
    begins, margin = constant(model.contact_distance, moving.end), constant(model.contact_margin, moving.end)
    x, end_z = moving.end
    depth = begins + model.ground - moving.height - moving.hinge[1] - end_z  # positive where it acts
    half = 0.5 * (depth + margin) - begins  # from the end up to the contact point, half-way into the overlap
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


def mutual_contacts(model: PlanarModel, moving: Kinematics) -> Touching:
    """Return the contacts of pairs of capsules.

    In a plane the closest points of two axes that do not cross include an end of one. Axes that cross have no
    direction in the plane to push each other in, and MuJoCo's contact is without effect, too. It has two contacts
    between axes that are parallel to the last digits, where here is one.
    """
    pairs = model.pairs
    if not pairs.count:
        none = moving.height[None][:0]
        return Touching(*(jnp.stack([none, none]),) * 3, none, none)
    end = moving.hinge[:, None] + moving.end  # [2, 2 ends, slots, batch] about O
    first, second = (pick(end, slots) for slots in pairs.slots)
    gap, here, there = _closest(first, second)
    radius = constant(pairs.radius, gap)
    length = jnp.sqrt(jnp.maximum((gap * gap).sum(axis=0), TINY))
    normal = gap / length
    depth = radius.sum(axis=0) + constant(pairs.margin, gap) - length
    depth = jnp.where(_cross(first, second), -1.0, depth)
    point = 0.5 * (here + there + normal * (radius[0] - radius[1]))
    about = jnp.stack([point - pick(moving.hinge, slots) for slots in pairs.slots], axis=1)  # [2, 2 bodies, K, batch]
    velocity = []
    for slots, place in zip(pairs.slots, (point - pick(end[:, 0], slots) for slots in pairs.slots), strict=True):
        turning = pick(moving.turning, slots)
        along = pick(moving.end_velocity[:, 0], slots)
        velocity.append(jnp.stack([along[0] + turning * place[1], along[1] - turning * place[0]]))
    approach = ((velocity[1] - velocity[0]) * normal).sum(axis=0)
    impedance = _impedance(pairs.contact, depth)
    return Touching(
        x=about[0],
        z=about[1],
        normal=normal,
        strength=_strength(pairs.contact, impedance, depth),
        reference=-constant(pairs.contact.damping, depth) * approach
        + constant(pairs.contact.stiffness, depth) * impedance * depth,
    )


def _closest(first: jax.Array, second: jax.Array) -> tuple[jax.Array, jax.Array, jax.Array]:
    """Return the shortest way from one segment to another [2, 2 ends, K, batch], where it begins, and where it ends.

    They do not cross. Each is [2, K, batch].
    """
    ways = []
    for points, segment, sign in ((first, second, 1.0), (second, first, -1.0)):
        start, along = segment[:, 0], segment[:, 1] - segment[:, 0]
        for point in (points[:, 0], points[:, 1]):
            square = jnp.maximum((along * along).sum(axis=0), TINY)
            share = jnp.clip(((point - start) * along).sum(axis=0) / square, 0.0, 1.0)
            nearest = start + share * along
            ends = (point, nearest) if sign > 0 else (nearest, point)
            ways.append(jnp.broadcast_arrays(ends[1] - ends[0], *ends))
    best = jnp.stack(ways[0])
    for way in map(jnp.stack, ways[1:]):
        best = jnp.where((way[0] ** 2).sum(axis=0) < (best[0] ** 2).sum(axis=0), way, best)
    gap, here, there = best
    return gap, here, there


def _cross(first: jax.Array, second: jax.Array) -> jax.Array:
    """Whether segments [2, 2 ends, K, batch] cross, [K, batch]."""

    def sides(segment: jax.Array, points: jax.Array) -> jax.Array:
        along, offset = segment[:, 1] - segment[:, 0], points - segment[:, :1]
        return along[0] * offset[1] - along[1] * offset[0]  # [2 ends, K, batch]

    apart = [sides(one, other).prod(axis=0) < 0 for one, other in ((first, second), (second, first))]
    return apart[0] & apart[1]


def mutual_residuals(model: PlanarModel, pushing: Touching, motion: jax.Array) -> jax.Array:
    """Residuals [K, batch] of the pairs' rows, at the bodies' accelerations [3, slots, batch]."""
    if not model.pairs.count:
        return pushing.reference
    return mutual_partings(model, pushing, motion) - pushing.reference


def mutual_partings(model: PlanarModel, pushing: Touching, motion: jax.Array) -> jax.Array:
    """Return how fast the second of each pair leaves the first along the normal [K, batch], or accelerates from it."""
    along = []
    for side, slots in enumerate(model.pairs.slots):
        w, u, v = pick(motion, slots)
        along.append(pushing.normal[0] * (u + w * pushing.z[side]) + pushing.normal[1] * (v - w * pushing.x[side]))
    return along[1] - along[0]


def mutual_pushes(model: PlanarModel, pushing: Touching) -> jax.Array:
    """Return what each pair's row does to the bodies: moment and force [3, slots, K, batch] about their hinges."""
    shape = 3, len(model.contact_distance), *pushing.strength.shape
    pushes = jnp.zeros_like(jnp.broadcast_to(pushing.strength, shape))
    for side, sign in enumerate((-1.0, 1.0)):
        force_x, force_z = sign * pushing.normal
        moment = force_x * pushing.z[side] - force_z * pushing.x[side]
        pushes = pushes.at[:, model.pairs.slots[side], np.arange(model.pairs.count)].set(
            jnp.stack([moment, force_x, force_z])
        )
    return pushes


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

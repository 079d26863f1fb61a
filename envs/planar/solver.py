"""Accelerations: an elimination along the tree, and Newton's method for the constraints on top of it.

The constrained acceleration minimises `1/2 |a - a_smooth|_M^2 + sum over active rows of 1/2 D (J a - aref)^2`.
Newton's Hessian is `M + sum J' D J`, and a contact's `J' D J` is a spatial stiffness of the body it touches: the
Hessian is built like a mass matrix, and one elimination along the tree solves it in O(bodies) (articulated bodies,
Featherstone 2008).

Spatial vectors are triples: motion (w, u, v), force (moment, f_x, f_z). Each body's are about its own hinge: about one
point for all, a light foot's resistance would be a small difference of large numbers. What a body resists and what
pulls at it are one array of nine components [9, n, batch]: the symmetric 3x3 as (ww, wu, wv, uu, uv, vv), then the
force.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from envs.planar.constraints import (
    Contacts,
    Limits,
    Touching,
    contact_residuals,
    contact_stiffness,
    limit_residuals,
    mutual_partings,
    mutual_pushes,
    mutual_residuals,
)
from envs.planar.kinematics import Kinematics
from envs.planar.model import Level, PlanarModel
from envs.planar.tree import at_slots, constant, pick, total

FULL_STEPS = 8  # of Newton; whatever goes on longer may be cycling, and minds the cost from then on
MAXIMAL_STEPS = 40
HALVINGS = 12  # of a step that passes the least cost


class Joints(NamedTuple):
    """What acts at the degrees of freedom: [V, batch] each."""

    inertia: jax.Array  # added to the diagonal of the mass matrix
    force: jax.Array


def body_inertia(model: PlanarModel, moving: Kinematics) -> jax.Array:
    """Each slot's inertia about its hinge, with gravity and bias force as what pulls at it [9, slots, batch]."""
    mass = constant(model.slot_mass, moving.centre)
    x, z = moving.centre
    force_x = -mass * moving.centre_acceleration[0]
    force_z = -mass * (moving.centre_acceleration[1] + model.gravity)
    moment = force_x * z - force_z * x
    none = jnp.zeros_like(x)
    turning = constant(model.slot_inertia, x) + mass * (x * x + z * z)
    return jnp.stack([turning, mass * z, -mass * x, none + mass, none, none + mass, moment, force_x, force_z])


def accelerations(
    model: PlanarModel, offsets: tuple[jax.Array, ...], bodies: jax.Array, joints: Joints
) -> tuple[jax.Array, jax.Array]:
    """Joint accelerations [V, batch], and each slot's (w, u, v) [3, slots, batch], of `bodies` [9, slots, batch]."""
    eliminated = []
    carried: jax.Array | float = 0.0
    for depth in range(len(model.levels) - 1, 0, -1):
        level = model.levels[depth]
        hinge = _eliminated(model, level, _bodies(bodies, level) + carried, joints)
        eliminated.append(hinge)
        felt = _about_parent(hinge.rest, offsets[depth - 1])
        carried = total(felt, level.parent, model.levels[depth - 1].count)
    root = model.levels[0]
    motion = _root_motion(model, _bodies(bodies, root) + carried, joints)
    motions = [motion]
    qacc = [motion[1], motion[2], constant(model.hinge_sign[:1], motion) * motion[0]]
    for level, hinge, (x, z) in zip(model.levels[1:], reversed(eliminated), offsets, strict=True):
        w, u, v = pick(motions[-1], level.parent)
        u, v = u + w * z, v - w * x
        turn = (hinge.force - hinge.w * w - hinge.u * u - hinge.v * v) * hinge.inverse
        motions.append(jnp.stack(jnp.broadcast_arrays(w + turn, u, v)))
        qacc.append(constant(model.hinge_sign[level.bodies], turn) * turn)
    return jnp.concatenate(qacc), at_slots(model, motions)


def _bodies(slots: jax.Array, level: Level) -> jax.Array:
    """Return a level's bodies' sums of all slots' values."""
    return total(slots[..., level.slots, :], level.slot_body, level.count)


class _Hinge(NamedTuple):
    """An eliminated hinge: the force it takes to accelerate it by one (w, u, v); what drives it; 1 / its inertia."""

    w: jax.Array
    u: jax.Array
    v: jax.Array
    force: jax.Array
    inverse: jax.Array
    rest: jax.Array  # [9, n, batch] what is left of the bodies, free to give way


def _eliminated(model: PlanarModel, level: Level, whole: jax.Array, joints: Joints) -> _Hinge:
    """Return the hinges of a level, of bodies [9, n, batch] about them: to turn is the first component."""
    ww, wu, wv, uu, uv, vv, moment, force_x, force_z = whole
    drive = constant(model.hinge_sign[level.bodies], whole) * joints.force[level.dofs]
    own = joints.inertia[level.dofs]
    force, inverse = moment + drive, 1 / (ww + own)
    kept, by_u, by_v = own * inverse, wu * inverse, wv * inverse  # `kept` is 1 - ww * inverse, without its rounding
    rest = (
        *(ww * kept, wu * kept, wv * kept, uu - wu * by_u, uv - wu * by_v, vv - wv * by_v),
        *(moment * kept - ww * drive * inverse, force_x - by_u * force, force_z - by_v * force),
    )
    return _Hinge(ww, wu, wv, force, inverse, jnp.stack(rest))


def _about_parent(bodies: jax.Array, offset: jax.Array) -> jax.Array:
    """Bodies [9, n, batch] about their parents' hinges, from which their own are at an offset [2, n, batch]."""
    ww, wu, wv, uu, uv, vv, moment, force_x, force_z = bodies
    x, z = offset
    to_u, to_v = wu + z * uu - x * uv, wv + z * uv - x * vv
    turning = ww + z * (wu + to_u) - x * (wv + to_v)
    return jnp.stack([turning, to_u, to_v, uu, uv, vv, moment + z * force_x - x * force_z, force_x, force_z])


def _root_motion(model: PlanarModel, whole: jax.Array, joints: Joints) -> jax.Array:
    """Return the root's (w, u, v) [3, 1, batch] from what it resists and feels [9, 1, batch]: a 3x3 solve, v first."""
    ww, wu, wv, uu, uv, vv, moment, force_x, force_z = whole
    uu, vv, ww = uu + joints.inertia[0:1], vv + joints.inertia[1:2], ww + joints.inertia[2:3]
    force_x, force_z = force_x + joints.force[0:1], force_z + joints.force[1:2]
    moment = moment + constant(model.hinge_sign[:1], whole) * joints.force[2:3]
    by_v = 1 / vv
    ww, wu, uu = ww - wv * wv * by_v, wu - wv * uv * by_v, uu - uv * uv * by_v
    moment, force_x = moment - wv * force_z * by_v, force_x - uv * force_z * by_v
    by_u = 1 / uu
    w = (moment - wu * force_x * by_u) / (ww - wu * wu * by_u)
    u = (force_x - wu * w) * by_u
    v = (force_z - wv * w - uv * u) * by_v
    return jnp.stack([w, u, v])


class Solution(NamedTuple):
    """Constrained accelerations."""

    qacc: jax.Array  # [V, batch]
    steps: jax.Array  # [] of Newton, until no active set changed in the whole batch


class _Point(NamedTuple):
    """Accelerations on Newton's way, and all that is linear in them."""

    qacc: jax.Array  # [V, batch]
    motion: jax.Array  # [3, slots, batch]
    contact: jax.Array  # [3, 2 ends, slots, batch] residuals
    limit: jax.Array  # [V - 2, batch] residuals
    mutual: jax.Array  # [K, batch] residuals


class Rows(NamedTuple):
    """All constraints of a batch of states."""

    ground: Contacts
    stops: Limits
    pushing: Touching


def constrained(model: PlanarModel, moving: Kinematics, rows: Rows, bodies: jax.Array, joints: Joints) -> Solution:
    """Newton's method from zero acceleration, with full steps.

    A full step depends on the active rows alone, so a state whose active rows no longer change has arrived, exactly,
    and stays where it is while the rest of the batch goes on. Full steps may cycle: after `FULL_STEPS` each is halved
    until the cost still falls at its end, and as the cost is convex, they arrive.
    """
    ground, stops, pushing = rows

    def point(qacc: jax.Array, motion: jax.Array) -> _Point:
        mutual = mutual_residuals(model, pushing, motion)
        return _Point(qacc, motion, contact_residuals(ground, motion), limit_residuals(stops, qacc), mutual)

    def step(carry: tuple[jax.Array, jax.Array, _Point]) -> tuple[jax.Array, jax.Array, _Point]:
        count, _, start = carry
        held = jnp.where(start.limit < 0, stops.strength, 0.0)
        none = jnp.zeros_like(joints.force[:2])
        diagonal = joints.inertia + jnp.concatenate([none, held])
        force = joints.force + jnp.concatenate([none, stops.direction * held * stops.reference])
        stiff = bodies + contact_stiffness(ground, start.contact < 0)
        pressed = jnp.where(start.mutual < 0, pushing.strength, 0.0)
        end = point(*_accelerations_with_pairs(model, moving, pushing, pressed, stiff, Joints(diagonal, force)))
        changed = _any(((end.contact < 0) != (start.contact < 0)) & (ground.strength > 0))
        changed |= _any(((end.limit < 0) != (start.limit < 0)) & (stops.strength > 0))
        changed |= _any(((end.mutual < 0) != (start.mutual < 0)) & (pushing.strength > 0))
        back = jax.lax.cond(
            count < FULL_STEPS,
            lambda: jnp.zeros_like(end.qacc[0]),
            lambda: 1 - _share(rows, bodies, joints, start, end),
        )
        reached = [there + back * (here - there) for here, there in zip(start, end, strict=True)]
        return count + 1, changed, _Point(*reached)

    def unsettled(carry: tuple[jax.Array, jax.Array, _Point]) -> jax.Array:
        return carry[1] & (carry[0] < MAXIMAL_STEPS)

    still = point(jnp.zeros_like(joints.force), jnp.zeros_like(bodies[:3]))
    begin = _any(jnp.ones_like(still.qacc, bool))  # true, and each device's own where the batch is spread over several
    count, _, found = jax.lax.while_loop(unsettled, step, (jnp.array(0), begin, still))
    return Solution(found.qacc, count)


def _accelerations_with_pairs(
    model: PlanarModel, moving: Kinematics, pushing: Touching, pressed: jax.Array, bodies: jax.Array, joints: Joints
) -> tuple[jax.Array, jax.Array]:
    """Return `accelerations` where pairs of bodies also push each other apart, each as stiff as `pressed` [K, batch].

    A pair couples two branches of the tree: its `J' D J` has rank one, and corrects the elimination along the tree
    (Woodbury). Nearly always no pair of the whole batch touches, and nothing is to be corrected.
    """
    qacc, motion = accelerations(model, moving.offsets, bodies, joints)
    count = model.pairs.count
    if not count:
        return qacc, motion

    def corrected() -> tuple[jax.Array, jax.Array]:
        # All pairs' unit pushes at once: the batch K times, one pair in each.
        def repeated(array: jax.Array) -> jax.Array:
            return jnp.concatenate([array] * count, axis=-1)

        pushes = mutual_pushes(model, pushing)  # [3, slots, K, batch]
        pushed = jnp.concatenate([repeated(bodies[:6]), pushes.reshape(*pushes.shape[:2], -1)])
        free = Joints(repeated(joints.inertia), jnp.zeros_like(repeated(joints.force)))
        found = accelerations(model, tuple(map(repeated, moving.offsets)), pushed, free)
        by_push = [each.reshape(*each.shape[:-1], count, -1) for each in found]  # [..., K, batch]
        root = jnp.sqrt(pressed)
        partings = [mutual_partings(model, pushing, by_push[1][..., pair, :]) for pair in range(count)]
        coupling = root[:, None] * jnp.stack(partings, axis=1) * root  # [K, K, batch]
        wanted = root * mutual_residuals(model, pushing, motion)
        held = root * _solved(coupling + jnp.eye(count, dtype=root.dtype)[..., None], wanted)
        first, second = ((held * each).sum(axis=-2) for each in by_push)
        return qacc - first, motion - second

    return jax.lax.cond(_any(pressed > 0), corrected, lambda: (qacc, motion))


def _solved(matrix: jax.Array, right: jax.Array) -> jax.Array:  # [K, K, batch], [K, batch] -> [K, batch]
    """Solve symmetric positive definite systems, written out, as K is small."""
    count = len(right)
    rows, sides = [matrix[each] for each in range(count)], [right[each] for each in range(count)]
    for pivot in range(count):
        for below in range(pivot + 1, count):
            factor = rows[below][pivot] / rows[pivot][pivot]
            rows[below] = rows[below] - factor * rows[pivot]
            sides[below] = sides[below] - factor * sides[pivot]
    found: list[jax.Array] = [jnp.zeros_like(right[0])] * count
    for pivot in reversed(range(count)):
        known = sum((rows[pivot][each] * found[each] for each in range(pivot + 1, count)), jnp.zeros_like(right[0]))
        found[pivot] = (sides[pivot] - known) / rows[pivot][pivot]
    return jnp.stack(found)


def _share(rows: Rows, bodies: jax.Array, joints: Joints, start: _Point, end: _Point) -> jax.Array:  # [batch]
    """How much of Newton's step from `start` to `end` to take: the most of 1, 1/2, 1/4, ... at which the cost falls.

    The cost's slope along the step is the inertia's, linear in the share taken, and the rows', linear while active. It
    would be zero at the end if the rows active at the start stayed the active ones.
    """
    qacc, motion, contact, limit, mutual = (there - here for here, there in zip(start, end, strict=True))
    ww, wu, wv, uu, uv, vv = bodies[:6]
    w, u, v = motion
    inertia = _sum(w * (ww * w + 2 * (wu * u + wv * v)) + u * (uu * u + 2 * uv * v) + vv * v * v)
    inertia = inertia + _sum(joints.inertia * qacc * qacc)
    edges = jnp.array([1.0, 1.0, 2.0], contact.dtype)[:, None, None, None]  # n counts twice
    strengths = edges * rows.ground.strength, rows.stops.strength, rows.pushing.strength
    steps = [strength * change for strength, change in zip(strengths, (contact, limit, mutual), strict=True)]

    def total(residuals: list[jax.Array]) -> jax.Array:
        return sum((_sum(step * each) for step, each in zip(steps, residuals, strict=True)), jnp.zeros_like(inertia))

    assumed = total([jnp.where(here < 0, there, 0.0) for here, there in zip(start[2:], end[2:], strict=True)])

    def slope(share: jax.Array) -> jax.Array:
        at = [there + (1 - share) * (here - there) for here, there in zip(start[2:], end[2:], strict=True)]
        return total([jnp.minimum(each, 0.0) for each in at]) - assumed - (1 - share) * inertia

    def halve(_: jax.Array, share: jax.Array) -> jax.Array:
        return jnp.where(slope(share) > 0, 0.5 * share, share)

    return jax.lax.fori_loop(0, HALVINGS, halve, jnp.ones_like(inertia))


def _sum(values: jax.Array) -> jax.Array:  # [..., batch] -> [batch]
    return values.sum(tuple(range(values.ndim - 1)))


def _any(flags: jax.Array) -> jax.Array:
    return jnp.any(flags.any(tuple(range(flags.ndim - 1))))

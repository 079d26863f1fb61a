"""Where everything is and how it moves: positions, velocities, and accelerations at zero joint acceleration.

Plane (x, z), rotation phi about +y: `R(phi)(a, b) = (a cos + b sin, -a sin + b cos)`. Axes are along the world's. A
body's points are told about its own hinge, where they are small, and hinges about that of the root, O: the world's x
never enters, so nothing loses digits far from its origin.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from envs.planar.model import PlanarModel
from envs.planar.tree import at_slots, constant, pick


class Kinematics(NamedTuple):
    """The levels' hinges, and slots' points about the hinge of their body."""

    height: jax.Array  # [batch] of O above the world's origin
    offsets: tuple[jax.Array, ...]  # levels below the root, [2, bodies, batch] each: hinges about their parents'
    hinge: jax.Array  # [2, slots, batch] about O
    turning: jax.Array  # [slots, batch] angular velocity about +y
    centre: jax.Array  # [2, slots, batch] centre of mass about the hinge
    centre_acceleration: jax.Array  # [2, slots, batch] at zero joint acceleration, without gravity
    end: jax.Array  # [2, 2 ends, slots, batch] capsule ends about the hinge
    end_velocity: jax.Array  # [2, 2 ends, slots, batch] in the world


def kinematics(model: PlanarModel, qpos: jax.Array, qvel: jax.Array) -> Kinematics:
    """From positions and velocities [V, batch], in level order.

    One recursion serves positions, accelerations and velocities: along an offset d of a body turning at w they change
    by d, by -w² d, and by w d turned a quarter.
    """
    angle, turning = _angles(model, qpos, qvel)
    cosine, sine = cos_sin(angle)
    rates = jnp.stack([jnp.ones_like(turning), -turning * turning, turning])[:, None]  # [3, 1, slots, batch]

    batch = qpos.shape[-1]
    still = jnp.zeros((2, 2, 1, batch), qpos.dtype)
    hinges = [jnp.concatenate([still, qvel[None, :2, None]])]  # each [3, 2, bodies, batch]
    offsets = []
    for above, level in zip(model.levels, model.levels[1:], strict=False):
        slot = above.first_slot[level.parent]
        offset = _turned(level.anchor, pick(cosine, slot), pick(sine, slot))
        offsets.append(offset[0])
        hinges.append(pick(hinges[-1], level.parent) + offset * pick(rates, slot))
    hinge = at_slots(model, hinges)
    centre = _turned(model.slot_centre, cosine, sine)
    ends = _turned(model.slot_ends, cosine, sine)
    return Kinematics(
        height=qpos[1] + float(model.root_position[1]),
        offsets=tuple(offsets),
        hinge=hinge[0],
        turning=turning,
        centre=centre[0],
        centre_acceleration=hinge[1] + centre[1] * rates[1],
        end=ends[0],
        end_velocity=hinge[2, :, None] + ends[2] * rates[2],
    )


def _angles(model: PlanarModel, qpos: jax.Array, qvel: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Angle and angular velocity [slots, batch] of every slot against the world."""
    turns = jnp.stack([qpos, qvel])
    levels: list[jax.Array] = []
    for level in model.levels:
        own = constant(model.hinge_sign[level.bodies], qpos) * turns[:, level.dofs]
        rest = np.stack([model.angle[level.bodies], np.zeros_like(model.angle[level.bodies])])
        own = own + constant(rest, qpos)
        levels.append(own + pick(levels[-1], level.parent) if levels else own)
    angle, turning = at_slots(model, levels)
    return angle, turning


def _turned(offset: np.ndarray, cosine: jax.Array, sine: jax.Array) -> jax.Array:
    """Offsets [2, ..., n] turned by angles [n, batch]: as they are, again, and a quarter further [3, 2, ..., n, batch].

    The three are what position, acceleration and velocity need.
    """
    x, z = offset
    along = constant(np.stack([[x, z], [x, z], [z, -x]]), cosine)
    across = constant(np.stack([[z, -x], [z, -x], [-x, -z]]), cosine)
    return along * cosine + across * sine


def cos_sin(angle: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Cosine and sine, in float32 by short polynomials on [-pi/4, pi/4], good to 1e-7 for angles of up to 1e4.

    XLA's own are an order of magnitude slower on a CPU: they reduce any angle exactly, one at a time.
    """
    if angle.dtype != jnp.float32:
        return jnp.cos(angle), jnp.sin(angle)
    quarter = jnp.round(angle * (2 / np.pi))
    # pi/2 in three parts, the first two short enough that their products with a quarter are exact (Cody and Waite).
    x = ((angle - quarter * 1.5703125) - quarter * 4.83751296997e-4) - quarter * 7.54978995489e-8
    square = x * x
    sine = x + x * square * (-1.6666654611e-1 + square * (8.3321608736e-3 - 1.9515295891e-4 * square))
    cosine = (
        1
        - 0.5 * square
        + square * square * (4.166664568298827e-2 + square * (-1.388731625493765e-3 + 2.443315711809948e-5 * square))
    )
    turns = quarter.astype(jnp.int32)
    odd = (turns & 1) == 1
    sign_of_cosine = jnp.where(((turns + 1) & 2) == 0, 1.0, -1.0)
    sign_of_sine = jnp.where((turns & 2) == 0, 1.0, -1.0)
    return sign_of_cosine * jnp.where(odd, sine, cosine), sign_of_sine * jnp.where(odd, cosine, sine)

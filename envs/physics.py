"""What an articulated environment asks of its physics; `envs.planar` and `envs.mjx` answer."""

from typing import Protocol

import jax
from flax import struct


@struct.dataclass
class BodyState:
    """A mechanical state in generalised coordinates, in the order of the MuJoCo model's joints. SI units."""

    qpos: jax.Array  # [nq]
    qvel: jax.Array  # [nv]


class Physics(Protocol):
    """Newton's laws for one state; callers batch with `jax.vmap`."""

    def advance(self, state: BodyState, control: jax.Array, substeps: int) -> tuple[BodyState, jax.Array]:
        """Apply `control` [nu] for `substeps` time steps. Returns the state, and the displacement [nv].

        The displacement is the sum of what each substep adds to the positions: it keeps its digits far from the
        origin, where a difference of positions does not.
        """
        ...

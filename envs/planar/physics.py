"""The planar dynamics as an environment's physics: of one state for its readers, of a batch underneath."""

import math
from collections.abc import Callable

import jax
import jax.numpy as jnp
import mujoco
import numpy as np

from envs.physics import BodyState
from envs.planar.model import compile_model
from envs.planar.step import time_step

BLOCK = 256  # states at once on a CPU, where more fall out of its caches


class PlanarPhysics:
    """MuJoCo's dynamics of a model that moves in the plane (x, z). Raises UnsupportedModel for any other.

    Under `vmap`, nested or not, the whole batch is brought to the last axis, where it is fast.
    """

    def __init__(self, model: mujoco.MjModel):
        self.model = compile_model(model)

    def advance(self, state: BodyState, control: jax.Array, substeps: int) -> tuple[BodyState, jax.Array]:
        """See `envs.physics.Physics`. `control` [nu] is clipped to the actuators' ranges."""
        if control.shape[-1] != self.model.actuator_gear.shape[1]:
            raise ValueError(f"{control.shape[-1]} controls for {self.model.actuator_gear.shape[1]} actuators")

        @jax.custom_batching.custom_vmap
        def advanced(qpos: jax.Array, qvel: jax.Array, control: jax.Array) -> tuple[jax.Array, ...]:
            return self._advanced(qpos, qvel, control, substeps)

        @advanced.def_vmap
        def _(size: int, batched: list[bool], *arguments: jax.Array) -> tuple[tuple[jax.Array, ...], tuple[bool, ...]]:
            whole = [
                argument if has else jnp.broadcast_to(argument, (size, *argument.shape))
                for argument, has in zip(arguments, batched, strict=True)
            ]
            # The same function again, so that the next vmap comes here, too.
            return advanced(*whole), (True, True, True)

        qpos, qvel, displacement = advanced(state.qpos, state.qvel, control)
        return BodyState(qpos, qvel), displacement

    def _advanced(
        self, qpos: jax.Array, qvel: jax.Array, control: jax.Array, substeps: int
    ) -> tuple[jax.Array, ...]:  # each [..., V]
        """Any number of leading axes, flattened into one batch and put last; MuJoCo's joint order to level order."""
        with jax.numpy_rank_promotion("allow"):  # constants of a body are broadcast over the batch everywhere below
            return self._advanced_in_levels(qpos, qvel, control, substeps)

    def _advanced_in_levels(
        self, qpos: jax.Array, qvel: jax.Array, control: jax.Array, substeps: int
    ) -> tuple[jax.Array, ...]:
        model = self.model
        leading = qpos.shape[:-1]
        low, high = (jnp.asarray(bound, control.dtype) for bound in model.control_range)
        drive = jnp.clip(control, low, high) @ jnp.asarray(model.actuator_gear.T, control.dtype)
        state = jnp.stack([qpos[..., model.dofs], qvel[..., model.dofs], drive])  # [3, ..., V]
        flat = jnp.moveaxis(state.reshape(3, -1, state.shape[-1]), 1, -1)  # [3, V, batch]
        result = _in_blocks(lambda block: self._substeps(block, substeps), flat)
        back = jnp.moveaxis(result, -1, 1).reshape(3, *leading, -1)[..., np.argsort(model.dofs)]
        return back[0], back[1], back[2]

    def _substeps(self, state: jax.Array, substeps: int) -> jax.Array:
        """Position, velocity and drive [3, V, batch] to position, velocity and displacement."""
        qpos, qvel, drive = state

        def substep(carry: tuple[jax.Array, ...], _: None) -> tuple[tuple[jax.Array, ...], None]:
            qpos, qvel, displacement = carry
            moved = time_step(self.model, qpos, qvel, drive)
            return (moved.qpos, moved.qvel, displacement + moved.displacement), None

        start: tuple[jax.Array, ...] = (qpos, qvel, jnp.zeros_like(qvel))
        return jnp.stack(jax.lax.scan(substep, start, None, length=substeps)[0])


def _in_blocks(function: Callable[[jax.Array], jax.Array], state: jax.Array) -> jax.Array:
    """Return `function` of [3, V, batch], on a CPU in blocks of equal size that stay in its caches."""
    batch = state.shape[-1]
    count = math.ceil(batch / BLOCK)
    if count == 1 or jax.default_backend() != "cpu":
        return function(state)
    size = math.ceil(batch / count)
    # What fills the last block are states at rest, in nobody's way.
    filled = jnp.pad(state, ((0, 0), (0, 0), (0, count * size - batch)))
    blocks = jnp.moveaxis(filled.reshape(*state.shape[:2], count, size), 2, 0)
    done = jax.lax.map(function, blocks)
    return jnp.moveaxis(done, 0, 2).reshape(*state.shape[:2], -1)[..., :batch]

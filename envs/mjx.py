"""The physics of a MuJoCo model through MJX, Google DeepMind's own MuJoCo in JAX.

It takes models that `envs.planar` cannot, and is many times slower on a CPU.
"""

from __future__ import annotations

import io
from contextlib import redirect_stdout
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp

from envs.physics import BodyState

if TYPE_CHECKING:
    import mujoco


class MjxPhysics:
    """`envs.physics.Physics` through MJX.

    `iterations` and `ls_iterations` are the most steps of the solver and of each line search; without them it takes
    the model's, and is as accurate as MuJoCo.
    """

    def __init__(self, model: mujoco.MjModel, iterations: int | None = None, ls_iterations: int | None = None):
        import mujoco

        with redirect_stdout(io.StringIO()):  # it prints which of its other back ends it does not find
            from mujoco import mjx

        self._step = mjx.step
        mjx_model = mjx.put_model(model, impl="jax")
        options = {"iterations": iterations, "ls_iterations": ls_iterations}
        given = {name: count for name, count in options.items() if count is not None}
        self._model = mjx_model.replace(opt=mjx_model.opt.replace(**given))
        self._data = mjx.make_data(self._model)
        self._timestep = model.opt.timestep
        # What steps of Runge and Kutta add is not in their result; a difference has fewer digits far from the origin.
        self._by_difference = model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4

    def advance(self, state: BodyState, control: jax.Array, substeps: int) -> tuple[BodyState, jax.Array]:
        """As `envs.physics.Physics.advance`. Each substep's solver starts from the last one's acceleration."""

        def substep(carry: tuple[jax.Array, ...], _: None) -> tuple[tuple[jax.Array, ...], None]:
            qpos, qvel, qacc, displacement = carry
            data = self._data.replace(qpos=qpos, qvel=qvel, qacc_warmstart=qacc, ctrl=control)
            with jax.numpy_rank_promotion("allow"), jax.numpy_dtype_promotion("standard"):  # which MJX relies on
                data = self._step(self._model, data)
            moved = data.qpos - qpos if self._by_difference else self._timestep * data.qvel
            return (data.qpos, data.qvel, data.qacc_warmstart, displacement + moved), None

        still = jnp.zeros_like(state.qvel)
        start: tuple[jax.Array, ...] = (state.qpos, state.qvel, still, still)
        (qpos, qvel, _, displacement), _ = jax.lax.scan(substep, start, None, length=substeps)
        return BodyState(qpos, qvel), displacement

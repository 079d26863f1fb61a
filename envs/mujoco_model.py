"""MuJoCo's models: loading them quietly, and seeing them as 2-D shapes. Importing this module does not load MuJoCo."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import resources
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    import mujoco


class PlanarCapsule(NamedTuple):
    """One of a model's capsules, seen along the y axis."""

    name: str
    start: np.ndarray  # [2] x and z of an end of its axis, metres
    end: np.ndarray  # [2]
    radius: float


@contextmanager
def quiet_mujoco() -> Iterator[None]:
    """Drop MuJoCo's warnings within this block, which it would print and write to a file in the working directory."""
    import mujoco

    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _message: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


def load_model(name: str, change: Callable[[mujoco.MjSpec], None] | None = None) -> mujoco.MjModel:
    """Return the model `envs/assets/NAME.xml`, with what is changed in it, compiled by MuJoCo."""
    import mujoco

    text = resources.files("envs").joinpath("assets", f"{name}.xml").read_text(encoding="utf-8")
    with quiet_mujoco(), warnings.catch_warnings():  # Gymnasium's files have attributes that MuJoCo 4 calls deprecated
        warnings.simplefilter("ignore")
        specification = mujoco.MjSpec.from_string(text)
        if change:
            change(specification)
        return specification.compile()


def planar_capsules(model: mujoco.MjModel, qpos: np.ndarray) -> list[PlanarCapsule]:
    """Return the model's capsules at the joint positions `qpos` [nq], in the order of its file."""
    import mujoco

    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_kinematics(model, data)
    capsules = []
    for geom in np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_CAPSULE):
        radius, half_length, _ = model.geom_size[geom]
        centre, axis = data.geom_xpos[geom], data.geom_xmat[geom].reshape(3, 3)[:, 2]
        start, end = (centre + sign * half_length * axis for sign in (-1, 1))
        capsules.append(PlanarCapsule(model.geom(geom).name, start[[0, 2]], end[[0, 2]], float(radius)))
    return capsules

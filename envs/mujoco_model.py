"""MuJoCo's models: loading them quietly, and seeing them as 2-D shapes. Importing this module does not load MuJoCo."""

from __future__ import annotations

import threading
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    import mujoco

OF_THREAD = threading.local()


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

    data = _data_of(model)
    data.qpos[:] = qpos
    mujoco.mj_kinematics(model, data)
    geoms, names = _capsules_of(model)
    centres, axes = data.geom_xpos[geoms][:, [0, 2]], data.geom_xmat[geoms].reshape(-1, 3, 3)[:, [0, 2], 2]
    reaches = model.geom_size[geoms, 1, None] * axes
    return list(map(PlanarCapsule, names, centres - reaches, centres + reaches, model.geom_size[geoms, 0].tolist()))


def _data_of(model: mujoco.MjModel) -> mujoco.MjData:
    """Return what this thread computes the model's poses with: to make it anew takes longer than a pose."""
    import mujoco

    known: dict[mujoco.MjModel, mujoco.MjData] = vars(OF_THREAD).setdefault("data", {})
    if model not in known:
        known[model] = mujoco.MjData(model)
    return known[model]


@cache
def _capsules_of(model: mujoco.MjModel) -> tuple[np.ndarray, list[str]]:
    """Return the indices of the model's capsules, and their names."""
    import mujoco

    geoms = np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_CAPSULE)
    return geoms, [model.geom(geom).name for geom in geoms]

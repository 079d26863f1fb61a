"""MuJoCo's dynamics for models that move in one vertical plane, in pure JAX, fast on CPUs."""

from envs.planar.model import UnsupportedModel
from envs.planar.physics import PlanarPhysics

__all__ = ["PlanarPhysics", "UnsupportedModel"]

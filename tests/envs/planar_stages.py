"""The stages of a planar time step, in MuJoCo's order, to hold against `tests.envs.mujoco_reference`."""

import jax
import jax.numpy as jnp
import mujoco
import numpy as np

from envs.physics import BodyState
from envs.planar import PlanarPhysics
from envs.planar.model import PlanarModel, compile_model
from envs.planar.solver import Joints, accelerations
from envs.planar.step import Forward, forward
from tests.envs.mujoco_reference import Stages, States, capsules_of, stages

# Compiled code that is slow to run, and a third of the time to compile; for float64, where it makes no difference.
QUICK_TO_COMPILE = {"xla_backend_optimization_level": 0}
LEAST_SCALE = 1e-3  # what differences are relative to where MuJoCo has less, in SI units


def assert_agrees(model: mujoco.MjModel, states: States, tolerance: float) -> Stages:
    """Every stage as MuJoCo's in float64, relative to a state's greatest number. Returns MuJoCo's."""
    expected = stages(model, states)
    for name, ours, theirs in zip(Stages._fields, planar_stages(model, states), expected, strict=True):
        assert relative_difference(ours, theirs).max() < tolerance, name
    return expected


def relative_difference(ours: np.ndarray, theirs: np.ndarray) -> np.ndarray:  # [N, ...] -> [N]
    """Each state's greatest difference, relative to its greatest number."""
    axes = tuple(range(1, theirs.ndim))
    scale = np.maximum(np.abs(theirs).max(axes, initial=0.0), LEAST_SCALE)
    difference: np.ndarray = np.abs(ours - theirs).max(axes, initial=0.0) / scale
    return difference


def planar_stages(model: mujoco.MjModel, states: States) -> Stages:
    """Our stages, in float64."""
    planar = compile_model(model)
    with jax.enable_x64(True), jax.numpy_rank_promotion("allow"):  # the latter as within `PlanarPhysics`
        found = jax.jit(lambda *each: _stages(model, planar, *each), compiler_options=QUICK_TO_COMPILE)(*states)
    after = one_step(model, states, np.float64)
    return Stages(*(np.asarray(each) for each in (*found, after.qpos, after.qvel)))


def one_step(model: mujoco.MjModel, states: States, dtype: type) -> BodyState:
    """One time step by us, in float32 or float64."""
    physics = PlanarPhysics(model)
    exact = dtype is np.float64
    options = QUICK_TO_COMPILE if exact else {}  # in float32, what is compiled for users

    def advance(qpos: jax.Array, qvel: jax.Array, control: jax.Array) -> BodyState:
        return physics.advance(BodyState(qpos, qvel), control, 1)[0]

    with jax.enable_x64(exact):
        program = jax.jit(jax.vmap(advance), compiler_options=options)
        after: BodyState = jax.device_get(program(*(np.asarray(each, dtype) for each in states)))
    return after


def forwarded(model: PlanarModel, qpos: jax.Array, qvel: jax.Array, control: jax.Array) -> Forward:
    """A batch of states, the batch first and in MuJoCo's order, up to the constrained acceleration."""
    with jax.numpy_rank_promotion("allow"):  # as within `PlanarPhysics`
        drive = jnp.asarray(model.actuator_gear) @ jnp.clip(control, *model.control_range).T
        return forward(model, qpos.T[model.dofs], qvel.T[model.dofs], drive)


def _stages(
    model: mujoco.MjModel, planar: PlanarModel, qpos: jax.Array, qvel: jax.Array, control: jax.Array
) -> tuple[jax.Array, ...]:
    moving, (touching, stops, pushing), bodies, smooth, solution = forwarded(planar, qpos, qvel, control)
    centre_slot, capsule_slot = _slots(model, planar)
    joint = np.argsort(planar.dofs)
    capsule = np.argsort(capsule_slot)[planar.pairs.slots]  # of each pair, by the order of the capsules
    pair = np.lexsort(np.sort(capsule, axis=0))

    def accelerated(pulled: jax.Array, force: jax.Array) -> jax.Array:
        return accelerations(planar, moving.offsets, pulled, Joints(smooth.inertia, force))[0][joint].T

    at_rest = jnp.concatenate([bodies[:6], jnp.zeros_like(bodies[6:])])
    ends = moving.hinge[:, None] + moving.end
    points = moving.hinge[:, None] + jnp.stack([touching.x, touching.z])
    distance = ends[1] + moving.height - planar.ground - (planar.contact_distance - planar.contact_margin)[:, None]
    touches, held = touching.strength > 0, stops.strength > 0
    along = touching.friction * touching.reference_x
    edges = jnp.stack([touching.reference_z + along, touching.reference_z - along])
    slides = jnp.zeros_like(qpos.T[:2])
    return (
        moving.hinge[:, centre_slot].T,
        (moving.hinge + moving.centre)[:, centre_slot].T,
        ends[:, :, capsule_slot].T,
        accelerated(bodies, jnp.zeros_like(qvel.T)),
        accelerated(at_rest, qvel.T[planar.dofs]),
        jnp.where(touches, points, 0.0)[:, :, capsule_slot].T,
        jnp.where(touches, distance, 0.0)[:, capsule_slot].T,
        touching.strength[:, capsule_slot].T,
        jnp.where(touches, edges, 0.0)[:, :, capsule_slot].T,
        jnp.concatenate([slides, stops.strength])[joint].T,
        jnp.concatenate([slides, jnp.where(held, stops.reference, 0.0)])[joint].T,
        pushing.strength[pair].T,
        jnp.where(pushing.strength > 0, pushing.reference, 0.0)[pair].T,
        solution.qacc[joint].T,
    )


def _slots(model: mujoco.MjModel, planar: PlanarModel) -> tuple[np.ndarray, np.ndarray]:
    """The slot with the inertia of each body from 1 on, and the slot of each capsule."""
    capsules = capsules_of(model)
    inertia, at = {}, {}
    slot = 0
    for body in model.jnt_bodyid[planar.dofs[2:]]:
        inertia[body] = slot
        own = capsules[model.geom_bodyid[capsules] == body]
        at |= {capsule: slot + index for index, capsule in enumerate(own)}
        slot += max(1, len(own))
    return np.array([inertia[body] for body in sorted(inertia)]), np.array([at[capsule] for capsule in capsules], int)

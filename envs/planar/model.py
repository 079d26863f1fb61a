"""What the planar dynamics need to know of a MuJoCo model, and the models they can represent.

Joints and bodies are kept in *level order*: the root's slides and hinge, then every body one joint below the root, two
below, and so on, so that one array holds a whole level. The geometry of a body is told in the frame of its hinge: the
origin at the hinge's anchor, turned with the body. A *slot* is one capsule with its share of a body: a body has one for
each of its capsules, or one without a capsule, and the first of them carries the inertia.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import mujoco
import numpy as np

from envs.planar.support import capsule_axis, collide, meet, prevailing, unsupported

FAR = 1e6  # radians or metres: a limit that is never reached, and finite so that it never makes a NaN
# MuJoCo's bounds of solimp: least, greatest, width, midpoint, power.
IMPEDANCE_BOUNDS = (1e-4, 1e-4, 1e-15, 1e-4, 1.0), (0.9999, 0.9999, np.inf, 0.9999, np.inf)
LEAST_FRICTION = 1e-5  # MuJoCo's mjMINMU


class UnsupportedModel(ValueError):
    """A model that moves out of the plane, or uses what is not implemented. `problems` names each thing."""

    def __init__(self, problems: list[str]):
        self.problems = problems
        super().__init__("not a model of the planar dynamics: " + "; ".join(problems))


@dataclass(frozen=True, eq=False)
class Constraints:
    """Soft constraints' parameters, one entry for each row family (MuJoCo, "Computation: constraint model")."""

    impedance: np.ndarray  # [5, ...] solimp: least, greatest, width, midpoint, power
    stiffness: np.ndarray  # [...] K of the reference acceleration -B v - K I(d) d
    damping: np.ndarray  # [...] B
    diagonal: np.ndarray  # [...] diagApprox: regularisation is diagonal * (1 - I) / I


@dataclass(frozen=True, eq=False)
class Pairs:
    """Capsules of two bodies that can touch each other, without friction. K pairs."""

    slots: np.ndarray  # [2, K] of the first and the second
    radius: np.ndarray  # [2, K]
    margin: np.ndarray  # [K] distance at which a contact begins
    contact: Constraints  # [K]

    @property
    def count(self) -> int:
        """K."""
        return len(self.margin)


@dataclass(frozen=True, eq=False)
class Level:
    """The bodies as many joints away from the root. Level 0 is the root alone."""

    bodies: slice  # among all bodies, in level order
    slots: slice  # among all slots
    slot_body: np.ndarray  # [slots] each slot's body, within the level
    first_slot: np.ndarray  # [bodies] among all slots
    parent: np.ndarray  # [bodies] each body's parent, within the level before (level 0: empty)
    anchor: np.ndarray  # [2, bodies] the hinge's anchor in the parent's frame, metres

    @property
    def count(self) -> int:
        """How many there are."""
        return self.bodies.stop - self.bodies.start

    @property
    def dofs(self) -> slice:
        """The bodies' hinges among all degrees of freedom, which begin with the root's two slides."""
        return slice(self.bodies.start + 2, self.bodies.stop + 2)


@dataclass(frozen=True, eq=False)
class PlanarModel:
    """A tree of bodies that slide and turn in the plane (x, z); rotation about +y. SI units.

    V degrees of freedom in level order: slide x, slide z, the root's hinge, the other hinges.
    """

    timestep: float
    runge_kutta: bool  # of fourth order; otherwise Euler with implicit joint damping
    gravity: float  # downwards
    dofs: np.ndarray  # [V] index in MuJoCo's order of each degree of freedom
    levels: tuple[Level, ...]
    root_position: np.ndarray  # [2] of the root's anchor at zero slides
    angle: np.ndarray  # [bodies] of a body against its parent at zero joint angle
    hinge_sign: np.ndarray  # [bodies] the hinge's direction about +y
    slot_centre: np.ndarray  # [2, slots] centre of mass, in the body's frame
    slot_ends: np.ndarray  # [2, 2 ends, slots] of the capsule, in the body's frame
    slot_mass: np.ndarray  # [slots]
    slot_inertia: np.ndarray  # [slots] about the centre of mass
    contact_distance: np.ndarray  # [slots] height of a capsule end at which its contact begins: its radius and margin
    contact_margin: np.ndarray  # [slots] distance at which a contact begins
    ground: float  # height of the plane
    friction: np.ndarray  # [slots]
    contact: Constraints  # [slots]
    pairs: Pairs
    joint_stiffness: np.ndarray  # [V]
    joint_rest: np.ndarray  # [V]
    joint_damping: np.ndarray  # [V]
    armature: np.ndarray  # [V]
    hinge_range: np.ndarray  # [2, V - 2] far off where unlimited
    limit: Constraints  # [V - 2]
    control_range: np.ndarray  # [2, U]
    actuator_gear: np.ndarray  # [V, U] joint force for one unit of control


class _Slot(NamedTuple):
    body: int
    capsule: int | None
    first: bool  # of its body: it carries the inertia


def compile_model(model: mujoco.MjModel) -> PlanarModel:
    """Return the planar view of a MuJoCo model. Raises UnsupportedModel, naming everything it cannot represent."""
    problems = unsupported(model)
    if problems:
        raise UnsupportedModel(problems)
    bodies, levels = _levels(model)
    slots = [slot for body in bodies for slot in _slots_of(model, body)]
    root = bodies[0]
    return PlanarModel(
        timestep=float(model.opt.timestep),
        runge_kutta=bool(model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4),
        gravity=-float(model.opt.gravity[2]),
        levels=levels,
        root_position=_plane(model.body_pos[root]) + _plane(model.jnt_pos[_hinge(model, root)]) - model.qpos0[:2],
        pairs=_pairs(model, slots),
        **_joints(model, [_hinge(model, body) for body in bodies]),
        **_slots(model, slots),
        **_actuators(model, bodies),
    )


def _joints(model: mujoco.MjModel, hinges: list[int]) -> dict[str, Any]:
    """Return the fields about joints, which are as many as degrees of freedom and share their numbers."""
    dofs = np.array([0, 1, *hinges])
    body = model.jnt_bodyid[hinges]
    sign = model.jnt_axis[hinges, 1]
    limited = np.asarray(model.jnt_limited, bool)[hinges, None]
    return {
        "dofs": dofs,
        "angle": np.array([_angle(quaternion) for quaternion in model.body_quat[body]]) - sign * model.qpos0[hinges],
        "hinge_sign": sign,
        "hinge_range": np.where(limited, model.jnt_range[hinges], (-FAR, FAR)).T,
        "limit": _constraints(
            model.opt, model.jnt_solref[hinges], model.jnt_solimp[hinges], model.dof_invweight0[hinges]
        ),
        "joint_stiffness": model.jnt_stiffness[dofs],
        "joint_rest": model.qpos_spring[dofs],
        "joint_damping": model.dof_damping[dofs],
        "armature": model.dof_armature[dofs],
    }


def _slots(model: mujoco.MjModel, slots: list[_Slot]) -> dict[str, Any]:
    """Return the fields about slots."""
    floor = _floor(model)
    bodies = [slot.body for slot in slots]
    touches = [slot.capsule is not None and collide(model, slot.capsule, floor) for slot in slots]
    capsules = [floor if slot.capsule is None else slot.capsule for slot in slots]
    margin = model.geom_margin[capsules] + model.geom_margin[floor]
    radius = np.where(touches, model.geom_size[capsules, 0], -FAR)
    sliding = [prevailing(model, model.geom_friction[:, 0], capsule, floor) for capsule in capsules]
    friction = np.maximum(LEAST_FRICTION, sliding)
    weight = model.body_invweight0[bodies, 0] + model.body_invweight0[0, 0]
    diagonal = weight * (1 + friction**2) * 2 * friction**2 / model.opt.impratio  # of a pyramidal cone of condim 3
    return {
        "slot_centre": np.stack([_centre(model, body) for body in bodies], axis=-1),
        "slot_ends": np.stack([_ends(model, slot) for slot in slots], axis=-1),
        "slot_mass": np.array([slot.first * model.body_mass[slot.body] for slot in slots]),
        "slot_inertia": np.array([slot.first * _inertia(model, slot.body) for slot in slots]),
        "contact_distance": radius + margin,
        "contact_margin": margin,
        "ground": float(model.geom_pos[floor, 2]),
        "friction": friction,
        "contact": _contact_constraints(model, [(capsule, floor) for capsule in capsules], diagonal),
    }


def _pairs(model: mujoco.MjModel, slots: list[_Slot]) -> Pairs:
    """Return the pairs of slots whose capsules can touch each other."""
    found = [
        (one, other)
        for other, second in enumerate(slots)
        for one, first in enumerate(slots[:other])
        if first.capsule is not None and second.capsule is not None and meet(model, first.capsule, second.capsule)
    ]
    index = np.array(found, int).reshape(-1, 2)
    capsules = [(int(slots[one].capsule or 0), int(slots[other].capsule or 0)) for one, other in found]
    geoms = np.array(capsules, int).reshape(-1, 2).T
    weight = model.body_invweight0[model.geom_bodyid[geoms], 0].sum(axis=0)
    return Pairs(
        slots=index.T,
        radius=model.geom_size[geoms, 0],
        margin=model.geom_margin[geoms].sum(axis=0),
        contact=_contact_constraints(model, capsules, weight),
    )


def _actuators(model: mujoco.MjModel, bodies: list[int]) -> dict[str, Any]:
    """Return the fields about actuators."""
    gear = np.zeros((model.nv, model.nu))
    joints = model.actuator_trnid[:, 0]
    gear[joints, np.arange(model.nu)] = model.actuator_gear[:, 0] * model.actuator_gainprm[:, 0]
    limited = np.asarray(model.actuator_ctrllimited, bool)[:, None]
    return {
        "control_range": np.where(limited, model.actuator_ctrlrange, (-np.inf, np.inf)).T,
        "actuator_gear": gear[[0, 1, *(_hinge(model, body) for body in bodies)]],
    }


def _levels(model: mujoco.MjModel) -> tuple[list[int], tuple[Level, ...]]:
    """Return the bodies in level order, and the levels."""
    rows: list[list[int]] = [[1]]
    while below := [
        body for parent in rows[-1] for body in range(2, model.nbody) if model.body_parentid[body] == parent
    ]:
        rows.append(below)
    levels = []
    bodies = slots = 0
    for depth, row in enumerate(rows):
        counts = [len(_slots_of(model, body)) for body in row]
        above = rows[depth - 1] if depth else []
        parents = [above.index(model.body_parentid[body]) for body in row] if depth else []
        levels.append(
            Level(
                slice(bodies, bodies + len(row)),
                slice(slots, slots + sum(counts)),
                np.repeat(np.arange(len(row)), counts),
                slots + np.cumsum([0, *counts[:-1]]),
                np.array(parents, int),
                np.stack([_anchor(model, body) for body in row], axis=-1) if depth else np.zeros((2, 1)),
            )
        )
        bodies += len(row)
        slots += sum(counts)
    return [body for row in rows for body in row], tuple(levels)


def _hinge(model: mujoco.MjModel, body: int) -> int:
    """Return the joint by which a body turns: its last."""
    return int(model.body_jntadr[body] + model.body_jntnum[body] - 1)


def _slots_of(model: mujoco.MjModel, body: int) -> list[_Slot]:
    """One for each capsule of a body that can touch anything, or one without."""
    geoms = range(model.body_geomadr[body], model.body_geomadr[body] + model.body_geomnum[body])
    capsules: list[int | None] = [geom for geom in geoms if any(meet(model, geom, each) for each in range(model.ngeom))]
    return [_Slot(body, capsule, index == 0) for index, capsule in enumerate(capsules or [None])]


def _floor(model: mujoco.MjModel) -> int:
    planes = np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE)
    return int(planes[0])


def _plane(vector: np.ndarray) -> np.ndarray:
    return np.array([vector[0], vector[2]])


def _angle(quaternion: np.ndarray) -> float:
    """Return the angle about +y of a rotation about y."""
    return 2 * float(np.arctan2(quaternion[2], quaternion[0]))


def _turned(angle: float, vector: np.ndarray) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c * vector[0] + s * vector[1], c * vector[1] - s * vector[0]])


def _anchor(model: mujoco.MjModel, body: int) -> np.ndarray:
    """Return the anchor of a body's hinge in the frame of its parent's hinge."""
    own = _turned(_angle(model.body_quat[body]), _plane(model.jnt_pos[_hinge(model, body)]))
    return _plane(model.body_pos[body]) + own - _plane(model.jnt_pos[_hinge(model, int(model.body_parentid[body]))])


def _inertia(model: mujoco.MjModel, body: int) -> float:
    """Moment of inertia about the y axis through the centre of mass."""
    rotation = np.zeros(9)
    mujoco.mju_quat2Mat(rotation, model.body_iquat[body])
    return float(rotation.reshape(3, 3)[1] ** 2 @ model.body_inertia[body])


def _centre(model: mujoco.MjModel, body: int) -> np.ndarray:
    """Centre of mass [2] in the frame of the body's hinge."""
    return _plane(model.body_ipos[body]) - _plane(model.jnt_pos[_hinge(model, body)])


def _ends(model: mujoco.MjModel, slot: _Slot) -> np.ndarray:
    """Capsule ends [2, 2 ends] in the frame of the body's hinge."""
    if slot.capsule is None:
        return np.zeros((2, 2))
    half = _plane(capsule_axis(model, slot.capsule)) * model.geom_size[slot.capsule, 1]
    middle = _plane(model.geom_pos[slot.capsule]) - _plane(model.jnt_pos[_hinge(model, slot.body)])
    return np.stack([middle + half, middle - half], axis=-1)


def _contact_constraints(model: mujoco.MjModel, pairs: list[tuple[int, int]], diagonal: np.ndarray) -> Constraints:
    """MuJoCo's mixture of the parameters of pairs of geoms [n], and their diagonal [n]."""
    solref, solimp = [np.zeros((0, 2))], [np.zeros((0, 5))]
    for one, other in pairs:
        share = _share(model, one, other)
        solref.append(share * model.geom_solref[[one]] + (1 - share) * model.geom_solref[[other]])
        solimp.append(share * model.geom_solimp[[one]] + (1 - share) * model.geom_solimp[[other]])
    return _constraints(model.opt, np.concatenate(solref), np.concatenate(solimp), diagonal)


def _share(model: mujoco.MjModel, one: int, other: int) -> float:
    """How much of the first geom's parameters a contact takes."""
    priority = model.geom_priority
    if priority[one] != priority[other]:
        return float(priority[one] > priority[other])
    mix = model.geom_solmix
    total = mix[one] + mix[other]
    return float(mix[one] / total) if total > 0 else 0.5


def _constraints(option: mujoco.MjOption, solref: np.ndarray, solimp: np.ndarray, diagonal: np.ndarray) -> Constraints:
    """Stiffness and damping of the reference acceleration, from solref [n, 2] and solimp [n, 5]."""
    time, ratio = solref[:, 0], solref[:, 1]
    if not option.disableflags & mujoco.mjtDisableBit.mjDSBL_REFSAFE:
        time = np.maximum(time, 2 * option.timestep)
    impedance = np.clip(solimp, *IMPEDANCE_BOUNDS)
    greatest = impedance[:, 1]
    return Constraints(
        impedance=impedance.T,
        stiffness=1 / (greatest * time * ratio) ** 2,
        damping=2 / (greatest * time),
        diagonal=np.asarray(diagonal, float),
    )

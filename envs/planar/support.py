"""Which MuJoCo models the planar dynamics can represent. Everything else is refused, by name."""

from collections.abc import Iterator

import mujoco
import numpy as np

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
HARMLESS_DISABLED = mujoco.mjtDisableBit.mjDSBL_REFSAFE | mujoco.mjtDisableBit.mjDSBL_WARMSTART
HARMLESS_ENABLED = mujoco.mjtEnableBit.mjENBL_ENERGY

# What a model must leave at zero: field -> what it would mean. The first axis of a field counts the objects.
ABSENT = {
    "body_gravcomp": "gravity compensation",
    "jnt_margin": "a limit margin",
    "jnt_stiffnesspoly": "a nonlinear spring",
    "jnt_springyield": "a yielding spring",
    "jnt_actfrclimited": "a limited actuator force",
    "jnt_actgravcomp": "gravity compensation",
    "geom_surfacevel": "a surface velocity",
    "geom_adhesion": "adhesion",
    "dof_frictionloss": "dry friction",
    "dof_dampingpoly": "nonlinear damping",
    "actuator_forcelimited": "a force limit",
    "actuator_damping": "damping",
    "actuator_dampingpoly": "nonlinear damping",
    "actuator_armature": "armature",
    "actuator_delay": "a delay",
    "actuator_dyntype": "an activation",
    "actuator_gaintype": "a gain that is not fixed",
    "actuator_biastype": "a bias",
    "actuator_trntype": "a transmission that is not a joint",
}
KIND = {"body": "BODY", "jnt": "JOINT", "geom": "GEOM", "dof": "DOF", "actuator": "ACTUATOR"}
NOT_COUNTED = {
    "neq": "equality constraints",
    "ntendon": "tendons",
    "nflex": "flexible bodies",
    "npair": "explicit contact pairs",
    "nexclude": "excluded contact pairs",
    "nmocap": "mocap bodies",
    "nplugin": "plugins",
    "nplastic": "plastic joints",
    "na": "activations",
}


def unsupported(model: mujoco.MjModel) -> list[str]:
    """Why the planar dynamics cannot represent a model, one sentence for each reason; empty if they can."""
    problems = [*_options(model), *_bodies(model), *_absent(model)]
    # Contacts are looked at body by body, which takes bodies that are where they should be.
    return problems or [*_contacts(model)]


def name(model: mujoco.MjModel, kind: str, index: int) -> str:
    """How a person knows an object: `joint 'rootx'`, or its number."""
    if kind == "DOF":
        kind, index = "JOINT", int(model.dof_jntid[index])
    text = mujoco.mj_id2name(model, getattr(mujoco.mjtObj, f"mjOBJ_{kind}"), index)
    return f"{kind.lower()} {text!r}" if text else f"{kind.lower()} {index}"


def collide(model: mujoco.MjModel, one: int, other: int) -> bool:
    """Whether the types of two geoms let them touch."""
    kind, affinity = model.geom_contype, model.geom_conaffinity
    return bool(kind[one] & affinity[other]) or bool(kind[other] & affinity[one])


def meet(model: mujoco.MjModel, one: int, other: int) -> bool:
    """Whether two geoms can touch: not those of one body, nor of a body that moves and its parent."""
    a, b = int(model.geom_bodyid[one]), int(model.geom_bodyid[other])
    related = a == b or (a and b and (model.body_parentid[a] == b or model.body_parentid[b] == a))
    return not related and collide(model, one, other)


def prevailing(model: mujoco.MjModel, values: np.ndarray, one: int, other: int) -> float:
    """Which of two touching geoms' values their contact has: of the geom with priority, else the greater."""
    priority = model.geom_priority[[one, other]]
    return float(values[[one, other]][priority == priority.max()].max())


def capsule_axis(model: mujoco.MjModel, geom: int) -> np.ndarray:  # [3]
    """Return the direction of a capsule in the frame of its body."""
    direction = np.zeros(3)
    mujoco.mju_rotVecQuat(direction, np.array([0.0, 0.0, 1.0]), model.geom_quat[geom])
    return direction


def _options(model: mujoco.MjModel) -> Iterator[str]:
    option = model.opt
    if option.integrator not in (mujoco.mjtIntegrator.mjINT_EULER, mujoco.mjtIntegrator.mjINT_RK4):
        yield f"integrator {mujoco.mjtIntegrator(option.integrator).name}, neither Euler nor RK4"
    if option.cone != mujoco.mjtCone.mjCONE_PYRAMIDAL:
        yield "an elliptic friction cone, not a pyramidal one"
    if option.gravity[0] or option.gravity[1]:
        yield "gravity that is not along z"
    if option.density or option.viscosity:
        yield "a medium with density or viscosity"
    if option.noslip_iterations:
        yield "noslip iterations"
    if option.disableactuator:
        yield "disabled groups of actuators"
    for flags, harmless, kind in (
        (option.disableflags, HARMLESS_DISABLED, mujoco.mjtDisableBit),
        (option.enableflags, HARMLESS_ENABLED, mujoco.mjtEnableBit),
    ):
        used = flags & ~int(harmless)
        # The last name, mjNDISABLE or mjNENABLE, says how many flags there are.
        yield from (f"flag {bit}" for bit, value in kind.__members__.items() if bit[2] != "N" and used & int(value))
    yield from (f"{getattr(model, field)} {what}" for field, what in NOT_COUNTED.items() if getattr(model, field))


def _absent(model: mujoco.MjModel) -> Iterator[str]:
    for field, what in ABSENT.items():
        kind = KIND[field.partition("_")[0]]
        values = np.asarray(getattr(model, field))
        for index in np.flatnonzero(values.reshape(len(values), -1).any(1)) if len(values) else ():
            yield f"{name(model, kind, int(index))}: {what}"


def _bodies(model: mujoco.MjModel) -> Iterator[str]:
    for body in range(1, model.nbody):
        if (model.body_parentid[body] == 0) != (body == 1):
            yield f"{name(model, 'BODY', body)}: a second tree of bodies"
        if model.body_pos[body, 1] or not _turns_about_y(model.body_quat[body]):
            yield f"{name(model, 'BODY', body)}: out of the plane (x, z)"
        yield from _joints(model, body)
    if model.nbody < 2:
        yield "no body that moves"
    elif not np.allclose(model.body_quat[1], IDENTITY):
        yield f"{name(model, 'BODY', 1)}: turned, so that its slides are"


def _joints(model: mujoco.MjModel, body: int) -> Iterator[str]:
    """Name what is missing: the root has slides along x and z and a hinge about y, another body just such a hinge."""
    slide, hinge = int(mujoco.mjtJoint.mjJNT_SLIDE), int(mujoco.mjtJoint.mjJNT_HINGE)
    wanted = [(slide, (1, 0, 0)), (slide, (0, 0, 1))] if body == 1 else []
    joints = range(model.body_jntadr[body], model.body_jntadr[body] + model.body_jntnum[body])
    if len(joints) != len(wanted) + 1:
        yield f"{name(model, 'BODY', body)}: {len(joints)} joints, not {len(wanted) + 1}"
        return
    for joint, (kind, axis) in zip(joints, [*wanted, (hinge, (0, 1, 0))], strict=True):
        real = model.jnt_axis[joint] if kind == slide else np.abs(model.jnt_axis[joint])
        if model.jnt_type[joint] != kind or not np.allclose(real, axis):
            yield f"{name(model, 'JOINT', joint)}: not a {'slide' if kind == slide else 'hinge'} along {axis}"
        if kind == slide and model.jnt_limited[joint]:
            yield f"{name(model, 'JOINT', joint)}: a limit on a slide"
        if (model.jnt_solref[joint] <= 0).any():
            yield f"{name(model, 'JOINT', joint)}: solref in direct form"


def _contacts(model: mujoco.MjModel) -> Iterator[str]:
    planes = np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE)
    if len(planes) != 1 or model.geom_bodyid[planes[0]] != 0 or not np.allclose(model.geom_quat[planes[0]], IDENTITY):
        yield "not one horizontal ground plane"
        return
    floor = int(planes[0])
    for geom in range(model.ngeom):
        if geom == floor or (model.geom_bodyid[geom] and collide(model, geom, floor)):
            yield from (f"{name(model, 'GEOM', geom)}: {problem}" for problem in _ground_contact(model, geom, floor))
        for other in range(geom):
            if floor not in (geom, other) and meet(model, geom, other):
                both = f"{name(model, 'GEOM', other)} and {name(model, 'GEOM', geom)}"
                yield from (
                    f"{both}: touch each other, and {problem}" for problem in _mutual_contact(model, geom, other)
                )


def _ground_contact(model: mujoco.MjModel, geom: int, floor: int) -> Iterator[str]:
    if (model.geom_solref[geom] <= 0).any():
        yield "solref in direct form"
    if geom == floor:
        return
    if model.geom_type[geom] != mujoco.mjtGeom.mjGEOM_CAPSULE:
        yield "not a capsule, and touches the ground"
    elif _leans(model, geom):
        yield "out of the plane (x, z)"
    if prevailing(model, model.geom_condim, geom, floor) != 3:
        yield "condim is not 3"


def _mutual_contact(model: mujoco.MjModel, one: int, other: int) -> Iterator[str]:
    geoms = [one, other]
    if not model.geom_bodyid[geoms].all():
        yield "one of them is of the world"
        return
    if (model.geom_type[geoms] != mujoco.mjtGeom.mjGEOM_CAPSULE).any():
        yield "not both are capsules"
    elif any(_leans(model, geom) for geom in geoms) or not np.isclose(*model.geom_pos[geoms, 1]):
        yield "not in one plane"
    if prevailing(model, model.geom_condim, one, other) != 1:
        yield "condim is not 1"
    if (model.geom_solref[geoms] <= 0).any():
        yield "solref is in direct form"


def _leans(model: mujoco.MjModel, capsule: int) -> bool:
    return bool(abs(capsule_axis(model, capsule)[1]) > 1e-12)


def _turns_about_y(quaternion: np.ndarray) -> bool:
    return bool(np.allclose(quaternion[[1, 3]], 0.0, atol=1e-12))

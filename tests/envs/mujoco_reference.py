"""MuJoCo C's own numbers for planar models: the stages of a step, as arrays laid out as `envs.planar` lays out its own.

Everything is in float64, in MuJoCo's joint order where it is about joints, and about the root's anchor where it is
about points.
"""

from typing import NamedTuple

import mujoco
import numpy as np

from benchmarks.runner_states import converged
from envs.mujoco_model import load_model, quiet_mujoco


class States(NamedTuple):
    """N states of a model, and the controls at each."""

    qpos: np.ndarray  # [N, V]
    qvel: np.ndarray  # [N, V]
    control: np.ndarray  # [N, U]


class Stages(NamedTuple):
    """What MuJoCo computes on its way through a step from each of N states. C capsules, bodies from 1."""

    anchor: np.ndarray  # [N, bodies, 2] of the hinges about the root's
    centre: np.ndarray  # [N, bodies, 2] of mass, about the root's anchor
    end: np.ndarray  # [N, C, 2 ends, 2] of the capsules, about the root's anchor
    fall: np.ndarray  # [N, V] acceleration under gravity and the bias force alone
    response: np.ndarray  # [N, V] acceleration at rest, without gravity, under the velocity's numbers taken as forces
    contact_position: np.ndarray  # [N, C, 2 ends, 2] about the root's anchor; 0 where nothing touches
    contact_distance: np.ndarray  # [N, C, 2 ends]
    contact_strength: np.ndarray  # [N, C, 2 ends] efc_D
    contact_reference: np.ndarray  # [N, C, 2 ends, 2] efc_aref of the edges that lean along +x and -x
    limit_strength: np.ndarray  # [N, V] efc_D
    limit_reference: np.ndarray  # [N, V] efc_aref
    mutual_strength: np.ndarray  # [N, K pairs] efc_D of capsules that touch each other
    mutual_reference: np.ndarray  # [N, K] efc_aref
    qacc: np.ndarray  # [N, V]
    next_qpos: np.ndarray  # [N, V]
    next_qvel: np.ndarray  # [N, V]


def cheetah() -> mujoco.MjModel:
    """The half cheetah, with a converged solver."""
    return converged(load_model("half_cheetah"))


def from_xml(text: str) -> mujoco.MjModel:
    """A model of MJCF text, with a converged solver."""
    with quiet_mujoco():
        return converged(mujoco.MjModel.from_xml_string(text))


def stages(model: mujoco.MjModel, states: States) -> Stages:
    """Every state's stages."""
    data = mujoco.MjData(model)
    found = [_stages(model, data, *row) for row in zip(*states, strict=True)]
    return Stages(*(np.stack(stage) for stage in zip(*found, strict=True)))


def _stages(model, data, qpos, qvel, control):
    _put(model, data, qpos, qvel, control)
    mujoco.mj_forward(model, data)
    hinges = model.body_jntadr[1:] + model.body_jntnum[1:] - 1
    origin = data.xanchor[hinges[0]]
    capsules = capsules_of(model)
    axis = data.geom_xmat[capsules].reshape(-1, 3, 3)[:, None, :, 2] * model.geom_size[capsules, 1, None, None]
    ends = data.geom_xpos[capsules][:, None] + np.array([1, -1])[:, None] * axis
    inverted = np.zeros((2, model.nv))
    mujoco.mj_solveM(model, data, inverted, np.stack([-data.qfrc_bias, data.qvel]))
    found = (
        _plane(data.xanchor[hinges] - origin),
        _plane(data.xipos[1:] - origin),
        _plane(ends - origin),
        *inverted,
        *_contacts(model, data, ends, origin),
        *_limits(model, data),
        *_mutual(model, data),
        data.qacc.copy(),
    )
    mujoco.mj_step(model, data)
    return (*found, data.qpos.copy(), data.qvel.copy())


def capsules_of(model: mujoco.MjModel) -> np.ndarray:
    """Ids of the capsules that can touch the ground."""
    floor = floor_of(model)
    meets = (model.geom_contype & model.geom_conaffinity[floor]) | (model.geom_conaffinity & model.geom_contype[floor])
    return np.flatnonzero((model.geom_bodyid > 0) & (meets > 0))


def floor_of(model: mujoco.MjModel) -> int:
    """Id of the ground."""
    return int(np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE)[0])


def pairs_of(model: mujoco.MjModel) -> list[tuple[int, int]]:
    """Ids of the capsules that can touch each other, the second ascending, then the first."""
    capsules = np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_CAPSULE).tolist()
    return [(one, other) for other in capsules for one in capsules if one < other and _can_touch(model, one, other)]


def _can_touch(model, one, other):
    first, second = model.geom_bodyid[[one, other]]
    kin = first == second or model.body_parentid[first] == second or model.body_parentid[second] == first
    kind, affinity = model.geom_contype, model.geom_conaffinity
    return not kin and bool(kind[one] & affinity[other] or kind[other] & affinity[one])


def _put(model, data, qpos, qvel, control):
    mujoco.mj_resetData(model, data)
    data.qpos[:], data.qvel[:], data.ctrl[:] = qpos, qvel, control


def _plane(points):
    return points[..., [0, 2]]


def _contacts(model, data, ends, origin):
    """Contact position, distance, strength and reference of every capsule's end, found among MuJoCo's contacts."""
    capsules = capsules_of(model).tolist()
    shape = (len(capsules), 2)
    position, distance, strength, reference = (np.zeros((*shape, *more)) for more in ((2,), (), (), (2,)))
    floor = floor_of(model)
    for contact in data.contact:
        if contact.exclude or floor not in contact.geom:
            continue
        capsule = capsules.index(max(contact.geom))
        radius = model.geom_size[max(contact.geom), 0]
        middle = ends[capsule] - np.array([0, 0, 1]) * (radius + 0.5 * contact.dist)  # of the overlap, were it this end
        at = capsule, int(np.argmin(np.abs(middle - contact.pos).sum(1)))
        position[at], distance[at] = _plane(contact.pos - origin), contact.dist
        rows = slice(contact.efc_address, contact.efc_address + 4)
        strength[at] = data.efc_D[rows][0]
        tangent = contact.frame.reshape(3, 3)[1:, 0]  # of its two, the one that lies along x, and which way
        along = 2 * int(np.argmax(np.abs(tangent)))
        order = [along, along + 1] if tangent.sum() > 0 else [along + 1, along]
        reference[at] = data.efc_aref[rows][order]
    return position, distance, strength, reference


def _mutual(model, data):
    """Strength and reference of every pair of capsules; of the contact that comes first, were there two."""
    pairs = pairs_of(model)
    strength, reference = np.zeros(len(pairs)), np.zeros(len(pairs))
    for contact in reversed(data.contact):
        row, geoms = contact.efc_address, tuple(sorted(contact.geom))
        # Axes that cross give a direction out of the plane, and a row without effect.
        if geoms in pairs and row >= 0 and np.abs(contact.frame[1]) < 0.5:
            strength[pairs.index(geoms)], reference[pairs.index(geoms)] = data.efc_D[row], data.efc_aref[row]
    return strength, reference


def _limits(model, data):
    """Strength and reference of every joint's limit."""
    strength, reference = np.zeros(model.nv), np.zeros(model.nv)
    for row in np.flatnonzero(data.efc_type == mujoco.mjtConstraint.mjCNSTR_LIMIT_JOINT):
        joint = data.efc_id[row]
        strength[joint], reference[joint] = data.efc_D[row], data.efc_aref[row]
    return strength, reference

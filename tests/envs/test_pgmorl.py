"""The runners of PGMORL's authors: what differs from Gymnasium's models, and steps against MuJoCo C by their rules."""

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from envs.mujoco_model import load_model
from envs.pgmorl import PgmorlHalfCheetah, PgmorlHopper, PgmorlHopper3, PgmorlWalker2d
from envs.physics import BodyState

RUNNERS = [PgmorlHalfCheetah, PgmorlWalker2d, PgmorlHopper, PgmorlHopper3]


def square(action):
    return float((action**2).sum())


# The authors' rewards and ends: of the speed, the joints' positions, the torso's height at the start, and the action.
def cheetah(speed, qpos, start, action):
    return [min(4, speed) + 1, 5 - square(action)], not abs(qpos[2]) < np.deg2rad(50)


def walker(speed, qpos, start, action):
    return [speed + 1, 5 - square(action)], not (0.8 < qpos[1] < 2 and -1 < qpos[2] < 1)


def tumbled(qpos):
    return not (qpos[1] > 0.4 and (np.abs(qpos[2:6]) < np.deg2rad(90)).all())


def hopper(speed, qpos, start, action):
    others = 1 - 2e-4 * square(action)
    return [1.5 * speed + others, 12 * (qpos[1] - start) + others], tumbled(qpos)


def hopper_of_three(speed, qpos, start, action):
    return [1.5 * speed + 1, 12 * (qpos[1] - start) + 1, 5 - square(action)], tumbled(qpos)


RULES = dict(zip(RUNNERS, [cheetah, walker, hopper, hopper_of_three], strict=True))
FRAME_SKIP = dict(zip(RUNNERS, [5, 4, 5, 5], strict=True))


@pytest.fixture(params=RUNNERS, scope="module", ids=[runner.id for runner in RUNNERS])
def runner(request):
    return request.param


def differences(model, other):
    """Names of the arrays in which two models differ, but for what the compiler works out from others."""
    worked_out = {"actuator_acc0", "body_margin", "body_inertia", "body_invweight0", "body_subtreemass", "cam_poscom0"}
    worked_out |= {"dof_M0", "dof_invweight0", "light_poscom0"}
    names = [name for name in dir(model) if isinstance(getattr(model, name, None), np.ndarray)]
    return {name for name in names if not np.array_equal(getattr(model, name), getattr(other, name))} - worked_out


def test_all_that_differs_from_gymnasiums_model_is_known(runner):
    model, gymnasiums = runner().model, load_model(runner.model_name)
    expected = {
        PgmorlHalfCheetah: set(),
        PgmorlWalker2d: {"body_mass", "dof_damping", "geom_friction"},
        PgmorlHopper: {"geom_margin", "dof_damping", "jnt_limited", "jnt_range", "actuator_gear", "actuator_ctrlrange"},
    }
    expected[PgmorlHopper3] = expected[PgmorlHopper]
    assert differences(model, gymnasiums) == expected[runner]
    if runner is PgmorlWalker2d:
        np.testing.assert_allclose(model.body_mass, 1.5 * gymnasiums.body_mass)
        np.testing.assert_array_equal(model.dof_damping, [0, 0, 0, 3, 3, 3, 3, 3, 3])
        feet = [model.geom(name).friction[0] for name in ("foot_geom", "foot_left_geom")]
        assert feet == [0.9, 1.9]
        assert np.count_nonzero(model.geom_friction != gymnasiums.geom_friction) == 1
    elif runner is not PgmorlHalfCheetah:
        np.testing.assert_array_equal(model.dof_damping, [0, 0, 0, 40, 40, 40])
        np.testing.assert_array_equal(model.actuator_gear[:, 0], [200, 200, 300])
        np.testing.assert_array_equal(model.actuator_ctrlrange, [[-2, 2], [-2, 2], [-4, 4]])
        assert not model.jnt_limited.any()
        data = mujoco.MjData(model)
        data.qpos[1] -= 1.25 - 0.9
        mujoco.mj_forward(model, data)
        assert {contact.includemargin for contact in data.contact} == {0.001}


def test_every_episode_starts_where_the_model_does(runner):
    environment = runner()
    for seed in range(2):
        state = environment.initial_state(jax.random.key(seed))
        np.testing.assert_array_equal(state.qpos, environment.model.qpos0.astype(np.float32))
        assert not state.qvel.any()


def test_steps_are_the_authors(runner):
    """From the same states, which random actions lead to; most episodes end by a fall."""
    environment = runner()
    generator, data = np.random.default_rng(0), mujoco.MjData(environment.model)
    skip, low, high = FRAME_SKIP[runner], environment.action_low, environment.action_high
    rows = []
    for _ in range(6):
        mujoco.mj_resetData(environment.model, data)
        tilt = generator.uniform(-0.6, 0.6) if runner is PgmorlHalfCheetah else 0
        data.qpos[2] += tilt
        for _ in range(60):
            action = generator.uniform(1.2 * np.asarray(low), 1.2 * np.asarray(high), environment.action_size)
            before = data.qpos.astype(np.float32), data.qvel.astype(np.float32)
            data.qpos[:], data.qvel[:] = before
            data.ctrl[:] = np.clip(action, low, high)
            mujoco.mj_step(environment.model, data, skip)
            speed = (data.qpos[0] - before[0][0]) / (skip * environment.model.opt.timestep)
            reward, ended = RULES[runner](speed, data.qpos, environment.model.qpos0[1], data.ctrl)
            rows.append((*before, action.astype(np.float32), reward, ended))
    qpos, qvel, action, reward, ended = (np.stack(column) for column in zip(*rows, strict=True))
    found = jax.jit(jax.vmap(environment.transition))(BodyState(jnp.asarray(qpos), jnp.asarray(qvel)), action)
    np.testing.assert_allclose(found.reward, reward, rtol=1e-4, atol=1e-3)
    np.testing.assert_array_equal(found.terminated, ended)
    assert 0.02 < ended.mean() < 0.98


def test_no_return_is_above_what_is_declared():
    """The best of the half cheetah's is 2,500 of each: the corner of the published hypervolumes' bound of 6.25e6."""
    speed, energy = PgmorlHalfCheetah.objectives
    assert speed.highest == energy.highest == 2500
    assert PgmorlHopper3.objectives[2].highest == PgmorlWalker2d.objectives[1].highest == 2500

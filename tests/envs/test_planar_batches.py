"""The planar dynamics under every kind of batching: each state as if it were alone."""

from functools import partial

import jax
import numpy as np
import pytest
from jax.sharding import Mesh, PartitionSpec

from envs.physics import BodyState
from envs.planar import PlanarPhysics
from envs.planar.physics import BLOCK
from tests.envs.mujoco_reference import from_xml
from tests.envs.planar_stages import QUICK_TO_COMPILE
from tests.envs.small_models import FLAIL, PENDULUM, TANGLE, states_near_the_ground

MODEL = from_xml(FLAIL)
PHYSICS = PlanarPhysics(MODEL)
COUNT, SUBSTEPS = 24, 3


def advance(qpos, qvel, control):
    """Some time steps of one state."""
    state, displacement = PHYSICS.advance(BodyState(qpos, qvel), control, SUBSTEPS)
    return state.qpos, state.qvel, displacement


compiled = partial(jax.jit, compiler_options=QUICK_TO_COMPILE)
batched = compiled(jax.vmap(advance))


@pytest.fixture(autouse=True, scope="module")
def float64():
    """Enough digits to tell rounding from mistakes."""
    with jax.enable_x64(True):
        yield


@pytest.fixture(scope="module")
def states():
    """Positions, velocities and controls; many touch the ground or are at a limit."""
    return states_near_the_ground(MODEL, COUNT, seed=0)


def each_alone(states):
    """A loop over the states."""
    alone = compiled(advance)
    return tuple(np.stack(column) for column in zip(*(alone(*row) for row in zip(*states, strict=True)), strict=True))


@pytest.fixture(scope="module")
def alone(states):
    return each_alone(states)


def assert_same(found, expected):
    for ours, theirs in zip(found, expected, strict=True):
        np.testing.assert_allclose(np.asarray(ours).reshape(theirs.shape), theirs, rtol=1e-9, atol=1e-9)


def folded(states):
    """The states as 2 x 12."""
    return tuple(each.reshape(2, COUNT // 2, -1) for each in states)


def test_vmap_is_a_loop(states, alone):
    assert_same(batched(*states), alone)


def test_nested_vmaps_are_a_loop(states, alone):
    assert_same(compiled(jax.vmap(jax.vmap(advance)))(*folded(states)), alone)


def test_vmap_over_another_axis_is_a_loop(states, alone):
    across = compiled(jax.vmap(jax.vmap(advance), in_axes=1, out_axes=1))
    assert_same(across(*folded(states)), alone)


def test_vmap_over_one_argument_is_a_loop(states):
    qpos, qvel, control = states
    shared = compiled(jax.vmap(advance, in_axes=(None, None, 0)))(qpos[3], qvel[3], control)
    repeated = (np.tile(qpos[3], (COUNT, 1)), np.tile(qvel[3], (COUNT, 1)), control)
    assert_same(shared, each_alone(repeated))


def test_two_devices_are_one(states, alone):
    axis = PartitionSpec("device")
    mesh = Mesh(jax.devices()[:2], ("device",))
    assert_same(compiled(jax.shard_map(jax.vmap(advance), mesh=mesh, in_specs=axis, out_specs=axis))(*states), alone)


def test_bodies_that_touch_each_other_do_so_on_each_device_and_in_each_place():
    """Where some states of a batch have pairs that touch, and others have none."""
    model = from_xml(TANGLE)
    states = states_near_the_ground(model, COUNT, seed=1)
    physics = PlanarPhysics(model)

    def advance(qpos, qvel, control):
        state, displacement = physics.advance(BodyState(qpos, qvel), control, SUBSTEPS)
        return state.qpos, state.qvel, displacement

    together, alone = compiled(jax.vmap(advance)), compiled(advance)
    each = [alone(*row) for row in zip(*states, strict=True)]
    expected = tuple(np.stack(column) for column in zip(*each, strict=True))
    assert_same(together(*states), expected)
    mesh, axis = Mesh(jax.devices()[:2], ("device",)), PartitionSpec("device")
    spread = compiled(jax.shard_map(jax.vmap(advance), mesh=mesh, in_specs=axis, out_specs=axis))
    assert_same(spread(*states), expected)
    np.testing.assert_allclose(expected[2], expected[0] - states.qpos, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("size", [BLOCK + 1, 2 * BLOCK + 5])
def test_batches_of_several_blocks_are_a_loop(size, states, alone):
    again = np.arange(size) % COUNT
    assert_same(batched(*(each[again] for each in states)), tuple(each[again] for each in alone))


@pytest.mark.parametrize("neighbour", [0.0, 30.0, np.nan])
def test_a_state_is_in_nobodys_way(neighbour, states):
    """Neighbours at rest, wild ones and those that are not even numbers leave every bit of a state's result."""
    expected = batched(*states)
    others = tuple(np.where(np.arange(COUNT)[:, None] % 2 == 0, each, neighbour) for each in states)
    for found, wanted in zip(batched(*others), expected, strict=True):
        np.testing.assert_array_equal(found[::2], wanted[::2])


def test_displacement_is_what_each_time_step_adds(states, alone):
    """Also where the position itself has no digits left for it."""
    qpos, qvel, control = states
    once = compiled(jax.vmap(lambda *state: PHYSICS.advance(BodyState(*state[:2]), state[2], 1)))
    far = qpos + np.array([1e17, 0, 0, 0])
    state, moved = BodyState(far, qvel), 0.0
    for _ in range(SUBSTEPS):
        state, displacement = once(state.qpos, state.qvel, control)
        np.testing.assert_allclose(displacement, MODEL.opt.timestep * state.qvel, rtol=1e-12)
        moved = moved + displacement
    np.testing.assert_allclose(moved, alone[2], rtol=1e-9, atol=1e-12)
    np.testing.assert_array_equal(state.qpos[:, 0], far[:, 0])


def test_a_model_without_capsules_or_limits_gives_numbers():
    """What is absent is far off, and never a difference of infinities."""
    physics = PlanarPhysics(from_xml(PENDULUM))
    advance = compiled(lambda state: physics.advance(state, np.zeros(0), 2))
    for height in (0.0, 1e4, -1e4):
        state = BodyState(np.array([0, height, 1, 2, 3]), np.full(5, 10.0))
        after, _ = advance(state)
        assert np.isfinite(after.qpos).all() and np.isfinite(after.qvel).all()

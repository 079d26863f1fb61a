"""The planar dynamics of the half cheetah against MuJoCo's own, stage by stage."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from benchmarks.runner_states import FAR, RUNNERS, Steps, kinds_of, runner_of, steps_of
from envs.planar import solver
from envs.planar.kinematics import cos_sin
from envs.planar.model import compile_model
from tests.envs.mujoco_reference import Stages, States, cheetah, stages
from tests.envs.planar_stages import QUICK_TO_COMPILE, forwarded, one_step, planar_stages, relative_difference

CHEETAH = RUNNERS[0]
MODEL = cheetah()
COUNT = 800


def states_of(steps: Steps) -> States:
    return States(steps.qpos, steps.qvel, steps.control)


@pytest.fixture(scope="module")
def visited():
    """About `COUNT` time steps of each kind."""
    parts = [steps_of(CHEETAH, kind, COUNT, seed) for seed, kind in enumerate(kinds_of(CHEETAH))]
    return Steps(*(np.concatenate(column) for column in zip(*parts, strict=True)))


@pytest.fixture(scope="module")
def both(visited):
    """Our stages and MuJoCo's."""
    return planar_stages(MODEL, states_of(visited)), stages(MODEL, states_of(visited))


@pytest.mark.parametrize("stage", [each for each in Stages._fields if not each.startswith("mutual")])
def test_every_stage_is_mujocos(stage, both):
    ours, theirs = (getattr(each, stage) for each in both)
    assert np.count_nonzero(theirs) > 500
    assert relative_difference(ours, theirs).max() < 1e-9


@pytest.fixture(scope="module")
def single(visited):
    """One time step by us in float32."""
    return one_step(MODEL, states_of(visited), np.float32)


def errors(qvel, steps: Steps) -> np.ndarray:  # [N]
    """Greatest velocity error of each state, none of them large beside the state's speed."""
    error: np.ndarray = np.abs(qvel - steps.next_qvel).max(axis=1)
    assert (error / np.maximum(1, np.abs(steps.next_qvel).max(axis=1))).max() < 1e-3
    return error


def test_velocities_in_single_precision(single, visited):
    error = errors(single.qvel, visited)
    assert np.median(error) < 1e-5
    assert error.max() < 1e-3


def test_far_away_only_x_loses_digits(single, visited):
    far = visited.qpos[:, 0] > 0.9 * FAR
    assert far.sum() >= COUNT
    assert np.quantile(np.abs(single.qvel - visited.next_qvel)[far].max(axis=1), 0.999) < 1e-3
    np.testing.assert_allclose(single.qpos[:, 1:], visited.next_qpos[:, 1:], atol=1e-4)
    error = np.abs(single.qpos[:, 0] - visited.next_qpos[:, 0])
    assert error[far].max() <= np.spacing(np.float32(FAR))  # half of it where it begins, and half where it ends
    assert error[~far].max() < 1e-5


@pytest.mark.slow
@pytest.mark.parametrize("id", RUNNERS)
def test_a_hundred_thousand_states(id):
    kinds = kinds_of(id)
    parts = [steps_of(id, kind, 100_000 // len(kinds), seed=100) for kind in kinds]
    steps = Steps(*(np.concatenate(column) for column in zip(*parts, strict=True)))
    model = runner_of(id).model
    error = np.abs(one_step(model, states_of(steps), np.float32).qvel - steps.next_qvel).max(axis=1)
    assert np.median(error) < 1e-5
    assert np.quantile(error, 0.999) < 1e-3
    after = one_step(model, states_of(steps), np.float64)
    apart = np.maximum(
        relative_difference(after.qvel, steps.next_qvel), relative_difference(after.qpos, steps.next_qpos)
    )
    # Where two capsules are parallel, MuJoCo has two contacts and `envs.planar` one: few of those folded up.
    assert np.mean(apart > 1e-9) <= (1e-4 if "self-contact" in kinds else 0)


def test_newton_needs_few_steps(visited):
    """In all of the batch together, as a batch goes on until its last state has arrived."""
    model = compile_model(MODEL)
    with jax.enable_x64(True):
        program = jax.jit(lambda *state: forwarded(model, *state).solution.steps, compiler_options=QUICK_TO_COMPILE)
        assert 4 < program(*states_of(visited)) <= 12 < solver.MAXIMAL_STEPS


def test_cosine_and_sine_in_single_precision():
    generator = np.random.default_rng(0)
    angles = np.concatenate([generator.uniform(-10, 10, 20_000), generator.uniform(-1e4, 1e4, 20_000)])
    angles = np.concatenate([angles, np.arange(-400, 400) * (np.pi / 4)]).astype(np.float32)
    cosine, sine = jax.jit(cos_sin)(jnp.asarray(angles))
    exact = angles.astype(np.float64)
    np.testing.assert_allclose(cosine, np.cos(exact), atol=2e-7, rtol=0)
    np.testing.assert_allclose(sine, np.sin(exact), atol=2e-7, rtol=0)

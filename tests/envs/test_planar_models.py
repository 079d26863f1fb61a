"""Other models than the half cheetah in the planar dynamics: equal to MuJoCo, or refused by name."""

import jax
import numpy as np
import pytest

from envs.mujoco_model import load_model
from envs.physics import BodyState
from envs.planar import PlanarPhysics, UnsupportedModel, solver
from envs.planar.model import compile_model
from tests.envs.mujoco_reference import States, from_xml
from tests.envs.planar_stages import QUICK_TO_COMPILE, assert_agrees, forwarded, relative_difference
from tests.envs.small_models import FLAIL, MIXTURE, PENDULUM, ROD, TANGLE, TREE, states_near_the_ground


@pytest.mark.parametrize(
    ("text", "touching", "at_limits"),
    [(ROD, 0.3, 0.0), (FLAIL, 0.3, 0.2), (TREE, 0.3, 0.5), (MIXTURE, 0.5, 0.3), (PENDULUM, 0.0, 0.0)],
    ids=["rod", "flail", "tree", "mixture", "pendulum"],
)
def test_every_stage_is_mujocos(text, touching, at_limits):
    model = from_xml(text)
    expected = assert_agrees(model, states_near_the_ground(model, 500, seed=0), tolerance=1e-9)
    assert (expected.contact_strength > 0).any((1, 2)).mean() >= touching
    assert (expected.limit_strength > 0).any(1).mean() >= at_limits


@pytest.mark.parametrize("option", ['integrator="RK4"', 'integrator="Euler"'])
def test_bodies_touch_each_other_as_mujocos(option):
    """Up to four pairs at once."""
    model = from_xml(TANGLE.replace('integrator="RK4"', option))
    expected = assert_agrees(model, states_near_the_ground(model, 500, seed=0), tolerance=1e-9)
    pairs = (expected.mutual_strength > 0).sum(1)
    assert (pairs > 0).mean() > 0.3 and pairs.max() >= 4
    assert ((pairs > 0) & (expected.contact_strength > 0).any((1, 2))).mean() > 0.05


def test_steps_of_runge_and_kutta_are_mujocos():
    """Damping is not implicit in them, and margins make no difference to where a contact is."""
    margins = (
        '<option integrator="RK4" ',
        'conaffinity="0" margin="0.03" gap="0.1"/>',
        '<geom name="floor" margin="0.02" ',
    )
    text = TREE
    for old, new in zip(("<option ", 'conaffinity="0"/>', '<geom name="floor" '), margins, strict=True):
        assert old in text
        text = text.replace(old, new, 1)
    model = from_xml(text)
    expected = assert_agrees(model, states_near_the_ground(model, 500, seed=4), tolerance=1e-9)
    assert (expected.contact_distance > 0).any((1, 2)).mean() > 0.01


@pytest.fixture(scope="module")
def hard():
    """States of the tree; full steps alone cycle for about one of 500."""
    model = from_xml(TREE)
    return compile_model(model), states_near_the_ground(model, 5000, seed=1)


def newton(model, states: States) -> tuple[np.ndarray, np.ndarray]:
    """Steps of Newton's method [N] and accelerations [N, V], every state alone."""

    def alone(*state):
        solution = forwarded(model, *(each[None] for each in state)).solution
        return solution.steps, solution.qacc[:, 0]

    with jax.enable_x64(True):
        return jax.device_get(jax.jit(jax.vmap(alone), compiler_options=QUICK_TO_COMPILE)(*states))


def test_what_full_steps_cycle_about_half_steps_settle(hard, monkeypatch):
    counts, qacc = newton(*hard)
    assert counts.max() < solver.MAXIMAL_STEPS
    monkeypatch.setattr(solver, "FULL_STEPS", solver.MAXIMAL_STEPS)
    full_counts, unsettled = newton(*hard)
    cycling = full_counts == solver.MAXIMAL_STEPS
    assert 3 <= cycling.sum() <= 50
    assert relative_difference(unsettled[cycling], qacc[cycling]).max() > 0.01
    np.testing.assert_allclose(unsettled[~cycling], qacc[~cycling], rtol=1e-9, atol=1e-9)


def test_half_steps_alone_find_the_same_accelerations(hard, monkeypatch):
    counts, qacc = newton(*hard)
    monkeypatch.setattr(solver, "FULL_STEPS", 1)
    slower, same = newton(*hard)
    assert slower.max() < solver.MAXIMAL_STEPS
    assert slower.mean() > counts.mean()
    np.testing.assert_allclose(same, qacc, rtol=1e-9, atol=1e-9)


def test_the_cycling_states_are_mujocos_too(hard):
    """What half steps settle on is the constrained acceleration, by MuJoCo's own solver."""
    model, states = hard
    counts, _ = newton(model, states)
    longest = np.argsort(counts)[-100:]
    assert_agrees(from_xml(TREE), States(*(each[longest] for each in states)), tolerance=1e-9)


# ---------------------------------------------------------------- refusals


BEGIN, LAST, END = "<mujoco>", "</worldbody>", "</mujoco>"
X, JOINT, MOTOR = 'type="slide" axis="1 0 0"', '<joint name="swing" axis="0 1 0"', '<motor name="swing" joint="swing"'
HEAD, FLOOR, BODY = '<geom name="head"', '<geom name="floor" type="plane"', '<body name="head" pos="0.3 0 0"'

# What is said of the flail after a text in it is replaced by another.
REFUSED = [
    ("integrator mjINT_IMPLICIT", BEGIN, BEGIN + '<option integrator="implicit"/>'),
    ("elliptic friction cone", BEGIN, BEGIN + '<option cone="elliptic"/>'),
    ("gravity that is not along z", BEGIN, BEGIN + '<option gravity="1 0 -9.81"/>'),
    ("medium with density or viscosity", BEGIN, BEGIN + '<option density="1.2"/>'),
    ("medium with density or viscosity", BEGIN, BEGIN + '<option viscosity="0.1"/>'),
    ("noslip iterations", BEGIN, BEGIN + '<option noslip_iterations="3"/>'),
    ("disabled groups of actuators", BEGIN, BEGIN + '<option actuatorgroupdisable="1"/>'),
    ("flag mjDSBL_EULERDAMP", BEGIN, BEGIN + '<option><flag eulerdamp="disable"/></option>'),
    ("flag mjENBL_OVERRIDE", BEGIN, BEGIN + '<option><flag override="enable"/></option>'),
    ("1 equality constraints", END, '<equality><joint joint1="swing"/></equality>' + END),
    ("1 tendons", END, '<tendon><fixed><joint joint="swing" coef="1"/></fixed></tendon>' + END),
    ("1 explicit contact pairs", END, '<contact><pair geom1="head" geom2="floor"/></contact>' + END),
    ("1 excluded contact pairs", END, '<contact><exclude body1="head" body2="world"/></contact>' + END),
    ("1 mocap bodies", LAST, '<body mocap="true"/>' + LAST),
    ("1 activations", MOTOR, '<general dyntype="integrator" joint="swing"'),
    ("actuator 'servo': a bias", MOTOR, '<position name="servo" kp="2" joint="swing"'),
    ("actuator 'swing': a force limit", MOTOR, MOTOR + ' forcerange="-1 1" forcelimited="true"'),
    (
        "actuator 'swing': a transmission that is not a joint",
        '<motor name="swing" joint="swing" gear="5"',
        '<adhesion name="swing" body="head" ctrlrange="0 1"',
    ),
    ("body 'head': out of the plane", BODY, '<body name="head" pos="0.3 0.1 0"'),
    ("body 'head': out of the plane", BODY, BODY + ' euler="10 0 0"'),
    ("body 'handle': turned, so that its slides are", 'pos="0 0 0.3"', 'pos="0 0 0.3" euler="0 10 0"'),
    ("body 'other': a second tree of bodies", LAST, '<body name="other"><geom size="1 1"/></body>' + LAST),
    ("body 'head': gravity compensation", BODY, BODY + ' gravcomp="1"'),
    ("body 'head': 2 joints, not 1", JOINT, '<joint axis="0 1 0"/>' + JOINT),
    ("body 'handle': 2 joints, not 3", f'<joint name="x" {X}/>', ""),
    ("joint 'x': not a slide along (1, 0, 0)", X, 'type="slide" axis="0 1 0"'),
    ("joint 'x': a limit on a slide", X, X + ' limited="true" range="-1 1"'),
    ("joint 'swing': not a hinge along (0, 1, 0)", JOINT, '<joint name="swing" axis="0 1 0.1"'),
    ("body 'head': 2 joints, not 1", JOINT, '<joint name="other" axis="0 1 0"/>' + JOINT),
    ("joint 'swing': not a hinge along (0, 1, 0)", JOINT, '<joint name="swing" type="slide" axis="1 0 0"'),
    ("joint 'swing': solref in direct form", JOINT, JOINT + ' solreflimit="-100 -1"'),
    ("joint 'swing': a limit margin", JOINT, JOINT + ' margin="0.1"'),
    ("joint 'swing': dry friction", JOINT, JOINT + ' frictionloss="0.1"'),
    ("joint 'swing': a limited actuator force", JOINT, JOINT + ' actuatorfrcrange="-1 1"'),
    ("not one horizontal ground plane", FLOOR, '<geom size="9 9 1" type="plane"/>' + FLOOR),
    ("not one horizontal ground plane", FLOOR, FLOOR + ' euler="0 5 0"'),
    ("geom 'floor': solref in direct form", FLOOR, FLOOR + ' solref="-100 -1"'),
    ("geom 'head': solref in direct form", HEAD, HEAD + ' solref="-100 -1"'),
    ("geom 'head': condim is not 3", HEAD, HEAD + ' condim="4"'),
    ("geom 'head': condim is not 3", HEAD, HEAD + ' condim="1" priority="1"'),
    ("geom 'ball': not a capsule, and touches the ground", HEAD, '<geom name="ball" type="sphere"/>' + HEAD),
    ("geom 'head': out of the plane", "0.3 0 0.1", "0.3 0.1 0.1"),
    (
        "geom 'wall' and geom 'handle': touch each other, and one of them is of the world",
        FLOOR,
        '<geom name="wall" size="1 1" contype="0" conaffinity="1"/>' + FLOOR,
    ),
]


def refusal(*replacements):
    """Why the flail is refused once its text is changed."""
    text = FLAIL
    for old, new in replacements:
        assert old in text
        text = text.replace(old, new)
    with pytest.raises(UnsupportedModel) as caught:
        PlanarPhysics(from_xml(text))
    return caught.value


@pytest.mark.parametrize(("reason", "old", "new"), REFUSED)
def test_what_it_cannot_represent_is_refused_by_name(reason, old, new):
    error = refusal((old, new))
    assert any(reason in problem for problem in error.problems), error.problems


@pytest.mark.parametrize(
    ("reason", "geom"),
    [
        ("condim is not 1", 'type="capsule" fromto="0 0 0 -0.3 0 0" condim="3"'),
        ("condim is not 1", 'type="capsule" fromto="0 0 0 -0.3 0 0" condim="4" priority="1"'),
        ("not both are capsules", 'type="sphere" size="0.1" contype="0"'),
        ("not in one plane", 'type="capsule" fromto="0 0.1 0 -0.3 0.1 0" condim="1"'),
        ("not in one plane", 'type="capsule" fromto="0 0 0 -0.3 0.1 0" condim="1" contype="0"'),
        ("solref is in direct form", 'type="capsule" fromto="0 0 0 -0.3 0 0" condim="1" contype="0" solref="-100 -1"'),
    ],
)
def test_bodies_that_touch_each_other_in_other_ways_are_refused(reason, geom):
    """A head that can touch what hangs on the other end of the handle."""
    tail = f'<body name="tail"><joint axis="0 1 0"/><geom name="tail" {geom} conaffinity="1"/></body>'
    error = refusal((BODY, tail + BODY), ('conaffinity="0"/>', 'conaffinity="0" condim="1"/>'))
    assert f"geom 'tail' and geom 'head': touch each other, and {reason}" in error.problems


def test_every_problem_is_named_at_once():
    error = refusal(
        (BEGIN, BEGIN + '<option integrator="implicit" cone="elliptic"/>'), (JOINT, JOINT + ' frictionloss="0.1"')
    )
    assert len(error.problems) == 3
    assert all(each in str(error) for each in ("IMPLICIT", "elliptic", "joint 'swing': dry friction"))


def test_a_number_stands_for_a_missing_name():
    assert "body 2: out of the plane" in str(refusal((BODY, '<body pos="0.3 0.1 0"')))


def test_settings_that_change_nothing_are_taken():
    """Of MuJoCo's solver, its warm start and its energy, and a condim that a priority overrides."""
    text = FLAIL.replace(BEGIN, BEGIN + '<option><flag warmstart="disable" energy="enable"/></option>')
    text = text.replace(FLOOR, FLOOR + ' priority="1"').replace(HEAD, HEAD + ' condim="6"')
    model = from_xml(text)
    assert_agrees(model, states_near_the_ground(model, 50, seed=3), tolerance=1e-9)


def test_a_wrong_number_of_controls_is_refused():
    physics = PlanarPhysics(load_model("half_cheetah"))
    with pytest.raises(ValueError, match="5 controls for 6 actuators"):
        physics.advance(BodyState(np.zeros(9), np.zeros(9)), np.zeros(5), 1)

"""What environments look like: shapes where the state says, and a window that shows them."""

import jax
import numpy as np
import pytest

import envs
from envs.drawing import LABEL_MARGIN, Capsule, Disk, Label, Polygon, Polyline, Window, level_ground
from envs.mountain_car import GOAL_POSITION, CarState
from envs.physics import BodyState


def shapes(scene, kind, part=None):
    return [shape for shape in scene.shapes if isinstance(shape, kind) and part in (None, shape.part)]


@pytest.mark.parametrize("position", [-1.2, -0.8, -0.5, 0.0, 0.45, 0.6])
def test_the_cars_wheels_stand_on_the_hill(position):
    scene = envs.make("mo-mountaincarcontinuous-v0").scene(CarState(np.float32(position), np.float32(0)))
    x = np.linspace(-1.5, 1.0, 10_000)
    hill = np.stack([x, 0.45 * np.sin(3 * x) + 0.55], axis=1)
    wheels = shapes(scene, Disk)
    assert len(wheels) == 2
    for wheel in wheels:
        assert abs(np.hypot(*(hill - wheel.centre).T).min() - wheel.radius) < 0.006
    assert np.mean([wheel.centre for wheel in wheels], axis=0)[0] == pytest.approx(position, abs=0.03)


def test_the_flag_is_at_the_goal():
    scene = envs.make("mo-mountaincarcontinuous-v0").scene(CarState(np.float32(-0.5), np.float32(0)))
    (pennant,) = shapes(scene, Polygon, "goal")
    assert min(x for x, _ in pennant.points) == GOAL_POSITION
    assert all(scene.window.z[0] < z < scene.window.z[1] for _, z in pennant.points)


def test_the_window_follows_the_cheetah():
    cheetah = envs.make("mo-halfcheetah-v5")
    qpos = np.array([0.0, 0.1, 0.2, 0.3, -0.3, 0.1, -0.2, 0.4, 0.2])
    near, far = (cheetah.scene(BodyState(qpos + [shift, *np.zeros(8)], np.zeros(9))) for shift in (0.0, 1234.5))
    for before, after in zip(shapes(near, Capsule), shapes(far, Capsule), strict=True):
        np.testing.assert_allclose(np.subtract(after.start, before.start), [1234.5, 0], atol=1e-9)
        np.testing.assert_allclose(np.subtract(after.end, before.end), [1234.5, 0], atol=1e-9)
        assert far.window.x[0] < after.start[0] < far.window.x[1]
    np.testing.assert_allclose(np.subtract(far.window.x, near.window.x), 1234.5)
    assert {len(shapes(near, Capsule, part)) for part in ("hind", "fore")} == {3}


def test_every_start_of_the_cheetah_is_in_view_and_above_the_ground():
    cheetah = envs.make("mo-halfcheetah-v5")
    for key in jax.random.split(jax.random.key(0), 20):
        scene = cheetah.scene(jax.device_get(cheetah.initial_state(key)))
        for capsule in shapes(scene, Capsule):
            for x, z in (capsule.start, capsule.end):
                assert scene.window.x[0] < x < scene.window.x[1]
                assert -0.3 < z < scene.window.z[1]


@pytest.mark.parametrize("left", [-7.3, -1.0, 0.0, 10_000.4])
def test_marks_on_the_ground_stand_at_their_distance(left):
    """Stripes of a metre alternate, and stay where they are as the window moves."""
    window = Window((left, left + 4.0), (-0.2, 1.0))
    ground = list(level_ground(window))
    labels = [shape for shape in ground if isinstance(shape, Label)]
    assert {label.text for label in labels} == {f"{label.centre[0]:.0f} m" for label in labels}
    whole = {x for x in range(-10, 10_010) if left + LABEL_MARGIN < x < left + 4.0 - LABEL_MARGIN}
    assert {label.centre[0] for label in labels} == whole
    for stripe in (shape for shape in ground if isinstance(shape, Polygon) and shape.part == "stripe"):
        middle = np.mean([x for x, _ in stripe.points])
        assert np.floor(middle) % 2 == 1
        assert all(left <= x <= left + 4.0 for x, _ in stripe.points)
    assert any(isinstance(shape, Polyline) for shape in ground)

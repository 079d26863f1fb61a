"""Scenes as pixels: each shape where it is said to be, and as large."""

import jax
import numpy as np
import pytest

from envs.drawing import Capsule, Disk, Polygon, Polyline, Scene, Window
from jmorl.playback import record
from jmorl.report.frames import COLOURS, draw_scene, film_frame, strip
from tests.stored import stored_linear_policy

WINDOW = Window((2.0, 6.0), (-1.0, 1.0))
SCALE = 100  # pixels for a unit


def drawn(*shapes):
    image = draw_scene(Scene(shapes, WINDOW), 400, 10)
    assert image.size == (400, 200)
    return np.asarray(image)


def colour(part):
    return [int(COLOURS[part][index : index + 2], 16) for index in (1, 3, 5)]


def share(pixels, part):
    """Which pixels are of the part's colour, in square units."""
    return (np.abs(pixels.astype(int) - colour(part)).max(axis=-1) < 12).sum() / SCALE**2


def at(pixels, x, z):
    return pixels[round((WINDOW.z[1] - z) * SCALE), round((x - WINDOW.x[0]) * SCALE)].tolist()


def test_a_disk_is_round_and_in_place():
    pixels = drawn(Disk((5.0, 0.5), 0.3, "body"))
    assert at(pixels, 5.0, 0.5) == at(pixels, 5.25, 0.5) == at(pixels, 5.0, 0.25) == colour("body")
    assert at(pixels, 5.25, 0.75) == at(pixels, 3.0, -0.5) == [255, 255, 255]
    assert share(pixels, "body") == pytest.approx(np.pi * 0.3**2, rel=0.04)


@pytest.mark.parametrize("end", [(5.5, 0.0), (4.0, 0.6), (3.2, -0.7), (3.0, 0.0)])
def test_a_capsule_has_its_length_and_width(end):
    start, radius = (3.0, 0.0), 0.15
    pixels = drawn(Capsule(start, end, radius, "fore"))
    area = 2 * radius * np.hypot(*np.subtract(end, start)) + np.pi * radius**2
    assert share(pixels, "fore") == pytest.approx(area, rel=0.06)
    assert at(pixels, *np.mean([start, end], axis=0)) == colour("fore")


def test_areas_lie_below_lines_in_the_given_order():
    square = ((3.0, -0.5), (4.0, -0.5), (4.0, 0.5), (3.0, 0.5))
    pixels = drawn(Polygon(square, "ground"), Polyline(((2.0, 0.0), (6.0, 0.0)), "goal"))
    assert at(pixels, 3.5, 0.3) == colour("ground") and at(pixels, 5.0, 0.3) == [255, 255, 255]
    assert at(pixels, 3.5, 0.0) == at(pixels, 5.0, 0.0) == colour("goal")
    assert share(pixels, "ground") == pytest.approx(1.0, rel=0.05)


def test_limbs_differ_in_lightness_and_not_in_hue_alone():
    lightness = {part: np.dot(colour(part), [0.299, 0.587, 0.114]) for part in ("body", "hind", "fore", "ground")}
    levels = sorted(lightness.values())
    assert min(np.diff(levels)) > 25


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = tmp_path_factory.mktemp("policies") / "car.npz"
    return record(stored_linear_policy(path, "mo-mountaincarcontinuous-v0", [[0.0, 1000.0]]), jax.random.key(0), 40)


def test_every_frame_of_a_film_has_one_even_size(recording):
    sizes = {film_frame(recording, step, 322).size for step in (0, 7, recording.steps)}
    ((width, height),) = sizes
    assert width == 322 and height % 2 == 0


def test_totals_and_time_are_written_above_the_scene(recording):
    first, last = (np.asarray(film_frame(recording, step, 640)) for step in (0, recording.steps))
    head = slice(0, 80)
    columns = (first[head] != last[head]).any(axis=(0, 2)).nonzero()[0]
    assert any(columns < 320) and any((columns >= 320) & (columns < 560)) and any(columns >= 560)


def test_a_strip_has_a_pose_for_each_of_eight_moments(recording):
    """Their panels differ; a recording of fewer steps has fewer poses."""
    pixels = np.asarray(strip(recording, 800))
    assert pixels.shape[1] == 800
    short = recording.__class__(recording.environment, recording.policy, recording.states, recording.totals[:4])
    assert strip(short, 800).height < len(pixels)

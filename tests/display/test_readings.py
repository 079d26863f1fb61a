import numpy as np
import pytest

import envs
from envs.core import Objective, Reading
from jmorl.display.readings import (
    Writer,
    bounds_in_words,
    confirmed_in_words,
    direction,
    reading_label,
    values_in_words,
    writers_for,
)
from jmorl.search.policy import Confirmation, Policy

TIME = Objective("time", "time", "-steps", reading=Reading("steps", less_is_better=True))
SPEED = Objective("speed", "speed", "m/s·steps", reading=Reading("m/s", mean_over=1000))
HEIGHT = Objective("height", "height", "m")


@pytest.mark.parametrize(
    ("objective", "label", "good", "value", "score", "reaching", "span"),
    [
        (TIME, "time (steps)", "less is better", "94.5", "94.5 ±0.4", "≤ 94.5", "94.5 to 60.0"),
        (SPEED, "speed (m/s)", "more is better", "-0.1", "-0.1 ±0.0", "≥ -0.1", "-0.1 to -0.1"),
        (HEIGHT, "height (m)", "more is better", "-94.5", "-94.5 ±0.4", "≥ -94.5", "-94.5 to -60.0"),
    ],
)
def test_returns_are_written_as_people_say_them(objective, label, good, value, score, reaching, span):
    writer = Writer(objective, ".1f")
    assert (reading_label(objective), direction(objective)) == (label, good)
    assert (writer.value(-94.5), writer.score(-94.5, 0.4)) == (value, score)
    assert (writer.reaching(-94.5), writer.size(-0.4)) == (reaching, score[-3:])
    assert writer.span(-94.5, -60.0) == span


def test_no_zero_is_negative():
    assert [Writer(objective, ".1f").value(0.0) for objective in (TIME, SPEED, HEIGHT)] == ["0.0"] * 3
    assert Writer(HEIGHT, ".1f").value(-0.01) == "0.0"
    assert str(TIME.read.to_return(0.0)) == "0.0"


def test_one_number_stands_for_a_span_without_extent():
    assert Writer(TIME, ".1f").span(-3.0, -3.0) == "3.0"


def test_the_digits_fit_what_is_written():
    values = np.array([[-60.0, 3000.0], [-120.0, 4000.0]])
    writers = writers_for(values, (TIME, SPEED))
    assert values_in_words(values[0], writers) == "time 60.0, speed 3.00"
    assert bounds_in_words([-80.0, -np.inf], writers) == "time ≤ 80.0"
    assert bounds_in_words([-np.inf, -np.inf], writers) == ""


@pytest.mark.parametrize("objective", [TIME, SPEED, HEIGHT])
def test_what_is_typed_means_the_return_that_reads_so(objective):
    for value in (-390.0, 0.0, 12.5):
        assert objective.read.to_return(float(objective.read.of(value))) == pytest.approx(value, rel=1e-12)


def test_a_mean_so_far_is_of_the_steps_so_far():
    totals = np.array([0.0, 4.0, 8.0, 3000.0])
    np.testing.assert_allclose(SPEED.read.so_far(totals), [0.0, 4.0, 4.0, 1000.0])
    np.testing.assert_allclose(TIME.read.so_far(-totals), totals)
    np.testing.assert_allclose(HEIGHT.read.so_far(totals), totals)


def test_the_mean_of_a_whole_episode_is_the_reading_of_its_return():
    """Every episode of an environment whose objectives are means has as many steps as they say."""
    for name in envs.ids():
        environment = envs.make(name)
        for objective in environment.objectives:
            assert objective.read.mean_over in (1, environment.time_limit)
            totals = np.linspace(0.0, -7.0, environment.time_limit + 1)
            assert objective.read.so_far(totals)[-1] == pytest.approx(float(objective.read.of(-7.0)))


def test_a_confirmed_score_has_the_digits_of_its_error():
    confirmation = Confirmation(np.array([-57.9, 4100.0]), np.ones(2), 128, np.array([0.41, 12.0]))
    policy = Policy(
        id=3,
        generation=1,
        parent=None,
        weights=np.ones(2),
        values=np.array([-58.23, 4060.0]),
        std=np.ones(2),
        discounted=np.zeros(2),
        snapshot=None,
        confirmation=confirmation,
    )
    assert confirmed_in_words(policy, (TIME, SPEED)) == (
        "time 58.23 ±0.41, speed 4.060 ±0.012: the mean of 128 fresh episodes, 99 % sure, with room for one odd "
        "episode; in the search it was time 57.90, speed 4.100"
    )

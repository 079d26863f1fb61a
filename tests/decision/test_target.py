"""The user with a target: nearest until it is reached, then stop."""

import numpy as np
import pytest

from jmorl.decision.target import TargetUser


def target(*values: float, scaled: bool = True) -> TargetUser:
    return TargetUser(np.array(values, float), scaled)


def test_the_nearest_member_in_units_of_the_fronts_range(ask):
    # Ranges 1000 and 1. To the target (900, 1): (0.4, 0) for the first, (0.1, 0.9) for the second, (0.9, 0).
    values = [[500, 1.0], [1000, 0.1], [0, 1.1]]
    assert target(900, 1).answer(ask(values)).policy == 10
    # Unscaled: 400, 100.004, 900.
    assert target(900, 1, scaled=False).answer(ask(values)).policy == 11


def test_scaled_choices_do_not_depend_on_units(ask):
    rng = np.random.default_rng(0)
    for _ in range(50):
        values, goal, unit = rng.normal(size=(6, 3)), rng.normal(size=3) + 1.5, 2.0 ** rng.integers(-9, 9, 3)
        assert target(*goal).answer(ask(values)) == target(*goal * unit).answer(ask(values * unit))


def test_ties_go_to_the_first(ask):
    assert target(2, 2).answer(ask([[0, 1], [1, 0]])).policy == 10
    assert target(0, 0).answer(ask([[1, 2], [2, 1]])).policy == 10


def test_it_stops_with_a_member_that_reaches_the_target(ask):
    near, reaching = [-1.01, -1.0], [-0.2, -1.0]
    assert not target(-1, -1).answer(ask([near])).stop
    answer = target(-1, -1).answer(ask([near, reaching]))
    assert answer.stop and answer.policy == 11


def test_of_several_that_reach_it_the_one_with_the_largest_smallest_margin(ask):
    # Margins, with both ranges 10: (0, 10), (4, 3), (10, 1).
    values = [[5, 15], [9, 8], [15, 6], [5.5, 5.5]]
    assert target(5, 5).answer(ask(values)).policy == 11


@pytest.mark.parametrize(
    ("values", "reached"),
    [
        ([[-1, -1]], True),
        ([[-1, -1.001], [-0.9, -2]], False),
        ([[-2, 0], [-0.5, -0.5]], True),
        (np.empty((0, 2)), False),
    ],
)
def test_satisfied_when_one_member_reaches_the_target_in_every_objective(values, reached):
    assert target(-1, -1).satisfied(np.array(values)) is reached


def test_a_single_member_and_equal_ranges(ask):
    assert target(5, 5).answer(ask([[1, 2]])).policy == 10
    assert target(5, 5, 5).answer(ask([[1, 2, 7], [2, 2, 7]])).policy == 11

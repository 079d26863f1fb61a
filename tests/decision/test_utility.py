"""Artificial users with a utility function: the formulae, ties, and what only Chebyshev can choose."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from jmorl.decision.utility import USERS, UtilityUser, chebyshev_utility, linear_utility

# (4, 4) lies below every straight line that touches the two others.
CONCAVE = [[10, 0], [4, 4], [0, 10]]
VECTORS = arrays(float, st.tuples(st.integers(1, 6), st.just(3)), elements=st.floats(-100, 100))


@settings(deadline=None)
@given(values=VECTORS, weights=st.tuples(*[st.floats(0, 1)] * 3))
def test_linear_utility_is_the_weighted_sum(values, weights):
    expected = [sum(w * z for w, z in zip(weights, vector, strict=True)) for vector in values.tolist()]
    np.testing.assert_allclose(linear_utility(weights)(values), expected, atol=1e-12)


@settings(deadline=None)
@given(values=VECTORS, weights=st.tuples(*[st.floats(0, 1)] * 3))
def test_chebyshev_utility_is_the_largest_weighted_distance_to_the_ideal(values, weights):
    ideal = [max(column) for column in values.T.tolist()]
    expected = [
        -max(w * abs(z - best) for w, z, best in zip(weights, vector, ideal, strict=True)) for vector in values.tolist()
    ]
    np.testing.assert_allclose(chebyshev_utility(weights)(values), expected, atol=1e-12)


@settings(deadline=None)
@given(values=VECTORS, gain=arrays(float, 3, elements=st.floats(0, 100)), weights=st.tuples(*[st.floats(0, 1)] * 3))
def test_more_is_never_worse_even_beyond_the_utopian_point(values, gain, weights):
    utility = chebyshev_utility(weights, (0, 0, 0))
    assert (utility(values + gain) >= utility(values)).all()


def test_the_papers_users_by_hand(ask):
    values = [[-60, -60], [-70, -40], [-100, -20]]
    # A: -60, -55, -60; B: -60, -61, -76; C: -60, -49, -44
    chosen = {name: UtilityUser(linear_utility(weights)).answer(ask(values)).policy for name, weights in USERS.items()}
    assert chosen == {"A": 11, "B": 10, "C": 12}


@pytest.mark.parametrize("utility", [linear_utility((0.5, 0.5)), chebyshev_utility((0.5, 0.5), (4, 4))])
def test_ties_go_to_the_first(ask, utility):
    user = UtilityUser(utility)
    assert user.answer(ask([[0, 0], [1, 3], [1, 3], [3, 1]])).policy == 11
    assert user.answer(ask([[0, 0], [3, 1], [1, 3]])).policy == 11


@pytest.mark.parametrize("layout", [np.ascontiguousarray, np.asfortranarray])
def test_equal_vectors_have_bitwise_equal_utilities(layout):
    rng = np.random.default_rng(0)
    for _ in range(50):
        values = layout(np.tile(rng.normal(size=7), (rng.integers(2, 40), 1)))
        assert len(np.unique(linear_utility(rng.random(7))(values))) == 1


def test_chebyshev_chooses_in_a_concave_part_and_linear_never_does(ask):
    assert UtilityUser(chebyshev_utility((0.5, 0.5))).answer(ask(CONCAVE)).policy == 11
    linear = {
        UtilityUser(linear_utility((w, 1 - w))).answer(ask(CONCAVE)).policy for w in np.linspace(0, 1, 101).tolist()
    }
    assert linear == {10, 12}


def test_a_fixed_utopian_point_moves_the_choice(ask):
    # Distances to (10, 10): 5, 3, 5. To (100, 10), 45 against 48 and 50: the first objective is all that matters.
    assert UtilityUser(chebyshev_utility((0.5, 0.5), (10, 10))).answer(ask(CONCAVE)).policy == 11
    assert UtilityUser(chebyshev_utility((0.5, 0.5), (100, 10))).answer(ask(CONCAVE)).policy == 10


def test_a_utility_is_reported_only_if_it_means_the_same_in_every_set():
    few, more = np.array([[1.0, 5.0]]), np.array([[1.0, 5.0], [9.0, 3.0]])
    for user in (UtilityUser(linear_utility((0.7, 0.3))), UtilityUser(chebyshev_utility((0.7, 0.3), (10, 10)))):
        assert user.utility(few)[0] == user.utility(more)[0]
    moving = UtilityUser(chebyshev_utility((0.7, 0.3)), comparable=False)
    assert moving.scalarise(few)[0] != moving.scalarise(more)[0]
    assert moving.utility(few) is None


def test_a_utility_user_never_stops_a_run(ask):
    user = UtilityUser(linear_utility((0.5, 0.5)))
    answer = user.answer(ask(CONCAVE))
    assert not answer.stop and answer.generations == 1 and not user.satisfied(np.array(CONCAVE))

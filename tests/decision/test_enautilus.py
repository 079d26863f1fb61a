"""E-NAUTILUS: an example worked by hand, its laws, degenerate fronts, and the dialogue with every kind of user."""

from dataclasses import astuple, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.cluster.hierarchy import fcluster, linkage

from jmorl.decision import enautilus as en
from jmorl.decision.answers import Adjust, Back, Choose
from jmorl.decision.navigation import respond, run_enautilus
from jmorl.decision.protocol import PointQuestion
from jmorl.decision.target import TargetUser
from jmorl.decision.utility import UtilityUser, chebyshev_utility, linear_utility

# Two clusters of three; nadir (0, 0), both ranges 12.
HAND = np.array([[0, 12], [1, 11], [2, 10], [10, 4], [11, 3], [12, 0]], float)
VERTICES = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0.5, 0.5, 0.5]])


@st.composite
def fronts(draw):
    """Vectors with ties and duplicates, dominated ones too, in one to four objectives."""
    shape = draw(st.tuples(st.integers(1, 12), st.integers(1, 4)))
    elements = draw(st.sampled_from([st.integers(-3, 3).map(float), st.floats(-1e6, 1e6)]))
    return draw(arrays(float, shape, elements=elements))


def sphere(rng: np.random.Generator, members: int, objectives: int) -> np.ndarray:
    """A front without ties or dominated members."""
    directions = np.abs(rng.normal(size=(members, objectives)))
    return directions / np.linalg.norm(directions, axis=1, keepdims=True) * 10.0 ** np.arange(objectives)


def test_the_example_worked_by_hand():
    start = en.begin(HAND, iterations=2, points=2)
    np.testing.assert_array_equal(start.point, [0, 0])
    right, left = en.intermediate_points(start)
    assert (right.representative, left.representative) == (4, 1)
    np.testing.assert_array_equal(right.value, [5.5, 1.5])
    np.testing.assert_array_equal(left.value, [0.5, 5.5])
    np.testing.assert_array_equal(right.best, [11, 4])
    np.testing.assert_array_equal(left.best, [2, 11])
    assert right.closeness == left.closeness == 50
    np.testing.assert_array_equal(np.flatnonzero(right.reachable), [3, 4])
    np.testing.assert_array_equal(np.flatnonzero(left.reachable), [1, 2])

    state = en.choose(start, right)
    assert not en.finished(state) and state.iterations_left == 1
    last = en.intermediate_points(state)
    assert [point.representative for point in last] == [4, 3]
    np.testing.assert_array_equal([point.value for point in last], [[11, 3], [10, 4]])
    assert [point.closeness for point in last] == [100, 100]
    end = en.choose(state, last[1])
    assert en.finished(end) and en.result(end) == 3


def test_three_objectives_by_hand():
    start = en.begin(VERTICES, iterations=2, points=4)
    first, centre, second, third = en.intermediate_points(start)
    assert [point.representative for point in (first, centre, second, third)] == [0, 3, 1, 2]
    np.testing.assert_array_equal(first.value, [0.5, 0, 0])
    np.testing.assert_array_equal(first.best, [1, 0.5, 0.5])
    np.testing.assert_array_equal(first.reachable, [True, False, False, True])
    np.testing.assert_array_equal(centre.reachable, [False, False, False, True])
    assert first.closeness == centre.closeness == 50
    assert en.finished(en.choose(start, centre)) and en.result(en.choose(start, centre)) == 3


def test_ended_early_it_takes_the_member_whose_worst_objective_is_best():
    assert en.result(en.adjust(en.begin(VERTICES, 3, 2), iterations_left=0, points=2)) == 3


def test_the_sum_decides_between_equal_worst_objectives_and_then_the_first():
    # In units of the ranges 3 and 9: worst objectives 0, 1/3, 1/9, 1/3; sums 8/9 and 4/3 for the two at 1/3.
    assert en.result(en.begin([[0, 0], [1, 5], [3, 1], [1, 9]], 1, 1)) == 3
    # In units of the ranges 2, 2, 4: all worst 0, sums 1, 3/2, 3/2.
    assert en.result(en.begin([[0, 0, 4], [1, 2, 0], [2, 1, 0]], 1, 1)) == 1


@settings(deadline=None)
@given(fronts(), st.integers(1, 5), st.integers(1, 5), st.lists(st.integers(0, 99), min_size=5, max_size=5))
def test_laws(values, iterations, points, choices):
    state = en.begin(values, iterations, points)
    for choice in choices:
        if en.finished(state):
            break
        shown = en.intermediate_points(state)
        distinct = {tuple(each) for each in values[state.reachable].tolist()}
        assert len(shown) == min(points, len(distinct))
        assert len({tuple(values[point.representative].tolist()) for point in shown}) == len(shown)
        for point in shown:
            check_point(state, point)
        chosen = shown[choice % len(shown)]
        after = en.choose(state, chosen)
        assert en.step_back(after, 1) is state
        assert after.iterations_left == state.iterations_left - 1 and after.choices == state.choices + 1
        state = after
    assert en.finished(state)
    ended = en.result(state)
    assert state.reachable[ended] and (values[ended] >= state.point).all()


def check_point(state: en.State, point: en.IntermediatePoint) -> None:
    """A point against the definitions in the paper and the design, computed in the plainest way."""
    values, h = state.values, state.iterations_left
    target = values[point.representative]
    assert state.reachable[point.representative]
    np.testing.assert_allclose(h * point.value, (h - 1) * state.point + target, rtol=1e-9, atol=1e-6)
    assert (state.point <= point.value).all() and (point.value <= target).all()
    at_least_as_good = [all(z >= bound for z, bound in zip(each, point.value, strict=True)) for each in values]
    assert point.reachable.tolist() == [a and b for a, b in zip(at_least_as_good, state.reachable, strict=True)]
    for o in range(values.shape[1]):
        others = np.arange(values.shape[1]) != o
        candidates = [each[o] for each in values[state.reachable] if (each[others] >= point.value[others]).all()]
        assert point.best[o] == max(candidates) >= point.value[o]
    span = np.array([max(column) - min(column) or 1 for column in values.T.tolist()])
    whole = np.sqrt((((target - values.min(0)) / span) ** 2).sum())
    way = np.sqrt((((point.value - values.min(0)) / span) ** 2).sum())
    assert point.closeness <= 100
    assert point.closeness == pytest.approx(100 * way / whole if whole else 100)


@pytest.mark.parametrize("objectives", [2, 3])
def test_representatives_are_nearest_the_centroids_of_average_linkage_clusters(objectives):
    rng = np.random.default_rng(objectives)
    for _ in range(20):
        values = sphere(rng, 15, objectives)
        scaled = (values - values.min(0)) / (values.max(0) - values.min(0))
        labels = fcluster(linkage(scaled, "average"), 4, "maxclust")
        expected = set()
        for label in set(labels):
            cluster = np.flatnonzero(labels == label)
            distances = np.linalg.norm(scaled[cluster] - scaled[cluster].mean(0), axis=1)
            # Of two members both are as near; then the better in the first objective stands for them.
            expected.add(max(cluster, key=lambda i: values[i, 0]) if len(cluster) == 2 else cluster[distances.argmin()])
        shown = en.intermediate_points(en.begin(values, 3, 4))
        assert {point.representative for point in shown} == expected
        assert [values[p.representative, 0] for p in shown] == sorted(values[list(expected), 0], reverse=True)


def test_neither_units_nor_the_order_of_members_matter():
    rng = np.random.default_rng(0)
    for _ in range(20):
        values, unit = sphere(rng, 12, 3), 2.0 ** rng.integers(-9, 9, 3)
        order = rng.permutation(len(values))
        plain = en.intermediate_points(en.begin(values, 3, 4))
        changed = en.intermediate_points(en.begin(values[order] * unit, 3, 4))
        for one, other in zip(plain, changed, strict=True):
            np.testing.assert_array_equal(one.value * unit, other.value)
            np.testing.assert_array_equal(one.reachable[order], other.reachable)
            assert one.closeness == other.closeness and one.representative == order[other.representative]


def test_evenly_spaced_members_make_exactly_as_many_clusters_as_asked_for():
    values = np.stack([np.arange(6), 5 - np.arange(6)], axis=1)
    assert [len(en.intermediate_points(en.begin(values, 2, n))) for n in range(1, 8)] == [1, 2, 3, 4, 5, 6, 6]


@pytest.mark.parametrize(
    ("values", "representatives"),
    [
        ([[3, 7]], [0]),
        ([[3, 7], [3, 7], [3, 7]], [0]),
        ([[1, 5], [2, 5], [1, 5]], [1, 0]),
        ([[0, 1], [1, 0]], [1, 0]),
        ([[5]], [0]),
    ],
    ids=["one member", "duplicates", "an equal range", "fewer members than points", "one objective"],
)
def test_degenerate_fronts(values, representatives):
    state = en.begin(values, 2, 3)
    shown = en.intermediate_points(state)
    assert [point.representative for point in shown] == representatives
    assert en.finished(state) == (len(representatives) == 1)
    assert all(np.isfinite(point.closeness) for point in shown)
    assert en.result(en.choose(state, shown[-1])) in range(len(values))


def test_one_point_for_a_symmetric_pair_is_the_better_in_the_first_objective():
    # As a matrix this front looks like one of distances, which must not confuse the clustering.
    (point,) = en.intermediate_points(en.begin([[0, 1], [1, 0]], 2, 1))
    assert point.representative == 1


def test_rounding_never_puts_a_point_beyond_its_own_representative():
    assert (0.1 + 0.1 + 0.1) / 3 > 0.1
    for point in en.intermediate_points(en.begin([[0.1, 1], [0.1, 2], [0.1, 4]], 3, 3)):
        assert point.value[0] == 0.1 and point.reachable[point.representative]


def test_it_never_ends_on_a_member_that_dropped_out():
    # The second is worse by 1e-7 in one objective, and a whole range better in the other.
    start = en.begin([[0.5, 0], [0.5 - 1e-7, 1], [0, 0.5]], 1, 3)
    chosen = en.intermediate_points(start)[0]
    assert chosen.representative == 0
    assert en.result(en.choose(start, chosen)) == 0


def test_iterations_and_points_may_change_at_any_time_and_stepping_back_restores_them():
    start = en.begin(HAND, 2, 2)
    state = en.adjust(en.choose(start, en.intermediate_points(start)[0]), iterations_left=4, points=1)
    (point,) = en.intermediate_points(state)
    np.testing.assert_allclose(point.value, (3 * state.point + HAND[point.representative]) / 4)
    deeper = en.choose(state, point)
    assert deeper.iterations_left == 3
    assert en.step_back(deeper, 1) is state
    assert en.step_back(deeper, 2) is start and (start.iterations_left, start.points) == (2, 2)


def test_the_callers_array_is_copied():
    values = HAND.copy()
    state = en.begin(values, 2, 2)
    values[:] = 0
    np.testing.assert_array_equal(state.values, HAND)


@pytest.mark.parametrize(
    ("values", "iterations", "points", "message"),
    [
        (np.empty((0, 2)), 3, 3, "at least one policy"),
        ([1.0, 2.0], 3, 3, "at least one policy"),
        ([[1.0, np.nan]], 3, 3, "finite"),
        ([[1.0, np.inf]], 3, 3, "finite"),
        (HAND, 0, 3, "at least 1 iteration, not 0"),
        (HAND, 3, 0, "with 0 points"),
    ],
)
def test_a_beginning_that_makes_no_sense_is_refused(values, iterations, points, message):
    with pytest.raises(ValueError, match=message):
        en.begin(values, iterations, points)


def test_impossible_steps_are_refused():
    start = en.begin(HAND, 1, 2)
    moved = en.choose(start, en.intermediate_points(start)[0])
    with pytest.raises(ValueError, match="no iterations are left"):
        en.intermediate_points(moved)
    for state, steps in ((start, 1), (moved, 2), (moved, 0), (moved, -1)):
        with pytest.raises(ValueError, match=f"cannot take back {steps} choices"):
            en.step_back(state, steps)
    with pytest.raises(ValueError, match="-1 iterations"):
        en.adjust(start, -1, 2)


# --- the dialogue -------------------------------------------------------------------------------------------------


def dialogue(answers):
    """A chooser that gives the answers in turn and keeps the questions."""
    questions, remaining = [], list(answers)

    def choose_point(question: PointQuestion):
        questions.append(question)
        return remaining.pop(0)

    return questions, choose_point


def test_a_dialogue_with_every_answer(front_of, objectives_of):
    answers = [Choose(0), Back(1), Adjust(3, 3), Choose(2), Choose(1), Choose(0)]
    questions, choose_point = dialogue(answers)
    front = front_of(HAND)
    chosen = run_enautilus(front, objectives_of(2), choose_point, iterations=2, points=2, generation=7)
    assert chosen in front
    assert [question.number for question in questions] == list(range(len(questions)))
    assert {question.generation for question in questions} == {7}
    assert questions[2].state is questions[0].state
    assert (questions[3].state.iterations_left, len(questions[3].points)) == (3, 3)
    # The third of three points heads for the left cluster; nothing on the right stays reachable.
    assert chosen.id in (10, 11, 12)


def test_adjusting_to_no_iterations_ends_it(front_of, objectives_of):
    questions, choose_point = dialogue([Adjust(0, 2)])
    chosen = run_enautilus(front_of(VERTICES), objectives_of(3), choose_point, 3, 2, 1)
    assert chosen.id == 13 and len(questions) == 1


def test_a_single_policy_is_never_asked_about(front_of, objectives_of):
    questions, choose_point = dialogue([])
    assert run_enautilus(front_of([[1, 2]]), objectives_of(2), choose_point, 3, 3, 1).id == 10
    assert not questions


def test_an_empty_front_is_refused(objectives_of):
    with pytest.raises(ValueError, match="at least one policy"):
        run_enautilus((), objectives_of(2), dialogue([])[1], 3, 3, 1)


@pytest.mark.parametrize("answer", [Choose(2), Choose(-1), Back(1), Adjust(3, 0)])
def test_impossible_answers_are_refused(front_of, objectives_of, answer):
    with pytest.raises(ValueError, match=r"no point|cannot"):
        run_enautilus(front_of(HAND), objectives_of(2), dialogue([answer])[1], 2, 2, 1)


def test_with_all_members_as_points_it_is_the_users_own_choice(ask, front_of, objectives_of):
    rng = np.random.default_rng(0)
    for _ in range(20):
        values = sphere(rng, 9, 3)
        users = (
            UtilityUser(linear_utility(rng.random(3))),
            UtilityUser(chebyshev_utility(rng.random(3))),
            TargetUser(values.max(0) * rng.random(3)),
        )
        for user in users:
            chosen = run_enautilus(front_of(values), objectives_of(3), user.choose_point, 1, len(values), 1)
            assert chosen.id == user.answer(ask(values)).policy


def test_a_linear_user_chooses_the_point_of_greatest_utility(front_of, objectives_of):
    rng = np.random.default_rng(0)
    for _ in range(20):
        utility = linear_utility(rng.random(3))
        user = UtilityUser(utility)

        def checked(question: PointQuestion, user=user, utility=utility):
            answer = user.choose_point(question)
            assert answer.point == np.argmax(utility(np.stack([point.value for point in question.points])))
            return answer

        values = sphere(rng, 30, 3)
        chosen = run_enautilus(front_of(values), objectives_of(3), checked, 3, 3, 1)
        assert chosen.values.tolist() in values.tolist()


def test_respond_is_pure(front_of, objectives_of):
    state = en.begin(HAND, 2, 2)
    question = PointQuestion(1, 0, objectives_of(2), front_of(HAND), state, en.intermediate_points(state))
    before = [np.copy(each) for each in astuple(replace(state, parent=None))[:4]]
    once, twice = respond(question, Choose(0)), respond(question, Choose(0))
    np.testing.assert_array_equal(once.point, twice.point)
    for kept, now in zip(before, (state.values, state.nadir, state.point, state.reachable), strict=True):
        np.testing.assert_array_equal(kept, now)

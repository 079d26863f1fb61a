"""The preference model: what a few choices tell of a utility, and how sure it is."""

import numpy as np
import pytest

from jmorl.decision.preferences import Comparison, PreferenceModel

SPANS, ORIGIN = np.array([100.0, 30.0, 7.0]), np.array([-900.0, 3.0, 0.0])


def fronts(generator, count, objectives):
    """Fronts that grow: points on a sphere in units of their own."""
    for number in range(count):
        points = np.abs(generator.normal(size=(12 + 3 * number, objectives)))
        yield points / np.linalg.norm(points, axis=1, keepdims=True) * SPANS[:objectives] + ORIGIN[:objectives]


def shares(values):
    return (values - ORIGIN[: values.shape[1]]) / SPANS[: values.shape[1]]


def linear(weights):
    return lambda values: shares(values) @ weights


def chebyshev(weights):
    return lambda values: (weights * (shares(values) - 1)).min(axis=1)


def concave(weights):
    return lambda values: np.log1p(5 * shares(values)) @ weights


def elicited(utility, seed, objectives, mistakes=0.0):
    """Ask about eleven fronts, where the model is not sure; how often that was, and the loss of what it was sure of."""
    generator = np.random.default_rng(seed)
    choices, losses = [], []
    for front in fronts(generator, 11, objectives):
        worth = utility(front)
        verdict = PreferenceModel(front, choices, seed).verdict()
        if verdict.regret < 0.01:
            losses.append((worth.max() - worth[verdict.best]) / np.ptp(worth))
        else:
            wrong = generator.random() < mistakes
            best = int(generator.integers(len(front)) if wrong else worth.argmax())
            choices.append(Comparison(front, (best,)))
    return len(choices), losses


@pytest.mark.parametrize("kind", [linear, chebyshev, concave])
@pytest.mark.parametrize("weights", [(0.5, 0.5), (0.8, 0.2), (0.3, 0.7), (0.2, 0.5, 0.3)])
def test_a_handful_of_questions_is_enough_for_users_of_every_kind(kind, weights):
    asked, losses = elicited(kind(np.array(weights)), 1, len(weights))
    assert asked <= (5 if len(weights) == 2 else 8)
    assert np.mean(losses) < 0.015 and max(losses) < 0.05


def test_one_answer_in_five_may_be_wrong():
    found = [elicited(linear(np.array([0.4, 0.6])), seed, 2, mistakes=0.2) for seed in range(6)]
    assert np.mean([asked for asked, _ in found]) <= 7
    assert np.mean([loss for _, losses in found for loss in losses]) < 0.01


def test_without_answers_nothing_is_sure():
    (front,) = fronts(np.random.default_rng(0), 1, 2)
    verdict = PreferenceModel(front, [], 0).verdict()
    assert verdict.regret > 0.05 and verdict.probability < 0.5


def test_units_do_not_matter_and_the_same_answers_give_the_same_posterior():
    first, second = fronts(np.random.default_rng(0), 2, 2)
    factor, shift = np.array([1e-3, 1e4]), np.array([7.0, -1e5])
    plain = PreferenceModel(second, [Comparison(first, (5,))], 3)
    scaled = PreferenceModel(second * factor + shift, [Comparison(first * factor + shift, (5,))], 3)
    np.testing.assert_allclose(plain.utilities(second), scaled.utilities(second * factor + shift), atol=1e-6)
    np.testing.assert_array_equal(
        plain.utilities(second), PreferenceModel(second, [Comparison(first, (5,))], 3).utilities(second)
    )


@pytest.mark.parametrize("seed", range(3))
def test_beside_a_policy_far_out_the_others_do_not_look_alike(seed):
    """A car that never moves uses no fuel, and needs ten times as long as any that arrives."""
    angles = np.linspace(0.1, np.pi / 2 - 0.1, 12)
    front = np.stack([-70 - 30 * (1 - np.cos(angles)), -25 - 30 * (1 - np.sin(angles))], axis=1)
    still, asked = [-999.0, -0.3], front[[0, 4, 8, 11]]
    without = PreferenceModel(front, [Comparison(asked, (1,))], seed).verdict()
    beside = PreferenceModel(np.vstack([front, still]), [Comparison(np.vstack([asked, still]), (1,))], seed).verdict()
    assert beside.best == without.best
    assert beside.regret == pytest.approx(without.regret, rel=0.15) and without.regret > 0.05


def test_whoever_wants_what_is_far_out_gets_it():
    front = np.array([[-70.0, -55], [-75, -45], [-80, -38], [-85, -35], [-90, -33], [-100, -30], [-999, -0.3]])
    answers = [Comparison(front, (6,)), Comparison(front[3:], (3,))]
    assert PreferenceModel(front, answers, 0).verdict().best == 6


def test_more_is_never_worth_less():
    first, second = fronts(np.random.default_rng(2), 2, 3)
    model = PreferenceModel(second, [Comparison(first, (4,))], 0)
    assert (model.utilities(second + 0.1 * SPANS) >= model.utilities(second) - 1e-12).all()


def test_an_objective_without_range_and_a_front_of_one_are_judged():
    flat = np.array([[1.0, 5.0], [2.0, 5.0]])
    assert PreferenceModel(flat, [Comparison(flat, (1,))], 0).verdict().best == 1
    assert PreferenceModel(flat[:1], [Comparison(flat, (1,))], 0).verdict().regret == 0


# --- rankings, no difference, changes of mind, limits, pairs -------------------------------------------------------


def answered(utility, shown, generation=1, places=1):
    """Somebody's answer to vectors: the best few, in order."""
    return Comparison(shown, tuple(np.argsort(-utility(shown))[:places].tolist()), generation)


def spread(front, count):
    """So many members of a front of two objectives, from one end to the other."""
    return front[np.argsort(front[:, 0])[np.linspace(0, len(front) - 1, count).round().astype(int)]]


def test_a_ranking_says_more_than_its_best_alone():
    regrets, losses = [], []
    for seed in range(6):
        first, second = fronts(np.random.default_rng(seed), 2, 2)
        utility = linear(np.array([0.35, 0.65]))
        worth = utility(second)
        for places in (1, 5):
            verdict = PreferenceModel(second, [answered(utility, spread(first, 5), places=places)], seed).verdict()
            regrets.append(verdict.regret)
            losses.append((worth.max() - worth[verdict.best]) / np.ptp(worth))
    assert np.mean(regrets[1::2]) < 0.7 * np.mean(regrets[::2])
    assert np.mean(losses[1::2]) <= np.mean(losses[::2])


def test_a_ranking_of_some_puts_the_others_behind_them():
    shown = np.array([[0.0, 4.0], [1.0, 3.0], [2.0, 2.0], [3.0, 1.0], [4.0, 0.0]])
    found = PreferenceModel(shown, [Comparison(shown, (1, 0))], 0).utilities(shown)
    assert (found[:, [0, 1]].min(axis=1) > found[:, 2:].max(axis=1)).mean() > 0.8


def test_the_order_behind_a_best_by_far_counts_too():
    shown = np.array([[10.0, 10.0], [2.0, 1.0], [0.0, 0.0], [1.0, 2.0]])

    def agreeing(seed, second, third):
        found = PreferenceModel(shown, [Comparison(shown, (0, second, third, 2))], seed).utilities(shown)
        return (found[:, second] > found[:, third]).mean()

    assert np.mean([agreeing(seed, *order) for seed in range(3) for order in ((1, 3), (3, 1))]) > 0.8


def test_no_difference_raises_the_belief_in_utilities_where_those_shown_are_alike():
    def apart(seed, times):
        (front,) = fronts(np.random.default_rng(seed), 1, 2)
        shown = spread(front, 4)[1:3]
        utilities = PreferenceModel(front, [Comparison(shown, ())] * times, 0).utilities(shown)
        return np.abs(utilities[:, 0] - utilities[:, 1]).mean()

    never, once, thrice = (np.mean([apart(seed, times) for seed in (1, 2, 3)]) for times in (0, 1, 3))
    assert once < 0.9 * never and thrice < 0.7 * never


def test_who_changed_their_mind_is_followed():
    losses = []
    for seed in range(4):
        *earlier, now = fronts(np.random.default_rng(seed), 9, 2)
        old, new = linear(np.array([0.8, 0.2])), linear(np.array([0.2, 0.8]))
        answers = [
            answered(old if generation <= 5 else new, front, generation)
            for generation, front in enumerate(earlier, start=1)
        ]
        worth = new(now)
        verdict = PreferenceModel(now, answers, seed, generation=9).verdict()
        losses.append((worth.max() - worth[verdict.best]) / np.ptp(worth))
        before = PreferenceModel(now, answers[:5], seed, generation=6).verdict()
        assert worth.max() - worth[before.best] > 0.3 * np.ptp(worth)
    assert max(losses) < 0.05


def test_who_answered_long_ago_is_known_less_well():
    first, second, third = fronts(np.random.default_rng(0), 3, 2)
    utility = linear(np.array([0.3, 0.7]))
    answers = [answered(utility, front, generation) for generation, front in ((1, first), (2, second), (3, first))]
    regrets = [PreferenceModel(third, answers, 0, generation).verdict().regret for generation in (3, 10, 60)]
    assert regrets[0] < 0.02 and regrets[1] > 2 * regrets[0] and regrets[2] > 2 * regrets[1]


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("objective", [0, 1])
def test_nothing_that_misses_a_limit_is_best_while_something_reaches_it(seed, objective):
    (front,) = fronts(np.random.default_rng(seed), 1, 2)
    order = np.argsort(front[:, 1 - objective])  # somebody wants the most of the other objective
    answers = [Comparison(front, (int(order[-1]),))] * 2
    limits = np.full(2, -np.inf)
    limits[objective] = np.sort(front[:, objective])[-4]
    reaching = (front >= limits).all(axis=1)
    free, bound = (PreferenceModel(front, answers, seed, limits=each) for each in (None, limits))
    assert not reaching[free.verdict().best] and reaching[bound.verdict().best]
    utilities = bound.utilities(front)
    assert (utilities[:, reaching] >= 0).all() and (utilities[:, ~reaching] < 0).all()


def test_limits_of_nothing_are_no_limits():
    (front,) = fronts(np.random.default_rng(0), 1, 2)
    plain, unlimited = (PreferenceModel(front, [], 0, limits=each) for each in (None, np.full(2, -np.inf)))
    np.testing.assert_array_equal(plain.utilities(front), unlimited.utilities(front))


def test_where_nothing_reaches_the_limits_the_nearest_is_best():
    front = np.array([[0.0, 10.0], [2.0, 9.0], [4.0, 4.0], [9.0, 3.0], [10.0, 0.0]])
    for limits, nearest in (((4.0, 12.0), 1), ((14.0, 10.0), 3)):
        for wanted in (0, 4):
            model = PreferenceModel(front, [Comparison(front, (wanted,))], 0, limits=np.array(limits))
            assert model.verdict().best == nearest


@pytest.mark.parametrize("seed", range(5))
def test_a_sampled_pair_is_two_policies_whatever_is_known(seed):
    generator = np.random.default_rng(seed)
    for front in (*fronts(generator, 2, 3), *(front[:2] for front in fronts(generator, 2, 2))):
        for answers in ([], [answered(linear(np.full(front.shape[1], 1.0)), front, places=2)] * 6):
            pair = PreferenceModel(front, answers, seed).sampled_pair()
            assert len(set(pair)) == 2 and set(pair) <= set(range(len(front)))


def test_pairs_vary_and_have_a_likely_best_one():
    (front,) = fronts(np.random.default_rng(4), 1, 2)
    utility = linear(np.array([0.4, 0.6]))
    answers = [answered(utility, front)] * 4
    pairs = [PreferenceModel(front, answers, seed).sampled_pair() for seed in range(8)]
    near = set(np.argsort(-utility(front))[:4].tolist())
    assert all(set(pair) & near for pair in pairs)
    assert len({tuple(PreferenceModel(front, [], seed).sampled_pair()) for seed in range(8)}) > 2


@pytest.mark.parametrize("seed", range(4))
def test_before_the_first_answer_every_kind_of_utility_is_possible(seed):
    """On a straight front some want an end of it, and some the middle."""
    line = np.array([[k, 10.0 - k] for k in range(11)])
    favourites = PreferenceModel(line, [], seed).utilities(line).argmax(axis=1)
    at_the_ends = np.isin(favourites, [0, 10]).mean()
    assert 0.3 < at_the_ends < 0.8

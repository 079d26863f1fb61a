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


def test_more_is_never_worth_less():
    first, second = fronts(np.random.default_rng(2), 2, 3)
    model = PreferenceModel(second, [Comparison(first, (4,))], 0)
    assert (model.utilities(second + 0.1 * SPANS) >= model.utilities(second) - 1e-12).all()


def test_an_objective_without_range_and_a_front_of_one_are_judged():
    flat = np.array([[1.0, 5.0], [2.0, 5.0]])
    assert PreferenceModel(flat, [Comparison(flat, (1,))], 0).verdict().best == 1
    assert PreferenceModel(flat[:1], [Comparison(flat, (1,))], 0).verdict().regret == 0

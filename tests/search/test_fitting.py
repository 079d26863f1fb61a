"""The batched fit against scipy's, planted curves, and what an optimum must satisfy."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from jmorl.search import fitting
from jmorl.search.fitting import fit_cost, fit_tanh, tanh_curve

X = np.linspace(0.0, 1.0, 11)


def box_of(y: np.ndarray) -> tuple[list[float], list[float]]:
    """The bounds on (A, a, b, c)."""
    return [0.0, 0.1, -5.0, -1.0], [float(np.clip(np.ptp(y), 0.01, 1.0)), 20.0, 5.0, 1.0]


def scipy_fit(x: np.ndarray, y: np.ndarray, importance: np.ndarray) -> tuple[np.ndarray, float]:
    """One fit by the reference solver from the same start: its parameters and cost."""
    lower, upper = box_of(y)
    start = np.clip([np.ptp(y) / 2, 1.0, 0.0, y.mean()], lower, upper)

    def residuals(p: np.ndarray) -> np.ndarray:
        return importance * (p[0] * np.tanh(p[1] * (x - p[2]) / 2) + p[3] - y)

    found = least_squares(residuals, start, bounds=(lower, upper), loss="soft_l1", f_scale=0.05, xtol=1e-10)
    return found.x, found.cost


def planted_problems(
    count: int, records: int, noise: float, seed: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Curves with their bend among the weights: parameters [4, F], x, y and importance [R, F]."""
    generator = np.random.default_rng(seed)
    low, high = [[0.1], [4.0], [0.3], [-0.3]], [[0.4], [10.0], [0.7], [0.3]]
    parameters = generator.uniform(low, high, size=(4, count))
    x = generator.choice(X, size=(records, count))
    y = tanh_curve(parameters, x) + noise * generator.normal(size=x.shape)
    return parameters, x, y, generator.uniform(0.2, 1.0, size=x.shape)


def neighbourhood_problems(count: int, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What a search asks for: few records, weak and noisy responses, importances over many magnitudes."""
    generator = np.random.default_rng(seed)
    shape = (12, count)
    x = generator.choice(X, size=shape)
    response = 0.1 * np.tanh(generator.uniform(0.5, 6.0, size=count) * (x - generator.uniform(0, 1, size=count)))
    y = response + 0.02 * generator.normal(size=shape)
    importance = np.exp(-(generator.uniform(0.0, 3.0, size=shape) ** 2) / 2)
    importance[generator.integers(4, 13, size=count) <= np.arange(12)[:, None]] = 0.0
    return x, y, importance


def test_planted_curves_are_recovered() -> None:
    parameters, x, y, importance = planted_problems(60, records=20, noise=0.0, seed=0)
    everywhere = np.repeat(X[:, None], 60, axis=1)
    found = tanh_curve(fit_tanh(x, y, importance), everywhere)
    np.testing.assert_allclose(found, tanh_curve(parameters, everywhere), atol=1e-4)


def test_equals_scipy_where_the_optimum_is_plain() -> None:
    _, x, y, importance = planted_problems(40, records=30, noise=0.02, seed=1)
    found = tanh_curve(fit_tanh(x, y, importance), np.repeat(X[:, None], 40, axis=1))
    theirs = [scipy_fit(*problem)[0] for problem in zip(x.T, y.T, importance.T, strict=True)]
    np.testing.assert_allclose(found, tanh_curve(np.array(theirs).T, np.repeat(X[:, None], 40, axis=1)), atol=1e-3)


def test_as_good_as_scipy_on_what_a_search_asks_for() -> None:
    """Few noisy records may have two optima; then the other one, or a better one, may be found."""
    x, y, importance = neighbourhood_problems(60, seed=2)
    found = fit_tanh(x, y, importance)
    present = importance > 0
    theirs = [scipy_fit(x[here, f], y[here, f], importance[here, f]) for f, here in enumerate(present.T)]
    costs = np.array([cost for _, cost in theirs])
    assert (fit_cost(found, x, y, importance) <= costs * (1 + 1e-3) + 1e-9).mean() >= 0.95

    everywhere = np.repeat(X[:, None], 60, axis=1)
    curves = tanh_curve(np.array([parameters for parameters, _ in theirs]).T, everywhere)
    apart = np.abs(tanh_curve(found, everywhere) - curves).max(axis=0)
    assert (apart <= 1e-2).mean() >= 0.9


def test_cost_is_scipys() -> None:
    _, x, y, importance = planted_problems(5, records=8, noise=0.3, seed=3)
    for f in range(5):
        parameters, cost = scipy_fit(x[:, f], y[:, f], importance[:, f])
        ours = fit_cost(parameters[:, None], x[:, [f]], y[:, [f]], importance[:, [f]])
        np.testing.assert_allclose(ours, cost, rtol=1e-9)


@pytest.mark.parametrize("noise", [0.0, 0.05, 0.5])
def test_no_small_move_within_the_box_is_better(noise: float) -> None:
    _, x, y, importance = planted_problems(40, records=9, noise=noise, seed=4)
    parameters = fit_tanh(x, y, importance)
    cost = fit_cost(parameters, x, y, importance)
    boxes = [box_of(each) for each in y.T]
    lower, upper = np.array([low for low, _ in boxes]).T, np.array([high for _, high in boxes]).T
    assert (parameters >= lower).all() and (parameters <= upper).all()
    directions = np.concatenate([np.eye(4), -np.eye(4)])[:, :, None] * (upper - lower)
    for step in (1e-4, 1e-6):
        for direction in directions:
            moved = fit_cost(np.clip(parameters + step * direction, lower, upper), x, y, importance)
            assert (moved >= cost * (1 - 1e-3) - 1e-12).all()


def test_a_fit_does_not_depend_on_its_company() -> None:
    x, y, importance = neighbourhood_problems(30, seed=5)
    together = fit_tanh(x, y, importance)
    alone = np.concatenate([fit_tanh(x[:, [f]], y[:, [f]], importance[:, [f]]) for f in range(30)], axis=1)
    np.testing.assert_allclose(together, alone, rtol=1e-6, atol=1e-8)


def test_a_large_problem_is_worked_off_in_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fits with one record and with all of them, records at the end of the column included."""
    x, y, importance = neighbourhood_problems(30, seed=8)
    importance[1:, 0], importance[:-1, 1] = 0.0, 0.0
    importance[-1, 1] = 1.0
    whole = fit_tanh(x, y, importance)
    monkeypatch.setattr(fitting, "TOGETHER", 100)
    np.testing.assert_allclose(fit_tanh(x, y, importance), whole, rtol=1e-6, atol=1e-8)


def test_records_without_importance_are_not_there() -> None:
    x, y, importance = neighbourhood_problems(30, seed=6)
    absent = importance == 0
    with_rubbish = fit_tanh(np.where(absent, 0.5, x), np.where(absent, 1e6, y), importance)
    np.testing.assert_array_equal(with_rubbish, fit_tanh(x, y, importance))
    assert absent.any()


def test_an_outlier_counts_linearly() -> None:
    """Moving an outlier twice as far leaves the curve where it is."""
    parameters, x, y, importance = planted_problems(20, records=25, noise=0.0, seed=7)
    everywhere = np.repeat(X[:, None], 20, axis=1)
    outlying, farther = y.copy(), y.copy()
    outlying[0] += 0.5
    farther[0] += 1.0
    curve, curve_farther = (tanh_curve(fit_tanh(x, each, importance), everywhere) for each in (outlying, farther))
    truth = tanh_curve(parameters, everywhere)
    assert np.median(np.abs(curve - truth)) < 0.01
    assert np.median(np.abs(curve_farther - curve)) < 0.002


def test_equal_changes_and_single_records_give_a_constant() -> None:
    x = np.array([[0.1, 0.4], [0.5, 0.6], [0.9, 0.7]])
    y = np.array([[0.3, -0.2], [0.3, 7.0], [0.3, 7.0]])
    importance = np.array([[1.0, 0.5], [1.0, 0.0], [1.0, 0.0]])
    curves = tanh_curve(fit_tanh(x, y, importance), np.repeat(X[:, None], 2, axis=1))
    np.testing.assert_allclose(curves, np.broadcast_to([0.3, -0.2], curves.shape), atol=1e-12)

"""Task selection against the greedy rule written out, ties included, and its parts against their definitions."""

import moocore
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from jmorl.search.pareto import hypervolume, non_dominated, sparsity
from jmorl.search.selection import select_tasks, sparsities_with, sparsity_limits

# multiples of 1/4: hypervolumes are exact, so ties are true ties; many predictions are equal or dominated
quarters = st.integers(-1, 8).map(lambda n: n / 4)


@st.composite
def problems(draw: st.DrawFn, objectives: st.SearchStrategy[int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Predictions [C, W, M], a front [N, M] and a reference point [M]."""
    m = draw(objectives)
    predictions = draw(arrays(float, st.tuples(st.integers(1, 4), st.integers(1, 4), st.just(m)), elements=quarters))
    front = draw(arrays(float, st.tuples(st.integers(0, 7), st.just(m)), elements=quarters))
    return predictions, front, draw(arrays(float, m, elements=quarters))


def greedy_choices(
    predictions: np.ndarray,
    front: np.ndarray,
    reference: np.ndarray,
    count: int,
    sparsity_weight: float,
    generator: np.random.Generator,
) -> list[tuple[int, int]]:
    """The rule, word by word."""
    candidates, weights, _ = predictions.shape
    pairs = [(c, w) for c in range(candidates) for w in range(weights)]
    order = [pairs[index] for index in generator.permutation(len(pairs))]
    taken: list[tuple[int, int]] = []
    while len(taken) < min(count, len(order)):
        scores = {}
        for pair in order:
            if pair not in taken:
                extended = np.vstack([front, predictions[pair]])
                extended = extended[non_dominated(extended)]
                scores[pair] = hypervolume(extended, reference) - sparsity_weight * sparsity(extended)
        most = max(scores.values())
        taken.append(next(pair for pair, score in scores.items() if score >= most - 1e-12))
        front = np.vstack([front, predictions[taken[-1]]])
    return (taken * count)[:count]


@given(problems(st.integers(2, 4)), st.integers(1, 6), st.sampled_from([0.0, 0.5, 1.0]), st.integers(0, 99))
def test_selection_is_the_greedy_rule(
    problem: tuple[np.ndarray, np.ndarray, np.ndarray], count: int, sparsity_weight: float, seed: int
) -> None:
    predictions, front, reference = problem
    arguments = (predictions, front, reference, count, sparsity_weight)
    tasks = select_tasks(*arguments, np.random.default_rng(seed))
    expected = greedy_choices(*arguments, np.random.default_rng(seed))
    assert [(task.candidate, task.weight) for task in tasks] == expected
    for task in tasks:
        np.testing.assert_array_equal(task.predicted, predictions[task.candidate, task.weight])


@pytest.mark.parametrize("objectives", [2, 3, 5])
def test_selection_is_the_greedy_rule_without_ties(objectives: int) -> None:
    generator = np.random.default_rng(objectives)
    directions = np.abs(generator.normal(size=(15, objectives)))
    front = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    predictions = np.abs(generator.normal(size=(6, 5, objectives))) * 0.6
    arguments = (predictions, front, np.full(objectives, -0.1), 6, 1.0)
    tasks = select_tasks(*arguments, np.random.default_rng(0))
    expected = greedy_choices(*arguments, np.random.default_rng(0))
    assert [(task.candidate, task.weight) for task in tasks] == expected


@given(problems(st.integers(2, 4)))
def test_sparsities_are_those_of_the_extended_fronts(problem: tuple[np.ndarray, np.ndarray, np.ndarray]) -> None:
    points, front, _ = uncovered(*problem)
    expected = [sparsity(np.vstack([front, point])) for point in points]
    np.testing.assert_allclose(sparsities_with(points, front), expected, rtol=1e-12)


@given(problems(st.integers(2, 5)))
def test_sparsities_keep_to_their_limits(problem: tuple[np.ndarray, np.ndarray, np.ndarray]) -> None:
    points, front, _ = uncovered(*problem)
    assert (sparsity_limits(points, front) <= sparsities_with(points, front)).all()


def test_limits_of_sparsities_are_close() -> None:
    """Where a point beats no member they are the sparsities, but for a member more in the mean."""
    front, points = sphere(30, 4, seed=0), sphere(20, 4, seed=1)
    limits, exact = sparsity_limits(points, front), sparsities_with(points, front)
    np.testing.assert_allclose(limits, exact, rtol=1e-6)


@pytest.mark.parametrize(("objectives", "members"), [(4, 60), (5, 60), (6, 40)])
def test_with_many_objectives_and_pairs_the_choice_is_next_to_the_best(objectives: int, members: int) -> None:
    """More pairs than are compared, so that it depends on the estimates which are; scored by exact hypervolumes."""
    front, reference = sphere(members, objectives, seed=2), np.full(objectives, -0.1)
    generator = np.random.default_rng(3)
    predictions = front[:, None] + generator.normal(0.01, 0.03, size=(members, 30, objectives))
    (task,) = select_tasks(predictions, front, reference, 1, 1.0, generator)
    points, front, _ = uncovered(predictions, front, reference)
    scores = np.array([exact_hypervolume(np.vstack([front, point]), reference) for point in points])
    scores -= exact_hypervolume(front, reference) + sparsities_with(points, front) - sparsity(front)
    chosen = scores[(points == task.predicted).all(axis=1)]
    assert len(points) > 1024 and chosen.size == 1
    assert chosen[0] >= 0.9 * scores.max()


@pytest.mark.parametrize("objectives", [4, 8, 31])
def test_many_objectives_give_as_many_tasks_as_asked_for(objectives: int) -> None:
    generator = np.random.default_rng(4)
    front = sphere(20, objectives, seed=4)
    predictions = front[:, None] + generator.normal(0.01, 0.03, size=(20, objectives, objectives))
    arguments = (predictions, front, front.min(axis=0) - 0.1, 6, 1.0)
    tasks, again = (select_tasks(*arguments, np.random.default_rng(0)) for _ in range(2))
    assert [(t.candidate, t.weight) for t in tasks] == [(t.candidate, t.weight) for t in again]
    assert len({(task.candidate, task.weight) for task in tasks}) == 6


def sphere(count: int, objectives: int, seed: int) -> np.ndarray:
    """Points of the unit sphere, none of which dominates another."""
    directions = np.abs(np.random.default_rng(seed).normal(size=(count, objectives)))
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


def exact_hypervolume(values: np.ndarray, reference: np.ndarray) -> float:
    return float(moocore.hypervolume(values.copy(), ref=reference, maximise=True))


def uncovered(
    predictions: np.ndarray, front: np.ndarray, reference: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The predictions that no member of the front is at least as good as; the front; the reference."""
    front = front[non_dominated(front)]
    points = predictions.reshape(-1, predictions.shape[2])
    covered = np.any(np.all(front[None] >= points[:, None], axis=2), axis=1)
    return points[~covered], front, reference


def test_large_problems_are_worked_off_in_parts() -> None:
    """More numbers than fit into one intermediate array."""
    generator = np.random.default_rng(0)
    angles = np.linspace(0.0, np.pi / 2, 600)
    front = np.stack([np.sin(angles), np.cos(angles)], axis=1)
    points = 0.7 + 0.3 * generator.uniform(size=(900, 2))
    points = points[(points**2).sum(axis=1) > 1]
    found = sparsities_with(points, front)
    some = [0, len(points) // 2, len(points) - 1]
    assert len(points) * len(front) > 2**18
    np.testing.assert_allclose(found[some], [sparsity(np.vstack([front, points[i]])) for i in some], rtol=1e-10)


def test_a_dominated_prediction_may_win() -> None:
    """An extension that costs more sparsity than it gains hypervolume is worse than no change."""
    front = np.array([[1.0, 1.0], [1.25, 0.75]])
    predictions = np.array([[[9.0, 0.0], [0.5, 0.5]]])
    for weight, chosen in [(0.0, 0), (1.0, 1)]:
        (task,) = select_tasks(predictions, front, np.array([0.0, -0.1]), 1, weight, np.random.default_rng(0))
        assert task.weight == chosen


def test_each_choice_extends_the_front_for_the_next() -> None:
    """The second best alone is next to the best, and adds little after it."""
    predictions = np.array([[[2.0, 1.0], [1.9, 1.0], [0.5, 1.2]]])
    tasks = select_tasks(predictions, np.zeros((0, 2)), np.zeros(2), 2, 0.0, np.random.default_rng(0))
    assert [task.weight for task in tasks] == [0, 2]


def test_ties_are_broken_by_the_generator_alone() -> None:
    predictions = np.full((3, 4, 3), 0.5)
    arguments = (predictions, np.ones((1, 3)), np.zeros(3), 1, 1.0)
    picks = [select_tasks(*arguments, np.random.default_rng(seed))[0] for seed in range(100)]
    again = [select_tasks(*arguments, np.random.default_rng(seed))[0] for seed in range(100)]
    assert [(p.candidate, p.weight) for p in picks] == [(p.candidate, p.weight) for p in again]
    assert {(p.candidate, p.weight) for p in picks} == {(c, w) for c in range(3) for w in range(4)}


def test_every_slot_gets_a_task_when_there_are_fewer_pairs() -> None:
    predictions = np.array([[[1.0, 0.0], [0.0, 1.0]], [[0.5, 0.75], [0.1, 0.1]]])
    tasks = select_tasks(predictions, np.zeros((0, 2)), np.full(2, -1.0), 10, 1.0, np.random.default_rng(0))
    pairs = [(task.candidate, task.weight) for task in tasks]
    assert len(set(pairs[:4])) == 4
    assert pairs == (pairs[:4] * 3)[:10]

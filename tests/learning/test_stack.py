"""Runs that share a program: each as if it were alone, whoever comes, leaves or fails beside it."""

from concurrent.futures import ThreadPoolExecutor

import jax
import numpy as np
import pytest

from jmorl.learning.population import Population, TrainingFault
from jmorl.learning.stack import Stack
from tests.learning.test_population import CONFIG, RATE, WEIGHTS, assert_close
from tests.probes import ThreeWays

GENERATIONS = (1, 3, 2)  # of three runs that share a program: two leave before the last


def generations(population, seed, count, iterations=1, weights=WEIGHTS):
    """What a run does: train, evaluate, and again."""
    key = jax.random.key(seed)
    train_states = population.initialize(key)
    for generation in range(count):
        training_key = jax.random.fold_in(key, generation)
        train_states, diagnostics = population.train(train_states, weights, training_key, iterations, RATE)
        returns = population.evaluate(train_states, jax.random.split(jax.random.fold_in(key, 99), 2))
    return train_states, diagnostics, returns


def side_by_side(stack, run, count):
    """`run(population, number)` for so many runs, in threads; what they return, or the error they end with."""

    def one(number, seat):
        with seat:
            try:
                return run(Population(stack.environment, CONFIG, seat), number)
            except Exception as error:
                return error

    with ThreadPoolExecutor(count) as pool:
        return list(pool.map(one, range(count), stack.seats(count), timeout=300))


@pytest.fixture(scope="module")
def stack():
    return Stack(ThreeWays(), CONFIG)


@pytest.fixture(scope="module")
def alone():
    return Population(ThreeWays(), CONFIG)


@pytest.fixture
def calls(stack, monkeypatch):
    """(kind, number of agents) of every call of a program."""
    made = []
    inner = stack._programs_of

    def programs_of(runs):
        class Counted:
            compile = inner(runs).compile
            initialize = inner(runs).initialize

            def train(self, *arguments):
                made.append(("train", len(arguments[1])))
                return inner(runs).train(*arguments)

            def evaluate(self, *arguments):
                made.append(("evaluate", len(jax.tree.leaves(arguments[0])[0])))
                return inner(runs).evaluate(*arguments)

        return Counted()

    monkeypatch.setattr(stack, "_programs_of", programs_of)
    return made


def test_a_run_in_a_stack_finds_what_it_finds_alone(stack, alone):
    found = side_by_side(stack, lambda population, number: generations(population, number, GENERATIONS[number]), 3)
    for number, (train_states, diagnostics, returns) in enumerate(found):
        expected = generations(alone, number, GENERATIONS[number])
        assert_close(train_states, expected[0])
        assert_close(diagnostics, expected[1], 1e-4)
        assert_close(returns, expected[2], 1e-4)


def test_calls_that_are_alike_are_one_call_for_those_runs_that_are_left(stack, calls):
    side_by_side(stack, lambda population, number: generations(population, number, GENERATIONS[number]), 3)
    agents = [12, 8, 4]  # three runs of four, then two, then one
    assert calls == [(kind, count) for count in agents for kind in ("train", "evaluate")]


def test_calls_of_other_schedules_are_made_apart(stack, alone, calls):
    found = side_by_side(stack, lambda population, number: generations(population, number, 1, iterations=1 + number), 2)
    assert calls == [("train", 4), ("train", 4), ("evaluate", 8)]
    for number, (train_states, *_) in enumerate(found):
        assert_close(train_states, generations(alone, number, 1, iterations=1 + number)[0])


def test_a_fault_ends_only_its_own_run(stack, alone):
    weights = [WEIGHTS, WEIGHTS * np.nan, WEIGHTS]
    first, second, third = side_by_side(
        stack, lambda population, number: generations(population, number, 2, weights=weights[number]), 3
    )
    assert isinstance(second, TrainingFault) and "agent 3: loss is not finite in iteration 1" in str(second)
    assert_close(first[0], generations(alone, 0, 2)[0])
    assert_close(third[0], generations(alone, 2, 2)[0])


def test_what_goes_wrong_in_a_call_is_told_to_every_run_that_is_in_it(stack, monkeypatch):
    def fail(runs):
        raise MemoryError("no room for so many agents")

    monkeypatch.setattr(stack, "_programs_of", fail)
    keys = jax.random.split(jax.random.key(0), 2)
    found = side_by_side(stack, lambda population, number: population.evaluate({}, keys), 2)
    assert [str(error) for error in found] == ["no room for so many agents"] * 2


def test_seats_are_taken_only_after_all_have_been_left(stack):
    seats = stack.seats(1)
    with pytest.raises(ValueError, match="have not left their seats"):
        stack.seats(2)
    with seats[0]:
        pass
    assert len(stack.seats(2)) == 2
    for number in range(2):
        stack.leave(number)

"""Runs that share a program: each as if it were alone, whoever comes, leaves or fails beside it."""

from concurrent.futures import ThreadPoolExecutor

import jax
import numpy as np
import pytest

from jmorl.learning.population import Population, TrainingFault
from jmorl.learning.programs import Programs
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


def side_by_side(environment, run, count):
    """Run `run(population, number)` for each of some runs, in threads; return results, or the errors they end with."""
    stack = Stack(environment, CONFIG.learning, count)

    def one(number, population):
        with population:
            try:
                return run(population, number)
            except Exception as error:
                return error

    with ThreadPoolExecutor(count) as pool:
        return list(pool.map(one, range(count), stack.populations, timeout=300))


@pytest.fixture(scope="module")
def environment():
    return ThreeWays()


@pytest.fixture(scope="module")
def alone(environment):
    return Population(environment, CONFIG.learning)


@pytest.fixture
def calls(monkeypatch):
    """(kind, number of agents) of every call of a program."""
    made = []
    train, evaluate = Programs.train, Programs.evaluate

    def counted_train(self, *arguments):
        made.append(("train", len(arguments[1])))
        return train(self, *arguments)

    def counted_evaluate(self, *arguments):
        made.append(("evaluate", len(jax.tree.leaves(arguments[0])[0])))
        return evaluate(self, *arguments)

    monkeypatch.setattr(Programs, "train", counted_train)
    monkeypatch.setattr(Programs, "evaluate", counted_evaluate)
    return made


def test_a_run_in_a_stack_finds_what_it_finds_alone(environment, alone):
    found = side_by_side(
        environment, lambda population, number: generations(population, number, GENERATIONS[number]), 3
    )
    for number, (train_states, diagnostics, returns) in enumerate(found):
        expected = generations(alone, number, GENERATIONS[number])
        assert_close(train_states, expected[0])
        assert_close(diagnostics, expected[1], 1e-4)
        assert_close(returns, expected[2], 1e-4)


def test_calls_that_are_alike_are_one_call_for_those_runs_that_are_left(environment, calls):
    side_by_side(environment, lambda population, number: generations(population, number, GENERATIONS[number]), 3)
    agents = [12, 8, 4]  # three runs of four, then two, then one
    assert calls == [(kind, count) for count in agents for kind in ("train", "evaluate")]


def test_calls_of_other_schedules_are_made_apart(environment, alone, calls):
    def run(population, number):
        return generations(population, number, 1, iterations=1 + number)

    found = side_by_side(environment, run, 2)
    assert calls == [("train", 4), ("train", 4), ("evaluate", 8)]
    for number, (train_states, *_) in enumerate(found):
        assert_close(train_states, generations(alone, number, 1, iterations=1 + number)[0])


def test_a_fault_ends_only_its_own_run(environment, alone):
    weights = [WEIGHTS, WEIGHTS * np.nan, WEIGHTS]
    first, second, third = side_by_side(
        environment, lambda population, number: generations(population, number, 2, weights=weights[number]), 3
    )
    assert isinstance(second, TrainingFault) and "agent 3: loss is not finite in iteration 1" in str(second)
    assert_close(first[0], generations(alone, 0, 2)[0])
    assert_close(third[0], generations(alone, 2, 2)[0])


def test_what_goes_wrong_in_a_call_is_told_to_every_run_that_is_in_it(environment, monkeypatch):
    def fail(*arguments):
        raise MemoryError("no room for so many agents")

    monkeypatch.setattr(Programs, "evaluate", fail)
    keys = jax.random.split(jax.random.key(0), 2)
    found = side_by_side(environment, lambda population, number: population.evaluate({}, keys), 2)
    assert [str(error) for error in found] == ["no room for so many agents"] * 2

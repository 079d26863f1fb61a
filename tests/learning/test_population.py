"""A population is its agents, each as if it were alone, whatever the order and the number of devices."""

from contextlib import nullcontext

import jax
import numpy as np
import pytest

from jmorl.config import Config
from jmorl.learning.moppo import MOPPO, Schedule
from jmorl.learning.population import Population, TrainingFault
from jmorl.learning.programs import Programs, device_count
from tests.probes import Faulty, ThreeWays

CONFIG = Config(
    population={"agents": 4, "warmup_iterations": 2, "iterations": 3},
    ppo={"environments": 3, "rollout_steps": 16, "minibatches": 4, "epochs": 2},
    evaluation={"episodes": 2},
)
WEIGHTS = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0.2, 0.3, 0.5]])
ITERATIONS = 3
RATE = 3e-4


def compiled(environment, config=CONFIG):
    population = Population(environment, config.learning)
    population.compile()
    return population


@pytest.fixture(scope="module")
def population():
    return compiled(ThreeWays())


@pytest.fixture(scope="module")
def start(population):
    return population.initialize(jax.random.key(0))


def agent(tree, index):
    return jax.tree.map(lambda leaf: leaf[index], tree)


def assert_close(left, right, tolerance=1e-5):
    for a, b in zip(jax.tree.leaves(left), jax.tree.leaves(right), strict=True):
        np.testing.assert_allclose(a, b, rtol=tolerance, atol=tolerance)


def test_an_iteration_is_timed_once(population, monkeypatch):
    population.compile()
    seconds = population.iteration_seconds()
    monkeypatch.setattr(population.programs, "train", None)
    assert population.iteration_seconds() == seconds > 0


def test_agents_start_different(start):
    kernels = start.parameters["actor"]["params"]["MLP_0"]["Dense_0"]["kernel"]
    assert len(np.unique(kernels.reshape(len(kernels), -1), axis=0)) == len(kernels)


def test_an_agent_in_the_population_is_the_agent_alone(population, start):
    key = jax.random.key(1)
    together, _ = population.train(start, WEIGHTS, key, ITERATIONS, RATE)
    alone = jax.jit(MOPPO(ThreeWays(), CONFIG.ppo).train)
    for index, agent_key in enumerate(jax.random.split(key, 4)):
        single, _ = alone(agent(start, index), WEIGHTS[index].astype(np.float32), agent_key, Schedule(ITERATIONS, RATE))
        assert_close(agent(together, index), single)


def test_permuted_agents_give_permuted_results(population, start):
    """In one call only tasks differ between agents, so their order must not matter, given the keys."""
    order = np.array([2, 0, 3, 1])
    keys = jax.random.split(jax.random.key(1), 4)
    plain, _ = population.programs.train(
        start, WEIGHTS.astype(np.float32), keys, Schedule(np.int32(ITERATIONS), np.float32(RATE))
    )
    permuted, _ = population.programs.train(
        agent(start, order),
        WEIGHTS[order].astype(np.float32),
        keys[order],
        Schedule(np.int32(ITERATIONS), np.float32(RATE)),
    )
    assert_close(agent(plain, order), permuted)


def test_one_device_or_two_is_the_same(population, start, monkeypatch):
    assert population.devices == 2
    monkeypatch.setattr("jmorl.learning.programs.device_count", lambda agents, available: 1)
    single = compiled(ThreeWays())
    assert single.devices == 1
    assert_close(
        population.train(start, WEIGHTS, jax.random.key(1), ITERATIONS, RATE),
        single.train(start, WEIGHTS, jax.random.key(1), ITERATIONS, RATE),
    )


def test_in_float64_an_agent_the_order_and_the_devices_differ_by_rounding_alone(monkeypatch):
    schedule = Schedule(np.int32(ITERATIONS), np.float64(RATE))
    config = CONFIG.replace(ppo={"hidden_sizes": (4,)})
    order = np.array([2, 0, 3, 1])
    for module in ("execution", "programs"):  # whose settings would be those of float32
        monkeypatch.setattr(f"jmorl.learning.{module}.own_settings", nullcontext)
    with jax.enable_x64(True), jax.numpy_dtype_promotion("standard"):
        programs, keys = Programs(ThreeWays(), config.learning), jax.random.split(jax.random.key(1), 4)
        start = jax.tree.map(in_float64, programs.initialize(jax.random.split(jax.random.key(0), 4)))
        together, _ = programs.train(start, WEIGHTS, keys, schedule)
        permuted, _ = programs.train(agent(start, order), WEIGHTS[order], keys[order], schedule)
        alone = jax.jit(programs.moppo.train)
        singles = [alone(agent(start, index), WEIGHTS[index], keys[index], schedule)[0] for index in range(4)]
        monkeypatch.setattr("jmorl.learning.programs.device_count", lambda agents, available: 1)
        on_one_device, _ = Programs(ThreeWays(), config.learning).train(start, WEIGHTS, keys, schedule)
    assert {leaf.dtype for leaf in jax.tree.leaves(together.parameters)} == {np.dtype(np.float64)}
    for index, single in enumerate(singles):
        assert_close(agent(together, index), single, 1e-10)
    assert_close(agent(together, order), permuted, 1e-10)
    assert_close(together, on_one_device, 1e-10)


def test_populations_of_one_environment_and_one_config_share_their_programs():
    environment = ThreeWays()
    first = Population(environment, CONFIG.learning)
    assert Population(environment, CONFIG.replace(seed=2, user="B").learning).programs is first.programs
    assert Population(environment, CONFIG.replace(ppo={"epochs": 3}).learning).programs is not first.programs
    # Another instance may have other options under the same id.
    assert Population(ThreeWays(), CONFIG.learning).programs is not first.programs


def in_float64(leaf):
    return leaf.astype(np.float64) if leaf.dtype == np.float32 else leaf


def test_agents_with_the_same_parent_differ_by_their_keys(population, start):
    same = agent(start, np.zeros(4, int))
    trained, _ = population.train(same, np.tile(WEIGHTS[3], (4, 1)), jax.random.key(1), 1, RATE)
    kernels = trained.parameters["actor"]["params"]["MLP_0"]["Dense_0"]["kernel"]
    assert len(np.unique(kernels.reshape(4, -1), axis=0)) == 4


def test_after_compiling_nothing_is_traced_or_compiled_again(population, start):
    import jax.monitoring

    events = []
    jax.monitoring.register_event_duration_secs_listener(lambda event, *_, **__: events.append(event))
    population.train(start, WEIGHTS, jax.random.key(1), 1, RATE)  # keys are split here for the first time
    events.clear()
    trained, _ = population.train(start, WEIGHTS, jax.random.key(2), 2, RATE)
    population.evaluate(trained, jax.random.split(jax.random.key(9), 2))
    assert not [event for event in events if "trac" in event or "compile" in event]
    jax.jit(lambda x: x + 1)(np.ones(3))
    assert [event for event in events if "compile" in event], "the listener must see a compilation"


def test_evaluation_is_repeatable_and_leaves_train_states_alone(population, start):
    keys = jax.random.split(jax.random.key(9), 2)
    before = jax.tree.map(np.copy, start)
    first, second = population.evaluate(start, keys), population.evaluate(start, keys)
    np.testing.assert_array_equal(first.undiscounted, second.undiscounted)
    for a, b in zip(jax.tree.leaves(before), jax.tree.leaves(start), strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize(("agents", "available", "expected"), [(6, 2, 2), (6, 4, 3), (5, 4, 1), (6, 8, 6), (7, 7, 7)])
def test_devices_divide_the_population(agents, available, expected):
    assert device_count(agents, available) == expected


@pytest.mark.parametrize("value", [np.nan, np.inf])
@pytest.mark.parametrize(
    ("where", "component", "name"),
    [
        ("observation", slice(None), r"observation\[0\]"),
        ("observation", 1, r"observation\[1\]"),
        ("reward", slice(1, None), "reward of east"),
        ("reward", 2, "reward of west"),
    ],
)
def test_numbers_that_are_not_finite_are_found_in_their_iteration_and_named(where, component, name, value):
    # Episodes of ten steps and rollouts of four: the seventh step of an episode falls into the second rollout.
    config = CONFIG.replace(ppo={"rollout_steps": 4, "environments": 2, "minibatches": 2})
    population = compiled(Faulty(where, breaks_at=7, value=value, component=component), config)
    start = population.initialize(jax.random.key(0))
    population.train(start, WEIGHTS, jax.random.key(1), 1, RATE)
    with pytest.raises(TrainingFault, match=f"agent 0: {name} is not finite in iteration 2; agent 1") as error:
        population.train(start, WEIGHTS, jax.random.key(1), 3, RATE)
    assert str(error.value).count("agent") == 4


def test_a_broken_train_state_is_found_and_named(population, start):
    broken = jax.tree.map(np.copy, start)
    broken.parameters["critic"]["params"]["Dense_0"]["bias"][2] = np.nan
    with pytest.raises(TrainingFault, match="^agent 2: loss is not finite in iteration 1$"):
        population.train(broken, WEIGHTS, jax.random.key(1), 2, RATE)

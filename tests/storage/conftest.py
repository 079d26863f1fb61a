"""States of runs made by hand: what is stored must come back, whatever it is."""

import jax
import numpy as np
import pytest

import envs
from jmorl.learning.moppo import MOPPO
from jmorl.loop import make_method
from jmorl.methods.pgmorl import PGMORLState
from jmorl.search.archive import Archive
from jmorl.search.buffer import PerformanceBuffer
from jmorl.search.policy import Policy
from jmorl.search.prediction import Records
from jmorl.search.scouts import Scouts
from jmorl.state import RunState
from jmorl.units import RunningUnits


@pytest.fixture(scope="package")
def environment(small_config):
    return envs.make(small_config.env)


@pytest.fixture(scope="package")
def method(small_config, environment):
    return make_method(small_config, environment)


@pytest.fixture(scope="package")
def make_policy(small_config, environment):
    """A policy with random numbers in every place of its snapshot."""
    shape = jax.eval_shape(MOPPO(environment, small_config.ppo).initial_train_state, jax.random.key(0))

    def make(number):
        generator = np.random.default_rng(number)

        def draw(leaf):
            return (generator.normal(size=leaf.shape) * 1000).astype(leaf.dtype)

        vectors = {name: generator.normal(size=3) for name in ("weights", "values", "std", "discounted")}
        warm_up = number < 4
        return Policy(
            id=number,
            generation=number // 4,
            parent=None if warm_up else number - 4,
            snapshot=jax.tree.map(draw, shape),
            predicted=None if warm_up else generator.normal(size=3),
            interval=None if warm_up else generator.normal(size=(2, 3)),
            raw=generator.normal(size=3),
            **vectors,
        )

    return make


@pytest.fixture
def make_state(make_policy, small_config):
    """The state after a generation: archive, buffer and choice share some of their policies."""

    def make(generation):
        generator = np.random.default_rng(generation)
        policies = [make_policy(number) for number in range(4 * generation + 4)]
        search = small_config.search
        return RunState(
            search=PGMORLState(
                buffer=PerformanceBuffer(search.buffer_bins, search.buffer_size, tuple(policies[1:])),
                records=Records(*generator.normal(size=(4, 4 * generation, 3))),
                bounds=generator.normal(size=3) if generation else np.full(3, -np.inf),
                silent_generations=generation,
                widenings=generation + 1,
                generations_with_choice=generation + 2,
                limits=(-np.inf, 1.0, 2.0 + generation),
                scouts=Scouts(tuple(policies[:2]), (policies[-1],), generation, 3 * generation),
            ),
            archive=Archive((policies[3], policies[0], policies[-1])),
            units=RunningUnits(*generator.normal(size=(4, 3))),
            reference_point=generator.normal(size=3),
            choice=policies[2] if generation else None,
            generation=generation,
            iterations=10 * generation,
            evaluation_steps=2**40 + generation,
            policies=len(policies),
            blendings=generation,
            questions=5,
            policies_shown=17,
        )

    return make

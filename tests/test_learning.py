"""What a whole run learns on MountainCar, against the exact front from the same starts. Minutes long."""

import jax
import numpy as np
import pytest

import envs
from benchmarks.exact_front import exact_front
from jmorl.config import resolve
from jmorl.decision.utility import USERS
from jmorl.events import GenerationFinished, RunFinished
from jmorl.loop import evaluation_keys, run
from jmorl.search.policy import values_of

pytestmark = pytest.mark.slow

BEATS = 1.0  # per cent: the exact front is too low by less than that, and nothing lies beyond it
DISTANCE = 5.0  # per cent: how short of the front the policy may be that user A is given
WEIGHTS = np.array(list(USERS.values()))  # [W, 2]


@pytest.fixture(scope="module")
def config():
    return resolve(overrides={"env": "mo-mountaincarcontinuous-v0", "method": "interactive", "user": "A", "seed": "3"})


@pytest.fixture(scope="module")
def events(config):
    return list(run(config))


@pytest.fixture(scope="module")
def exact(config):
    """The best utility [W] that any policy has from the starts of the run's evaluation."""
    starts = jax.vmap(envs.make(config.env).initial_state)(evaluation_keys(config)).position
    return (exact_front(WEIGHTS, np.asarray(starts, np.float64)) * WEIGHTS).sum(axis=1)


def test_no_policy_of_a_run_beats_the_exact_front(events, exact):
    policies = [policy for event in events if isinstance(event, GenerationFinished) for policy in event.offspring]
    beyond = 100 * (values_of(policies) @ WEIGHTS.T - exact) / np.abs(exact)  # [N, W]
    assert beyond.max() < BEATS


def test_the_chosen_policy_comes_close_to_the_exact_front(events, exact):
    finished = events[-1]
    assert isinstance(finished, RunFinished)
    user = list(USERS).index("A")
    shortfall = 100 * (exact[user] - finished.chosen.values @ WEIGHTS[user]) / abs(exact[user])
    assert shortfall < DISTANCE

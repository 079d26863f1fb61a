"""No key is used twice: every key that a run draws numbers from, recorded while it runs."""

from collections import Counter

import jax
import numpy as np
import pytest

from jmorl.learning.moppo import MOPPO
from jmorl.loop import evaluation_keys, run
from tests.probes import ThreeWays

DRAWS = ("normal", "uniform", "bits")
DERIVATIONS = ("split", "fold_in")


def key_words(keys):
    """Keys of any shape as tuples of their words."""
    return [tuple(words) for words in np.asarray(jax.random.key_data(keys)).reshape(-1, 2).tolist()]


def recorded(patch, config):
    """Run `config`; how often each key was drawn from, and the keys that others were derived from.

    Evaluation is left out: all policies start from the same keys, on purpose.
    """
    used = {name: Counter() for name in (*DRAWS, *DERIVATIONS)}

    def recording(name, function):
        def wrapper(key, *arguments, **settings):
            jax.debug.callback(lambda words: used[name].update([tuple(words.tolist())]), jax.random.key_data(key))
            return function(key, *arguments, **settings)

        return wrapper

    starts = key_words(evaluation_keys(config))
    for name in used:
        patch.setattr(jax.random, name, recording(name, getattr(jax.random, name)))
    for _ in run(config, environment=ThreeWays()):  # an instance of its own is compiled anew, with the recording
        pass
    jax.effects_barrier()
    drawn = sum((used[name] for name in DRAWS), Counter())
    derived = set().union(*(used[name] for name in DERIVATIONS))
    for key in starts:
        drawn.pop(key, None)
        derived.discard(key)
    return drawn, derived


@pytest.fixture
def config(small_config):
    """A warm-up of one iteration and a generation of two."""
    return small_config.replace(
        population={"agents": 2, "warmup_iterations": 1, "iterations": 2},
        ppo={"environments": 2, "rollout_steps": 4, "minibatches": 2, "epochs": 2, "hidden_sizes": (4,)},
        steps=2 * 2 * 4 * 2,
    )


@pytest.mark.slow
def test_no_key_is_used_twice(monkeypatch, config):
    drawn, derived = recorded(monkeypatch, config)
    layers, resets, orders = 4, 2 * 2, 2  # of an agent: initialised, at the start of two trainings, per iteration
    noise_and_resets = 2 * (1 + 4)  # of an agent in an iteration
    trial = layers + resets // 2 + noise_and_resets + orders  # the iteration that tells how fast a run is
    assert len(drawn) == 2 * (layers + resets + 3 * (noise_and_resets + orders) + trial)
    assert set(drawn.values()) == {1}
    assert not derived & set(drawn)


@pytest.mark.slow
def test_a_key_that_is_used_twice_is_found(monkeypatch, config):
    collect = MOPPO.collect

    def careless(self, train_state, rollout_state, key):
        jax.random.normal(key)
        return collect(self, train_state, rollout_state, key)

    monkeypatch.setattr(MOPPO, "collect", careless)
    drawn, derived = recorded(monkeypatch, config)
    assert derived & set(drawn)

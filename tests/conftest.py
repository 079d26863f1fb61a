"""One JAX set-up for the whole suite: two CPU devices, whatever the machine, and compiled programs kept on disk."""

import hypothesis
import jax
import pytest

from jmorl.config import Config
from jmorl.learning.devices import use_all_cpu_cores
from jmorl.presets import PAPER_RULE, merged
from tests.registered import ThreeWays
from tests.resuming import train

use_all_cpu_cores()
jax.config.update("jax_num_cpu_devices", 2)
jax.config.update("jax_numpy_rank_promotion", "raise")
jax.config.update("jax_numpy_dtype_promotion", "strict")

# Examples are the same in every run, and a slow machine is no failure.
hypothesis.settings.register_profile("jmorl", deadline=None, derandomize=True)
hypothesis.settings.load_profile("jmorl")


@pytest.fixture(scope="session")
def small_config():
    """A run of seconds with three objectives: a warm-up and three generations, with a question before each."""
    sizes = {
        "env": ThreeWays.id,
        "user": "weights=0.5,0.3,0.2",
        "population": {"agents": 4, "warmup_iterations": 2, "iterations": 3},
        "ppo": {"environments": 3, "rollout_steps": 16, "minibatches": 4, "epochs": 2},
        "evaluation": {"episodes": 2},
        "search": {"weight_divisions": 4},
        "steps": 4 * 3 * 16 * 11,
    }
    return Config.model_validate(merged(PAPER_RULE, sizes))


@pytest.fixture(scope="module")
def whole(small_config, tmp_path_factory):
    """The folder of a run that nobody interrupted: warm-up, three generations, four questions."""
    return train(tmp_path_factory.mktemp("runs") / "whole", small_config)

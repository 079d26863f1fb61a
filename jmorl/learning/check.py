"""Whether the programs of a run can be built, found out before anything is made: traced, and not computed."""

from collections.abc import Callable
from typing import Any
from weakref import WeakValueDictionary

import jax
import numpy as np

from envs.checks import NotAsDeclared, check_environment, name_of
from envs.core import Environment
from envs.failures import failure
from jmorl.learning.execution import own_settings
from jmorl.learning.memory import check_memory
from jmorl.learning.moppo import MOPPO, Schedule
from jmorl.learning.settings import EvaluationConfig, LearningConfig, PPOConfig

MOST_BYTES = 2**32  # of what evaluation keeps for every step up to the time limit

# By the `id` of an environment and what else its programs depend on: tracing takes a while.
_checked: WeakValueDictionary[tuple[int, PPOConfig, EvaluationConfig], Environment[Any]] = WeakValueDictionary()


def check_run(
    environment: Environment[Any], config: LearningConfig, again: Environment[Any] | None = None, runs: int = 1
) -> None:
    """Raise NotAsDeclared for an environment that a run with `config` cannot use, DoesNotFit for one that is too large.

    `again` is what the run's id stands for, made anew: it must be the same. `runs` is how many share a program.
    """
    with own_settings():
        check_environment(environment, again if type(again) is type(environment) else None)
        _check_length(environment, config)
        check_memory(environment, config, runs)
        settings = id(environment), config.ppo, config.evaluation
        if _checked.get(settings) is not environment:
            _trace_programs(environment, config.ppo, config.evaluation)
            _checked[settings] = environment


def _check_length(environment: Environment[Any], config: LearningConfig) -> None:
    """Rewards that make traces, and noise drawn ahead, take room up to the time limit, however short episodes are."""
    evaluation, limit = config.evaluation, int(environment.time_limit)
    numbers = len(environment.objectives) if evaluation.units == "paper" else 0
    numbers += int(environment.action_size) if evaluation.actions == "sampled" else 0
    needed = 4 * numbers * limit * evaluation.episodes * config.agents
    if needed > MOST_BYTES:
        raise NotAsDeclared(
            f"evaluation: with units {evaluation.units} and actions {evaluation.actions}, {evaluation.episodes} "
            f"episodes of up to {limit:,} steps for each of {config.agents} agents take "
            f"{needed / 2**30:,.0f} GiB, and {MOST_BYTES / 2**30:,.0f} at most can be had; take fewer episodes, or "
            "an environment with a lower time_limit"
        )


def _trace_programs(environment: Environment[Any], ppo: PPOConfig, evaluation: EvaluationConfig) -> None:
    """Trace training and evaluation of one agent. Raises NotAsDeclared."""
    moppo = MOPPO(environment, ppo)
    key = jax.eval_shape(lambda: jax.random.key(0))
    keys = jax.eval_shape(lambda: jax.random.split(jax.random.key(0), evaluation.episodes))
    weights = jax.ShapeDtypeStruct((len(environment.objectives),), np.float32)
    sampled, traced = evaluation.actions == "sampled", evaluation.units == "paper"
    train_state = _traced(environment, "training", moppo.initial_train_state, key)
    _traced(environment, "training", moppo.train, train_state, weights, key, Schedule(np.int32(0), np.float32(0)))
    _traced(
        environment, "evaluation", lambda state, keys: moppo.evaluate(state, keys, sampled, traced), train_state, keys
    )


def _traced(environment: Environment[Any], program: str, function: Callable[..., Any], *arguments: Any) -> Any:
    """Return the shapes of what a program gives; raises NotAsDeclared for what stops it."""
    try:
        return jax.eval_shape(function, *arguments)
    except (Exception, SystemExit) as error:
        raise NotAsDeclared(
            f"the program for {program} in environment {name_of(environment)} cannot be built: {failure(error)}"
        ) from error

"""Config formats: which configs are the same, whatever settings were added since.

A config's identity is the hash of its differences from a baseline that never changes. So a new setting, or a new
default, leaves the identity of every earlier run as it was.
"""

import hashlib
import json
from collections.abc import Iterator, Mapping
from typing import Any

FORMAT = 2  # of config.toml

# Frozen: a line is never changed, and a default above it in the code may. A setting that is added gets a line, with the
# value that means what was done before there was such a setting.
BASELINE: Mapping[str, Any] = {
    "env": "mo-mountaincarcontinuous-v0",
    "method": "interactive",
    "user": "A",
    "ask": "always",
    "question": "front",
    "seed": 1,
    "population.agents": 6,
    "population.warmup_iterations": 10,
    "population.iterations": 10,
    "population.weights": [],
    "ppo.environments": 4,
    "ppo.rollout_steps": 1000,
    "ppo.epochs": 10,
    "ppo.minibatches": 32,
    "ppo.learning_rate": 3e-4,
    "ppo.final_learning_rate": 3e-4,
    "ppo.adam_epsilon": 1e-5,
    "ppo.discount": 0.995,
    "ppo.gae_lambda": 0.95,
    "ppo.clip": 0.2,
    "ppo.value_coefficient": 0.5,
    "ppo.entropy_coefficient": 0.0,
    "ppo.action_bound_coefficient": 0.0,
    "ppo.max_gradient_norm": 0.5,
    "ppo.initial_log_std": 0.0,
    "ppo.noise_correlation": 0.0,
    "ppo.hidden_sizes": [64, 64],
    "ppo.weights_on": "raw",
    "evaluation.episodes": 64,
    "evaluation.actions": "deterministic",
    "evaluation.units": "raw",
    "evaluation.scale_discount": 0.995,
    "evaluation.confirmation_episodes": 0,
    "search.delta": 0.1,
    "search.bounds_scale": "range",
    "search.least_slack": 0.0,
    "search.least_within": 0,
    "search.outside_share": 0.0,
    "search.optimism": 0.0,
    "search.final_blends": 0,
    "search.gain_within": "bounds",
    "search.value_scale": "range",
    "search.sparsity_weight": 1.0,
    "search.weight_divisions": 10,
    "search.buffer_bins": 100,
    "search.buffer_size": 4,
    "checkpoints.keep": 20,
    "steps": 2_500_000,
    "reference_point": [],
}
ADDED_SINCE_FORMAT_1 = frozenset(
    {
        "ask",
        "question",
        "evaluation.confirmation_episodes",
        "population.weights",
        "search.least_slack",
        "search.least_within",
        "search.outside_share",
        "search.optimism",
        "search.final_blends",
    }
)
WITHOUT_EFFECT = frozenset({"checkpoints.keep"})  # on results


def identity(settings: Mapping[str, Any]) -> str:
    """Return the hash of nested settings, as JSON has them, without those that do not change results."""
    flat = dict(flat_settings(settings))
    return _digest({name: flat[name] for name in flat.keys() - WITHOUT_EFFECT if flat[name] != BASELINE[name]})


def identity_of_format_1(settings: Mapping[str, Any]) -> str | None:
    """Return the identity in format 1, a hash of every setting; None for settings that format 1 did not have."""
    flat = dict(flat_settings(settings))
    if any(flat[name] != BASELINE[name] for name in ADDED_SINCE_FORMAT_1):
        return None
    return _digest(_nested_settings({name: flat[name] for name in flat.keys() - ADDED_SINCE_FORMAT_1}))


def format_of(settings: Mapping[str, Any]) -> int | None:
    """Return the format of the settings in a file; None if no run wrote it.

    Files of format 1 do not say so, but they have every setting that there was.
    """
    if isinstance(settings.get("format"), int):
        return int(settings["format"])
    return 1 if dict(flat_settings(settings)).keys() >= BASELINE.keys() - ADDED_SINCE_FORMAT_1 else None


def before_settings_were_added() -> dict[str, Any]:
    """Return the settings that a file of an earlier format leaves out, nested."""
    return _nested_settings(BASELINE)


def _digest(content: Any) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:16]


def flat_settings(settings: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Give each setting with its name and the sections it is in, as "ppo.epochs"."""
    for name, value in settings.items():
        if isinstance(value, Mapping):
            yield from flat_settings(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value


def _nested_settings(flat: Mapping[str, Any]) -> dict[str, Any]:
    nested: dict[str, Any] = {}
    for name, value in flat.items():
        *sections, last = name.split(".")
        inner = nested
        for section in sections:
            inner = inner.setdefault(section, {})
        inner[last] = value
    return nested

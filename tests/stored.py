"""Stored policies made by hand: linear in the observation, without a run."""

import json

import numpy as np

import envs
from jmorl.storage.policy_file import FORMAT, StoredPolicy, load_policy


def stored_linear_policy(path, environment_id: str, gain) -> StoredPolicy:
    """Write the policy `action = gain @ observation`, gain [A, O], as a file, and read it back."""
    environment = envs.make(environment_id)
    gain = np.asarray(gain, np.float32).reshape(environment.action_size, environment.observation_size)
    header = {
        "format": FORMAT,
        "environment": environment_id,
        "objectives": [{"name": o.name, "label": o.label, "unit": o.unit} for o in environment.objectives],
        "id": 17,
        "values": [0.0] * len(environment.objectives),
        "discount": 0.9,
    }
    np.savez(
        path,
        header=np.array(json.dumps(header)),
        layer_0_kernel=gain.T,
        layer_0_bias=np.zeros(environment.action_size, np.float32),
        log_std=np.zeros(environment.action_size, np.float32),
        observation_mean=np.zeros(environment.observation_size, np.float32),
        observation_variance=np.ones(environment.observation_size, np.float32),
        **{f"action_{name}": array for name, array in environment.action_box._asdict().items()},
    )
    return load_policy(path)

"""A policy as one file: a NumPy archive with a JSON header, read without pickle and without JAX.

The header names the environment, objectives with their units, mean undiscounted returns, the score the run went by and
its spread, weights and origin, and says how the network is computed; the arrays are the actor's layers, the
observation statistics, and how the network's output is mapped onto the action box. `load_policy(path)(observation)` is
the deterministic action.

Format 1 had the action's limits in its header and only clipped to them.
"""

import importlib.metadata
import json
import shutil
import zipfile
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

import envs
from envs.actions import ActionBox
from envs.core import Environment
from jmorl.config import Config
from jmorl.learning.statistics import NORMALIZED_CLIP, VARIANCE_FLOOR
from jmorl.search.policy import Policy
from jmorl.storage.files import written_whole
from jmorl.storage.versions import NewerFormat, check_format

FORMAT = 2
INPUT = {"variance_floor": VARIANCE_FLOOR, "clip": NORMALIZED_CLIP}


class PolicyFileError(ValueError):
    """A file that is no policy, or one that cannot be used here."""


@dataclass(frozen=True)
class StoredPolicy:
    """A policy read from a file. Call it with observations [..., O] for actions [..., A]."""

    header: dict[str, Any]
    layers: tuple[tuple[np.ndarray, np.ndarray], ...]  # kernel [in, out] and bias [out] of each
    log_std: np.ndarray  # [A]
    observation_mean: np.ndarray  # [O]
    observation_variance: np.ndarray  # [O]
    box: ActionBox

    def __call__(self, observation: np.ndarray) -> np.ndarray:
        """The deterministic action in the environment's own units, within its box."""
        action: np.ndarray = self.action(np.asarray(observation, np.float32))
        return action

    def action(self, observation: Any, xp: ModuleType = np) -> Any:
        """The same; `xp` may be `jax.numpy` to trace it."""
        return self.box.action(self._network(observation, xp), xp)

    def _network(self, observation: Any, xp: ModuleType) -> Any:
        """The mean of the normalised action."""
        floor, limit = self.header["network"]["variance_floor"], self.header["network"]["clip"]
        x = (observation - self.observation_mean) / xp.sqrt(self.observation_variance + floor)
        x = xp.clip(x, -limit, limit)
        for kernel, bias in self.layers[:-1]:
            x = xp.tanh(x @ kernel + bias)
        kernel, bias = self.layers[-1]
        return x @ kernel + bias


def save_policy(
    path: Path, policy: Policy, environment: Environment[Any], config: Config, run: str | None = None
) -> None:
    """Write a policy whose snapshot is a `TrainState`, with where it comes from noted in the header.

    `run` is the id in the run's manifest, if it has one.
    """
    parameters = policy.snapshot.parameters["actor"]["params"]
    layers = [parameters["MLP_0"][f"Dense_{index}"] for index in range(len(parameters["MLP_0"]))]
    header = {
        "format": FORMAT,
        "jmorl": importlib.metadata.version("jmorl"),
        "environment": config.env,
        "objectives": [vars(objective) for objective in environment.objectives],
        "id": policy.id,
        "generation": policy.generation,
        "parent": policy.parent,
        "weights": policy.weights.tolist(),
        "values": (policy.values if policy.raw is None else policy.raw).tolist(),
        "score": policy.values.tolist(),  # other than the values only in paper units
        "std": policy.std.tolist(),
        "discounted": policy.discounted.tolist(),
        "evaluation_episodes": config.evaluation.episodes,
        "discount": config.ppo.discount,
        "run": {"id": run, "config": config.digest(), "method": config.method, "seed": config.seed},
        "network": {
            "sizes": [int(environment.observation_size), *config.ppo.hidden_sizes, int(environment.action_size)],
            "activation": "tanh",
            **INPUT,
        },
    }
    statistics = policy.snapshot.observation_statistics
    arrays = {
        "header": np.array(json.dumps(header)),
        "log_std": parameters["log_std"],
        "observation_mean": statistics.mean,
        "observation_variance": statistics.variance,
        **{f"action_{name}": array for name, array in environment.action_box._asdict().items()},
    }
    for index, layer in enumerate(layers):
        arrays |= {f"layer_{index}_kernel": layer["kernel"], f"layer_{index}_bias": layer["bias"]}
    with written_whole(path) as temporary, temporary.open("wb") as file:
        np.savez(file, **arrays)


def policy_path(place: Path, policy_id: int | None = None) -> Path:
    """Where a policy is: `place` itself if it is a file; of a run folder its choice, or the policy of an id.

    Raises PolicyFileError if there is none.
    """
    if not place.is_dir():
        if policy_id is not None:
            raise PolicyFileError(f"{place} is no run folder, so it has no policy {policy_id}")
        return place
    path = place / ("chosen.npz" if policy_id is None else f"policies/{policy_id:05d}.npz")
    if not path.exists():
        what = "chosen policy; name one by its id" if policy_id is None else f"policy {policy_id}; see its policies/"
        raise PolicyFileError(f"{place} has no {what}")
    return path


def load_policy(path: Path | str) -> StoredPolicy:
    """Read a policy. Raises PolicyFileError, naming the file, if it is not one that can be read, and NewerFormat."""
    try:
        with np.load(path, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
        header = json.loads(str(arrays["header"]))
        check_format(header, FORMAT, header.get("jmorl"), str(path))
        header.setdefault("network", INPUT)  # files of the first versions do not say
        count = sum(name.endswith("_kernel") for name in arrays)
        layers = tuple((arrays[f"layer_{i}_kernel"], arrays[f"layer_{i}_bias"]) for i in range(count))
        box = _clipping_box(header, len(arrays["log_std"])) if header["format"] == 1 else _box(arrays)
        return StoredPolicy(
            header, layers, arrays["log_std"], arrays["observation_mean"], arrays["observation_variance"], box
        )
    except NewerFormat:
        raise
    except (OSError, ValueError, KeyError, TypeError, EOFError, AttributeError, zipfile.BadZipFile) as error:
        raise PolicyFileError(f"{path} is not a policy file: {error}") from error


def _box(arrays: dict[str, np.ndarray]) -> ActionBox:
    """How the network's output is mapped onto the action box."""
    return ActionBox(*(arrays[f"action_{name}"] for name in ActionBox._fields))


def _clipping_box(header: dict[str, Any], size: int) -> ActionBox:
    """The same of a file of format 1."""
    low, high = (np.full(size, limit, np.float32) for limit in header["action_limits"])
    return ActionBox(low, high, np.zeros(size, np.float32), np.ones(size, np.float32))


def policy_environment(environment_id: str) -> Environment[Any]:
    """The environment that a policy's header names. Raises PolicyFileError if it cannot be made here."""
    try:
        return envs.make(environment_id)
    except ValueError as error:
        raise PolicyFileError(f"the policy needs environment {environment_id!r}: {error}") from error


def export_policy(place: Path, policy_id: int | None, target: Path, force: bool = False) -> StoredPolicy:
    """Copy a policy, found as by `policy_path` and readable, to a file that did not exist unless `force` is given.

    Raises PolicyFileError.
    """
    source = policy_path(place, policy_id)
    policy = load_policy(source)
    if target.is_dir():
        raise PolicyFileError(f"{target} is a folder; name a file")
    if target.exists() and not force:
        raise PolicyFileError(f"{target} exists; choose another file, or overwrite it with --force")
    try:
        with written_whole(target) as temporary:
            shutil.copyfile(source, temporary)
    except OSError as error:
        raise PolicyFileError(f"{target} cannot be written: {error.strerror}") from error
    return policy

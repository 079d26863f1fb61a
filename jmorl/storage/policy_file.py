"""A policy as one file: a NumPy archive with a JSON header, read without pickle and without JAX.

The header names the environment, objectives with their units, mean undiscounted returns, the score the run went by and
its spread, weights and origin, and says how the network is computed; the arrays are the actor's layers, the
observation statistics, and how the network's output is mapped onto the action box. `load_policy(path)(observation)` is
the deterministic action.

Format 1 had the action's limits in its header and only clipped to them.
"""

import importlib.metadata
import io
import json
import shutil
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from types import ModuleType
from typing import Any, NotRequired

import numpy as np
from pydantic import TypeAdapter
from typing_extensions import TypedDict

import envs
from envs.actions import ActionBox
from envs.core import Environment
from jmorl.config import Config
from jmorl.learning.statistics import NORMALIZED_CLIP, VARIANCE_FLOOR
from jmorl.search.policy import Blend, Policy
from jmorl.storage.documents import DocumentError, check_fields, json_object
from jmorl.storage.files import written_whole
from jmorl.storage.layout import Layout
from jmorl.storage.versions import NewerFormat, check_format

FORMAT = 2
_STATISTICS = "observation_mean", "observation_variance"
INPUT = {"variance_floor": VARIANCE_FLOOR, "clip": NORMALIZED_CLIP}


class _Objective(TypedDict):
    name: str
    label: str
    unit: str


class _Network(TypedDict):
    variance_floor: float
    clip: float


class _Header(TypedDict):
    """What is relied on of a header; there may be more."""

    environment: str
    objectives: list[_Objective]
    action_limits: NotRequired[list[Any]]  # of the first format; later ones have the box as arrays
    id: int | None  # None for a blend that no run has found
    values: list[float]
    discount: float
    network: _Network


_HEADER = TypeAdapter(_Header)


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
        """Return the deterministic action in the environment's own units, within its box.

        Raises ValueError for observations of another size.
        """
        observation, size = np.asarray(observation, np.float32), len(self.observation_mean)
        if observation.shape[-1:] != (size,):
            raise ValueError(f"an observation has {size} numbers, not shape {observation.shape}")
        action: np.ndarray = self.action(observation)
        return action

    def action(self, observation: Any, xp: ModuleType = np) -> Any:
        """Return the deterministic action; `xp` may be `jax.numpy` to trace it."""
        return self.box.action(self._network(observation, xp), xp)

    def arrays(self) -> dict[str, Any]:
        """Return all that an action depends on, to be traced: `StoredPolicy.of_arrays` gives the policy again."""
        return {
            "header": {"network": {name: self.header["network"][name] for name in INPUT}},
            "layers": self.layers,
            "observation_mean": self.observation_mean,
            "observation_variance": self.observation_variance,
            "box": self.box,
        }

    @classmethod
    def of_arrays(cls, arrays: Mapping[str, Any]) -> "StoredPolicy":
        """Return a policy that acts as the one whose arrays these are, and does no more."""
        return cls(log_std=np.empty(0), **arrays)

    def _network(self, observation: Any, xp: ModuleType) -> Any:
        """Return the mean of the normalised action."""
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
    header = {
        "format": FORMAT,
        "jmorl": importlib.metadata.version("jmorl"),
        "environment": config.env,
        "objectives": [{"name": o.name, "label": o.label, "unit": o.unit} for o in environment.objectives],
        "id": policy.id,
        "generation": policy.generation,
        "parent": policy.parent,
        "blend": asdict(policy.blend) if policy.blend else None,
        "weights": policy.weights.tolist(),
        "values": (policy.values if policy.raw is None else policy.raw).tolist(),
        "score": policy.values.tolist(),  # other than the values only in paper units
        "std": policy.std.tolist(),
        "discounted": policy.discounted.tolist(),
        "evaluation_episodes": policy.confirmation.episodes if policy.confirmation else config.evaluation.episodes,
        "discount": config.ppo.discount,
        "run": {"id": run, "config": config.identity(), "method": config.method, "seed": config.seed},
        "network": {
            "sizes": [int(environment.observation_size), *config.ppo.hidden_sizes, int(environment.action_size)],
            "activation": "tanh",
            **INPUT,
        },
    }
    box = {f"action_{name}": array for name, array in environment.action_box._asdict().items()}
    _write(path, header, {**_network(policy), **box})


def write_stored_policy(path: Path, policy: StoredPolicy) -> None:
    """Write a policy that was read from a file, or made from such ones."""
    arrays = {"log_std": policy.log_std, **{name: getattr(policy, name) for name in _STATISTICS}}
    for index, (kernel, bias) in enumerate(policy.layers):
        arrays |= {f"layer_{index}_kernel": kernel, f"layer_{index}_bias": bias}
    box = {f"action_{name}": array for name, array in policy.box._asdict().items()}
    _write(path, policy.header, {**arrays, **box})


def _write(path: Path, header: Mapping[str, Any], arrays: Mapping[str, Any]) -> None:
    with written_whole(path) as temporary, temporary.open("wb") as file:
        np.savez(file, header=np.array(json.dumps(header)), **arrays)


def policy_name(header: Mapping[str, Any]) -> str:
    """Return what a policy with this header is called: `policy 12`, or `blend 12:0.4 15:0.6` for one of no run."""
    if header["id"] is not None:
        return f"policy {header['id']}"
    return f"blend {Blend(*map(tuple, header['blend'].values()))}"


def holds(path: Path, policy: Policy) -> bool:
    """Return whether a file can be read and is that of a policy with a snapshot, by its id and all its numbers."""
    try:
        arrays = _checked_arrays(path)
        header = json_object(str(arrays.pop("header")), str(path))
    except (PolicyFileError, KeyError, DocumentError):
        return False
    network = _network(policy)
    same = arrays.keys() >= network.keys() and all(np.array_equal(arrays[name], network[name]) for name in network)
    return same and header.get("id") == policy.id


def _network(policy: Policy) -> dict[str, Any]:
    """Return the arrays of a policy file that the policy itself determines."""
    parameters, statistics = policy.snapshot.parameters["actor"]["params"], policy.snapshot.observation_statistics
    arrays = {
        "log_std": parameters["log_std"],
        "observation_mean": statistics.mean,
        "observation_variance": statistics.variance,
    }
    for index in range(len(parameters["MLP_0"])):
        layer = parameters["MLP_0"][f"Dense_{index}"]
        arrays |= {f"layer_{index}_kernel": layer["kernel"], f"layer_{index}_bias": layer["bias"]}
    return arrays


def policy_path(place: Path, policy_id: int | None = None) -> Path:
    """Where a policy is: `place` itself if it is a file; of a run folder its choice, or the policy of an id.

    Raises PolicyFileError if there is none.
    """
    if not place.is_dir():
        if policy_id is not None:
            raise PolicyFileError(f"{place} is no run folder, so it has no policy {policy_id}")
        return place
    layout = Layout(place)
    path = layout.chosen if policy_id is None else layout.policy(policy_id)
    if not path.exists():
        what = "chosen policy; name one by its id" if policy_id is None else f"policy {policy_id}; see its policies/"
        raise PolicyFileError(f"{place} has no {what}")
    return path


def load_policy(path: Path | str) -> StoredPolicy:
    """Read a policy. Raises PolicyFileError, naming the file, if it is not one that can be read, and NewerFormat."""
    arrays = _checked_arrays(Path(path))
    try:
        header = json_object(str(arrays["header"]), "its header")
        check_format(header, FORMAT, str(path))
        header.setdefault("network", INPUT)  # files of the first versions do not say
        if "spread" in header:  # as the first versions call it
            header["std"] = header.pop("spread")
        check_fields(header, _HEADER, "its header")
        count = sum(name.endswith("_kernel") for name in arrays)
        layers = tuple((arrays[f"layer_{i}_kernel"], arrays[f"layer_{i}_bias"]) for i in range(count))
        box = _clipping_box(header, len(arrays["log_std"])) if header["format"] == 1 else _box(arrays)
        policy = StoredPolicy(
            header, layers, arrays["log_std"], arrays["observation_mean"], arrays["observation_variance"], box
        )
        _check_use(policy)
    except KeyError as error:
        raise PolicyFileError(f"{path} is not a policy file: it has no {error}") from error
    except (DocumentError, ValueError, TypeError, IndexError) as error:
        if isinstance(error, NewerFormat):
            raise
        raise PolicyFileError(f"{path} is not a policy file: {error}") from error
    return policy


def _check_use(policy: StoredPolicy) -> None:
    """Raise ValueError for a policy whose parts do not fit each other."""
    actions = policy(np.zeros_like(policy.observation_mean))
    if actions.ndim != 1 or actions.shape != policy.log_std.shape:
        raise ValueError(f"its actions have shape {actions.shape}, not {policy.log_std.shape}")
    objectives, values = len(policy.header["objectives"]), len(policy.header["values"])
    if objectives != values:
        raise ValueError(f"it has {values} values for {objectives} objectives")


def _checked_arrays(path: Path) -> dict[str, np.ndarray]:
    """Return the arrays of a NumPy archive, every byte of them compared with its checksum first.

    NumPy alone compares only what it reads to the end. Raises PolicyFileError.
    """
    try:
        content = io.BytesIO(path.read_bytes())
        with zipfile.ZipFile(content) as archive:
            damaged = archive.testzip()
        if damaged:
            raise zipfile.BadZipFile(f"the bytes of {damaged} are not those that were written")
        content.seek(0)
        with np.load(content, allow_pickle=False) as arrays:
            return dict(arrays)
    except OSError as error:
        raise PolicyFileError(f"{path} is not a policy file: {error.strerror or error}") from error
    except (ValueError, KeyError, EOFError, NotImplementedError, RuntimeError, zipfile.BadZipFile, zlib.error) as error:
        raise PolicyFileError(f"{path} is not a policy file: {error}") from error


def _box(arrays: dict[str, np.ndarray]) -> ActionBox:
    """How the network's output is mapped onto the action box."""
    return ActionBox(*(arrays[f"action_{name}"] for name in ActionBox._fields))


def _clipping_box(header: dict[str, Any], size: int) -> ActionBox:
    """Return the box of a file of format 1, whose policies are clipped and not scaled."""
    low, high = (np.full(size, limit, np.float32) for limit in header["action_limits"])
    return ActionBox(low, high, np.zeros(size, np.float32), np.ones(size, np.float32))


def policy_environment(environment_id: str) -> Environment[Any]:
    """Return the environment that a policy's header names. Raises PolicyFileError if it cannot be made here."""
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
    check_target(target, force)
    try:
        with written_whole(target) as temporary:
            shutil.copyfile(source, temporary)
    except OSError as error:
        raise PolicyFileError(f"{target} cannot be written: {error.strerror}") from error
    return policy


def check_target(target: Path, force: bool) -> None:
    """Raise PolicyFileError if a policy must not be written to a file."""
    if target.is_dir():
        raise PolicyFileError(f"{target} is a folder; name a file")
    if target.exists() and not force:
        raise PolicyFileError(f"{target} exists; choose another file, or overwrite it with --force")

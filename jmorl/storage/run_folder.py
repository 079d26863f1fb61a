"""The run folder: everything a run leaves behind, written event by event.

config.toml      every setting, as resolved; `jmorl train --config` takes it
manifest.json    versions, device, commit, command
metrics.csv      one row for each generation; 0 is the warm-up
policies.csv     one row for each evaluated policy: origin, weights, scores, what was predicted
front.csv        the rows of the current front
decisions.jsonl  every question and answer; `--user script=FILE` replays it
policies/ID.npz  each policy that entered the archive
result.json      the chosen policy and why the run ended; chosen.npz is its file
plots/           drawn at the end
"""

import csv
import importlib.metadata
import platform
import shutil
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import jax
import numpy as np

from envs.core import Environment
from jmorl.config import Config
from jmorl.decision.records import Record, decision_record, to_json
from jmorl.run import Decided, Event, GenerationFinished, RunFinished
from jmorl.search.policy import Policy
from jmorl.storage.files import write_json, write_text, written_whole
from jmorl.storage.policy_file import save_policy

PACKAGES = ("jmorl", "jax", "jaxlib", "flax", "optax", "numpy", "scipy", "moocore")


class FolderInUse(ValueError):
    """The folder holds something that must not be overwritten."""


class RunFolder:
    """Writes one run. Make it with `create`, then `record` every event."""

    def __init__(self, path: Path, config: Config, environment: Environment[Any]):
        self.path = path
        self.environment = environment
        self.config = config

    @classmethod
    def create(cls, path: Path, config: Config, environment: Environment[Any], force: bool = False) -> "RunFolder":
        """Make the folder, with config and manifest. Raises FolderInUse as `check_free` does."""
        check_free(path, force)
        if path.exists():
            shutil.rmtree(path)
        (path / "policies").mkdir(parents=True)
        write_text(path / "config.toml", config.to_toml())
        write_json(path / "manifest.json", _manifest(config))
        return cls(path, config, environment)

    def record(self, event: Event) -> None:
        """Write what an event says. Events that leave nothing behind are ignored."""
        match event:
            case Decided():
                self.log(decision_record(event.question, event.answer))
            case GenerationFinished():
                self._record_generation(event)
            case RunFinished():
                self._record_result(event)

    def log(self, record: Record) -> None:
        """Append a line to the decision log."""
        with (self.path / "decisions.jsonl").open("a", encoding="utf-8") as file:
            file.write(to_json(record) + "\n")

    def policy_path(self, policy_id: int) -> Path:
        """Where the file of an archived policy is."""
        return self.path / "policies" / f"{policy_id:05d}.npz"

    def _record_generation(self, event: GenerationFinished) -> None:
        for policy in event.offspring:
            if policy in event.state.archive.members:
                save_policy(self.policy_path(policy.id), policy, self.environment, self.config)
        _append_rows(self.path / "policies.csv", [self._policy_row(policy) for policy in event.offspring])
        _append_rows(self.path / "metrics.csv", [self._metrics_row(event)])
        _write_rows(self.path / "front.csv", [self._policy_row(policy) for policy in event.state.archive.members])

    def _record_result(self, event: RunFinished) -> None:
        shutil.copyfile(self.policy_path(event.chosen.id), self.path / "chosen.npz")
        result = {"reason": event.reason, "finished": _now(), "chosen": self._policy_row(event.chosen)}
        write_json(self.path / "result.json", result)

    def _metrics_row(self, event: GenerationFinished) -> dict[str, Any]:
        state = event.state
        return {
            "generation": state.generation,
            "steps": event.steps,
            "evaluation_steps": state.evaluation_steps,
            "steps_per_second": event.steps_per_second,
            **{f"{name}_seconds": seconds for name, seconds in asdict(event.seconds).items()},
            "questions": state.questions,
            "policies_shown": state.policies_shown,
            "candidates": event.candidates,
            **self._named("bound", state.bounds),
            **event.training,
            **asdict(event.front),
            **asdict(event.utility),
            **asdict(event.prediction),
        }

    def _policy_row(self, policy: Policy) -> dict[str, Any]:
        predicted = np.full_like(policy.values, np.nan) if policy.predicted is None else policy.predicted
        return {
            "policy": policy.id,
            "generation": policy.generation,
            "parent": policy.parent,
            **self._named("weight", policy.weights),
            **self._named("value", policy.values),
            **self._named("spread", policy.spread),
            **self._named("discounted", policy.discounted),
            **self._named("predicted", predicted),
        }

    def _named(self, prefix: str, vector: np.ndarray) -> dict[str, float | None]:
        """One column for each objective; what is not finite is left empty."""
        names = [objective.name for objective in self.environment.objectives]
        return {
            f"{prefix}_{name}": float(value) if np.isfinite(value) else None
            for name, value in zip(names, vector, strict=True)
        }


def check_free(path: Path, force: bool) -> None:
    """Raise FolderInUse if a run must not be written to `path`.

    A folder that is not empty is in use. `force` allows to overwrite a run, and nothing else.
    """
    if path.exists() and not path.is_dir():
        raise FolderInUse(f"{path} is a file; a run needs a folder of its own")
    if not path.exists() or not any(path.iterdir()):
        return
    if not (path / "manifest.json").exists():
        raise FolderInUse(f"{path} is not empty, and not a run; choose another folder")
    if not force:
        raise FolderInUse(f"{path} already holds a run; choose another folder, or overwrite it with --force")


def _manifest(config: Config) -> dict[str, Any]:
    device = jax.devices()[0]
    return {
        "format": 1,
        "started": _now(),
        "command": sys.argv,
        "config": config.digest(),
        "seed": config.seed,
        "commit": _commit(),
        "python": platform.python_version(),
        "packages": {name: importlib.metadata.version(name) for name in PACKAGES},
        "platform": platform.platform(),
        "device": {"kind": device.device_kind, "platform": device.platform, "count": jax.device_count()},
    }


def _commit() -> str | None:
    """The commit of the source tree, with a mark if it was changed since; None outside a repository."""
    command = ["git", "-C", str(Path(__file__).parent), "describe", "--always", "--dirty", "--abbrev=40"]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True, timeout=10).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return None


def _now() -> str:
    return time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())


def _append_rows(path: Path, rows: Sequence[dict[str, Any]]) -> None:
    """Append to a CSV file, with a header line if it is new."""
    new = not path.exists()
    with path.open("a", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rows[0].keys())
        if new:
            writer.writeheader()
        writer.writerows(rows)


def _write_rows(path: Path, rows: Sequence[dict[str, Any]]) -> None:
    with written_whole(path) as temporary:
        _append_rows(temporary, rows)

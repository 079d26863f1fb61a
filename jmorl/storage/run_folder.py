"""The run folder: everything a run leaves behind, written event by event.

config.toml      every setting, as resolved; `jmorl train --config` takes it
manifest.json    versions, device, commit, command; the run that it branches off; where it was resumed
metrics.csv      one row for each generation; 0 is the warm-up; `sigma` only in paper units
policies.csv     one row for each evaluated policy: origin, weights, scores, what was predicted; `raw` returns only
                 where the scores are in paper units
front.csv        the rows of the current front
decisions.jsonl  every question and answer; `--user script=FILE` replays it
policies/ID.npz  each policy that entered the archive
checkpoints/     the whole state after each of the last generations (`jmorl.storage.checkpoints`)
result.json      the chosen policy and why the run ended, the last file to be written; chosen.npz is its file
plots/           drawn at the end
run.lock         while a process writes the folder

Nothing in it names a place outside it, so it may be moved.
"""

import csv
import io
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

from envs.core import Environment
from jmorl.config import Config
from jmorl.events import Decided, Event, GenerationFinished, RunFinished
from jmorl.learning.checks import check_run
from jmorl.search.policy import Policy
from jmorl.storage.checkpoints import CheckpointWriter
from jmorl.storage.decision_log import DecisionLog
from jmorl.storage.files import append_text, write_json, write_text, written_whole
from jmorl.storage.lock import LOCK_FILE, FolderInUse, RunLock, check_unlocked
from jmorl.storage.manifest import Manifest, new_manifest, now
from jmorl.storage.policy_file import save_policy

Row = Mapping[str, Any]


class RunFolder:
    """Writes one run, and keeps others from writing it until `close`. Make it with `create`, then `record` every event.

    Leaving its `with` block closes it.
    """

    def __init__(self, path: Path, config: Config, environment: Environment[Any], lock: RunLock, manifest: Manifest):
        self.path = path
        self.config = config
        self.environment = environment
        self.lock = lock
        self.manifest = manifest
        self.metrics = CsvLog(path / "metrics.csv")
        self.policies = CsvLog(path / "policies.csv")
        self.decisions = DecisionLog(path / "decisions.jsonl")
        self.checkpoints = CheckpointWriter(path / "checkpoints", manifest["run"], config.checkpoints.keep)

    @classmethod
    def create(
        cls,
        path: Path,
        config: Config,
        environment: Environment[Any],
        force: bool = False,
        parent: Manifest | None = None,
    ) -> "RunFolder":
        """Make the folder, with config and manifest. Raises FolderInUse as `check_free` does, or if it cannot be made.

        `parent` is as in `new_manifest`. Raises NotAsDeclared, having changed nothing, for an environment that is not
        what it says, and DoesNotFit for a run that is too large for the memory there is.
        """
        check_free(path, force)
        check_run(environment, config)
        try:
            path.mkdir(parents=True, exist_ok=True)
            lock = RunLock(path)
        except OSError as error:
            raise FolderInUse(f"{path} cannot be written: {error.strerror}") from error
        try:
            _empty(path)
            manifest = new_manifest(config, parent)
            write_json(path / "manifest.json", manifest)
            write_text(path / "config.toml", config.to_toml())
            (path / "policies").mkdir()
            return cls(path, config, environment, lock, manifest)
        except BaseException:
            lock.release()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Wait until everything is on the disk, and let others have the folder. Raises CheckpointError."""
        try:
            self.checkpoints.close()
        finally:
            self.lock.release()

    def record(self, event: Event) -> None:
        """Write what an event says. Events that leave nothing behind are ignored.

        An answer is on the disk when this returns. Checkpoints are written in the background; raises CheckpointError
        if the one before could not be.
        """
        match event:
            case Decided():
                self.decisions.add(event.question, event.answer)
            case GenerationFinished():
                self._record_generation(event)
            case RunFinished():
                self._record_result(event)

    def policy_path(self, policy_id: int) -> Path:
        """Where the file of an archived policy is."""
        return self.path / "policies" / f"{policy_id:05d}.npz"

    def save_policies(self, policies: Sequence[Policy]) -> None:
        """Write a file for each."""
        for policy in policies:
            save_policy(self.policy_path(policy.id), policy, self.environment, self.config, self.manifest["run"])

    def write_front(self, front: Sequence[Policy]) -> None:
        """Write or replace front.csv."""
        write_text(self.path / "front.csv", _csv([self._policy_row(policy) for policy in front], header=True))

    def logs(self) -> dict[str, str]:
        """What a checkpoint keeps of the logs."""
        logs = {log.path.name: log.text for log in (self.metrics, self.policies)}
        return {**logs, self.decisions.path.name: self.decisions.past}

    def _record_generation(self, event: GenerationFinished) -> None:
        members = event.state.archive.members
        self.save_policies([policy for policy in event.offspring if policy in members])
        self.policies.append([self._policy_row(policy) for policy in event.offspring])
        self.metrics.append([self._metrics_row(event)])
        self.write_front(members)
        self.checkpoints.save(event.state, self.logs())

    def _record_result(self, event: RunFinished) -> None:
        self.checkpoints.wait()
        with written_whole(self.path / "chosen.npz") as temporary:
            shutil.copyfile(self.policy_path(event.chosen.id), temporary)
        result = {"reason": event.reason, "finished": now(), "chosen": self._policy_row(event.chosen)}
        write_json(self.path / "result.json", result)

    def _metrics_row(self, event: GenerationFinished) -> Row:
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
            **self._named("sigma", state.units.deviation if state.units else np.full_like(state.bounds, np.nan)),
            **event.training,
            **asdict(event.front),
            **asdict(event.utility),
            **asdict(event.prediction),
        }

    def _policy_row(self, policy: Policy) -> Row:
        nothing = np.full_like(policy.values, np.nan)
        return {
            "policy": policy.id,
            "generation": policy.generation,
            "parent": policy.parent,
            **self._named("weight", policy.weights),
            **self._named("value", policy.values),
            **self._named("std", policy.std),
            **self._named("discounted", policy.discounted),
            **self._named("predicted", nothing if policy.predicted is None else policy.predicted),
            **self._named("raw", nothing if policy.raw is None else policy.raw),
        }

    def _named(self, prefix: str, vector: np.ndarray) -> dict[str, float | None]:
        """One column for each objective; what is not finite is left empty."""
        names = [objective.name for objective in self.environment.objectives]
        return {
            f"{prefix}_{name}": float(value) if np.isfinite(value) else None
            for name, value in zip(names, vector, strict=True)
        }


class CsvLog:
    """A CSV file that only grows, and its text."""

    def __init__(self, path: Path):
        self.path = path
        self.text = ""

    def append(self, rows: Sequence[Row]) -> None:
        """Add rows, at least one, after a header line if they are the first."""
        added = _csv(rows, header=not self.text)
        append_text(self.path, added)
        self.text += added

    def restore(self, text: str) -> None:
        """Take the file back to what it was."""
        self.text = text
        if text:
            write_text(self.path, text)
        else:
            self.path.unlink(missing_ok=True)


def check_free(path: Path, force: bool) -> None:
    """Raise FolderInUse if a run must not be written to `path`.

    A folder that is not empty is in use. `force` allows to overwrite a run that no process is writing, and nothing
    else.
    """
    if path.exists() and not path.is_dir():
        raise FolderInUse(f"{path} is a file; a run needs a folder of its own")
    if not path.exists() or all(_is_leftover(each) for each in path.iterdir()):
        return
    if not (path / "manifest.json").exists():
        raise FolderInUse(f"{path} is not empty, and not a run; choose another folder")
    check_unlocked(path)
    if not force and not (path / "result.json").exists():
        raise FolderInUse(
            f"{path} holds a run that has not ended; continue it with `jmorl resume {path}`, choose another folder, or "
            "overwrite it with --force"
        )
    if not force:
        raise FolderInUse(f"{path} already holds a run; choose another folder, or overwrite it with --force")


def _empty(path: Path) -> None:
    """Delete a run but for its manifest: what an interruption leaves then still counts as a run, an unfinished one."""
    (path / "result.json").unlink(missing_ok=True)
    for each in path.iterdir():
        if each.is_dir():
            shutil.rmtree(each)
        elif each.name not in (LOCK_FILE, "manifest.json"):
            each.unlink()


def folder_bytes(path: Path) -> int:
    """What a folder has on the disk."""
    return sum(each.stat().st_size for each in path.rglob("*") if each.is_file())


def _is_leftover(path: Path) -> bool:
    """Whether a process that ended before the folder was a run has left this."""
    return path.name in (LOCK_FILE, ".manifest.json.partial")


def _csv(rows: Sequence[Row], header: bool) -> str:
    file = io.StringIO(newline="")
    writer = csv.DictWriter(file, rows[0].keys())
    if header:
        writer.writeheader()
    writer.writerows(rows)
    return file.getvalue()

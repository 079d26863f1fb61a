"""The run folder: everything a run leaves behind, written event by event.

config.toml      every setting, as resolved; `jmorl train --config` takes it
manifest.json    versions, device, commit, command; the run that it branches off; where it was resumed
metrics.csv      one row for each generation; 0 is the warm-up; `sigma` only in paper units
policies.csv     one row for each evaluated policy: origin, weights, scores, what was predicted; `low` to `high` is the
                 prediction's 80 % interval; `raw` returns only where the scores are in paper units; of a `blend` which
                 policies it is of, and how much of each
front.csv        the rows of the current front
decisions.jsonl  every question and answer; `--user script=FILE` replays it
families.json    what lies between neighbours of the front that was blended last; which of them are of one family
policies/ID.npz  each policy that entered the archive
checkpoints/     the whole state after each of the last generations (`jmorl.storage.checkpoints`)
result.json      the chosen policy and why the run ended, the last file to be written; chosen.npz is its file
plots/           drawn at the end
notes.json       what somebody has noted about the run and its policies (`jmorl.storage.notes_file`); no run needs it
run.lock         while a process writes the folder

Nothing in it names a place outside it, so it may be moved.
"""

import itertools
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

import envs
from envs.checks import check_same
from envs.core import Environment
from jmorl.config import Config
from jmorl.display.commands import command
from jmorl.events import Blended, Decided, Event, GenerationFinished, RunFinished
from jmorl.learning.check import check_run
from jmorl.loop import make_method
from jmorl.search.policy import Policy
from jmorl.storage.checkpoints import CheckpointWriter
from jmorl.storage.csv_log import CsvLog, Row, csv_text
from jmorl.storage.decision_log import DecisionLog
from jmorl.storage.families_file import families_document
from jmorl.storage.files import partial_path, remove, write_json, write_text
from jmorl.storage.layout import Layout
from jmorl.storage.lock import FolderInUse, RunLock, check_unlocked
from jmorl.storage.manifest import Manifest, new_manifest, now, read_manifest
from jmorl.storage.policy_file import save_policy

RUNS = Path("runs")  # where runs are that were not given a folder


class RunFolder:
    """Writes one run, and keeps others from writing it until `close`. Make it with `create`, then `record` every event.

    Leaving its `with` block closes it.
    """

    def __init__(self, path: Path, config: Config, environment: Environment[Any], lock: RunLock, manifest: Manifest):
        self.path = path
        self.layout = Layout(path)
        self.config = config
        self.environment = environment
        self.lock = lock
        self.manifest = manifest
        self.metrics = CsvLog(self.layout.metrics)
        self.policies = CsvLog(self.layout.policies)
        self.decisions = DecisionLog(self.layout.decisions)
        self.method = make_method(config, environment)
        self.checkpoints = CheckpointWriter(
            self.layout.checkpoints, manifest["run"], config.checkpoints.keep, self.method
        )

    @classmethod
    def create(
        cls,
        path: Path | str | None,
        config: Config,
        environment: Environment[Any],
        force: bool = False,
        parent: Manifest | None = None,
        runs: Path = RUNS,
    ) -> "RunFolder":
        """Make the folder, with config and manifest. Of several processes that do so at once, one succeeds.

        Without a path it is a new one in the folder `runs`, named after the time.
        `parent` is as in `new_manifest`. Raises FolderInUse as `check_free` does, or if the folder cannot be made, and
        NotAsDeclared for an environment that is not what it says, or not what `config` names; nothing is changed then.
        """
        path = Path(path) if path else None
        if path:
            check_free(path, force)
        check_run(environment, config.learning, envs.make_anew(config.env))
        check_same(environment, envs.make(config.env), config.env)
        try:
            path = _made(path, runs)
            layout = Layout(path)
            lock = RunLock(path)
        except OSError as error:
            raise FolderInUse(f"{path or runs} cannot be written: {error.strerror}") from error
        try:
            _check_contents(layout, force)  # another process may have had the lock since it was looked at
            _empty(layout)
            manifest = new_manifest(config, parent)
            write_json(layout.manifest, manifest)
            write_text(layout.config, config.to_toml())
            layout.policy_files.mkdir()
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

    def save_policies(self, policies: Sequence[Policy]) -> None:
        """Write a file for each."""
        for policy in policies:
            self._save_policy(self.layout.policy(policy.id), policy)

    def write_front(self, front: Sequence[Policy]) -> None:
        """Write or replace front.csv."""
        rows = [self._policy_row(policy) for policy in front]
        write_text(self.layout.front, csv_text(rows, list(rows[0])))

    def logs(self) -> dict[str, str]:
        """Return the texts of the logs, by file name, for a checkpoint."""
        logs = {log.path.name: log.text for log in (self.metrics, self.policies)}
        return {**logs, self.decisions.path.name: self.decisions.past}

    def _record_generation(self, event: GenerationFinished) -> None:
        members = event.state.archive.members
        self.save_policies([policy for policy in event.offspring if policy in members])
        self.policies.append([self._policy_row(policy) for policy in event.offspring])
        self.metrics.append([self._metrics_row(event)])
        self.write_front(members)
        if isinstance(event, Blended):
            write_json(self.layout.families, families_document(event))
        self.checkpoints.save(event.state, self.logs())

    def _record_result(self, event: RunFinished) -> None:
        self.checkpoints.wait()
        self._save_policy(self.layout.chosen, event.chosen)
        result = {"reason": event.reason, "finished": now(), "chosen": self._chosen_row(event.chosen)}
        write_json(self.layout.result, result)

    def _save_policy(self, path: Path, policy: Policy) -> None:
        save_policy(path, policy, self.environment, self.config, self.manifest["run"])

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
            **self._named("bound", event.bounds),
            **self._named("sigma", state.units.deviation if state.units else np.full_like(event.bounds, np.nan)),
            **event.training,
            **asdict(event.front),
            "utility_max": event.utility_max,
            **event.search,
        }

    def _chosen_row(self, policy: Policy) -> Row:
        """Return the row of the result; where its values are confirmed, with their errors and what was claimed."""
        found = policy.confirmation
        if found is None:
            return self._policy_row(policy)
        return {
            **self._policy_row(policy),
            "confirmation_episodes": found.episodes,
            **self._named("error", found.error),
            **self._named("claimed", found.claimed),
            **self._named("claimed_std", found.claimed_std),
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
            **self._named("low", nothing if policy.interval is None else policy.interval[0]),
            **self._named("high", nothing if policy.interval is None else policy.interval[1]),
            **self._named("raw", nothing if policy.raw is None else policy.raw),
            "blend": str(policy.blend) if policy.blend else None,
        }

    def _named(self, prefix: str, vector: np.ndarray) -> dict[str, float | None]:
        """One column for each objective; what is not finite is left empty."""
        names = [objective.name for objective in self.environment.objectives]
        return {
            f"{prefix}_{name}": float(value) if np.isfinite(value) else None
            for name, value in zip(names, vector, strict=True)
        }


def _made(path: Path | None, runs: Path) -> Path:
    """Make the folder, or without a path the next one that is free in `runs`: each run of a second gets its own."""
    if path:
        path.mkdir(parents=True, exist_ok=True)
        return path
    started = time.strftime("%Y%m%d-%H%M%S")
    for name in itertools.chain([started], (f"{started}-{number}" for number in itertools.count(2))):
        with suppress(FileExistsError):
            (runs / name).mkdir(parents=True)
            break
    return runs / name


def check_free(path: Path, force: bool) -> None:
    """Raise FolderInUse if a run must not be written to `path`.

    A folder that is not empty is in use. `force` allows to overwrite a run that no process is writing, and nothing
    else.
    """
    try:
        if path.exists() and not path.is_dir():
            raise FolderInUse(f"{path} is a file; a run needs a folder of its own")
        layout = Layout(path)
        if _has_run(layout):
            check_unlocked(path)
        _check_contents(layout, force)
    except OSError as error:
        raise FolderInUse(f"{path} cannot be used: {error.strerror}") from error


def _check_contents(layout: Layout, force: bool) -> None:
    """Raise FolderInUse if what is in the folder, or what is not, must not be overwritten."""
    path = layout.root
    if not has_begun(layout):
        return
    if not _has_run(layout):
        raise FolderInUse(f"{path} is not empty, and not a run; choose another folder")
    if force:
        return
    if not layout.config.exists():
        raise FolderInUse(
            f"{path} holds what is left of a run, without its {layout.config.name}; put that back and continue the run "
            f"with `jmorl resume {path}`, choose another folder, or overwrite it with --force"
        )
    if not layout.result.exists():
        raise FolderInUse(
            f"{path} holds a run that has not ended; continue it with `{command('resume', path)}`, choose another "
            "folder, or overwrite it with --force"
        )
    raise FolderInUse(f"{path} already holds a run; choose another folder, or overwrite it with --force")


def _has_run(layout: Layout) -> bool:
    return layout.manifest.exists()


def has_begun(layout: Layout) -> bool:
    """Return whether a folder has more in it than a process leaves that is killed before its run has begun."""
    return layout.root.exists() and not set(layout.root.iterdir()) <= _leftovers(layout)


def _empty(layout: Layout) -> None:
    """Delete a run but for its manifest: what an interruption leaves then still counts as a run, an unfinished one."""
    layout.result.unlink(missing_ok=True)
    kept = (layout.lock, layout.manifest, layout.config)
    for each in layout.root.iterdir():
        if each not in kept:
            remove(each)
    layout.config.unlink(missing_ok=True)  # the last one: without it the run has not begun


def folder_bytes(path: Path) -> int:
    """Return the size of a folder in bytes."""
    return sum(each.stat().st_size for each in path.rglob("*") if each.is_file())


def _leftovers(layout: Layout) -> set[Path]:
    """Return the files that a process leaves if it ends before the config is written, with which a run begins."""
    ours = {layout.lock, partial_path(layout.manifest), partial_path(layout.config)}
    try:
        read_manifest(layout.root)
    except (OSError, ValueError):  # somebody else's file of that name is not ours to overwrite
        return ours
    return {*ours, layout.manifest}

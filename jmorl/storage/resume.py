"""Going on with what a run folder holds: resuming a run, and branching off one."""

import re
import shutil
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import envs
from envs.core import Environment
from jmorl.config import Config, ConfigError, resolve
from jmorl.decision.protocol import DecisionMaker
from jmorl.decision.records import DecisionRecord, ScriptError, read_log
from jmorl.decision.remembered import Remembered
from jmorl.decision.users import make_user
from jmorl.events import Event
from jmorl.learning.checks import check_run
from jmorl.learning.population import Population
from jmorl.loop import run
from jmorl.search.policy import Policy
from jmorl.state import RunState
from jmorl.storage.checkpoints import (
    Checkpoint,
    DamagedCheckpoint,
    checkpoint_path,
    read_checkpoint,
    stored_generations,
)
from jmorl.storage.decision_log import DecisionLog
from jmorl.storage.files import remove_partial, write_json
from jmorl.storage.lock import FolderInUse, RunLock
from jmorl.storage.manifest import Manifest, circumstances, differences, now, read_manifest
from jmorl.storage.run_folder import RunFolder, check_free
from jmorl.storage.serialization import PackingError, unpack
from jmorl.storage.versions import NewerFormat


class CannotContinue(ValueError):
    """There is no run in the folder that could go on from there; the message says why, and what to do."""


class AlreadyFinished(CannotContinue):
    """The run has ended with a result."""


@dataclass(frozen=True)
class Continued:
    """A run that is ready to go on, in a folder that is to be closed at the end."""

    folder: RunFolder
    state: RunState | None  # None: from the beginning
    notes: tuple[str, ...] = ()  # what somebody should know about it, sentences
    user: DecisionMaker | None = None  # who decides; None: as the config says

    def events(
        self,
        user: DecisionMaker | None = None,
        asking: Callable[[], AbstractContextManager[object]] = nullcontext,
        population: Population | None = None,
    ) -> Iterator[Event]:
        """Run on, recording every event before it is passed on; answers that the log has are not asked for again.

        `user` takes the place of the run's own, and is asked within `asking()`; `population` is as in `run`.
        """
        config, environment = self.folder.config, self.folder.environment
        user = user or self.user or make_user(config.user, environment.objectives)
        remembered = Remembered(user, self.folder.decisions.ahead, asking)
        for event in run(config, remembered, environment, self.state, population):
            self.folder.record(event)
            yield event


def resume(path: Path, user: DecisionMaker | None = None) -> Continued:
    """Take up a run from its last good checkpoint, or from the beginning if it has none yet.

    Logs that are ahead of the checkpoint are cut back to it, but answers are kept, and what a killed process left
    half-written is deleted. `user` takes the place of the config's, who then need not be there any more. Raises
    CannotContinue, FolderInUse, NewerFormat and NotAsDeclared, having changed nothing.
    """
    manifest, config = _read_start(path)
    if (path / "result.json").exists():
        _tidy(path)
        raise AlreadyFinished(f"the run in {path} has ended; there is nothing to resume")
    environment = _environment(config)
    user = user or _its_user(path, config, environment)
    with _locked(path) as lock:
        found, notes = _last_good(path, manifest, config, environment)
        if found is None and manifest.get("parent"):
            raise CannotContinue(
                f"{path} has no checkpoint to go on from; branch off {manifest['parent']['name']} again"
                + "".join(f"; {note}" for note in notes)
            )
        if lock.previous:
            notes.append(f"{lock.previous}, is gone without having finished; its run goes on here")
        folder = _opened(path, config, environment, lock, manifest)
        state = _restore(folder, found, notes)
        _note_resumption(folder, state, notes)
        return Continued(folder, state, tuple(notes), user)


def branch(path: Path, generation: int, out: Path, user: str | None = None, force: bool = False) -> Continued:
    """Make a new run, in the folder `out`, that begins where a run was after a generation.

    It has the earlier run's logs up to there and decides for itself from then on, at once; `user` says who, if not as
    before. Raises CannotContinue, FolderInUse, NewerFormat, NotAsDeclared and, if the user does not fit or has a script
    that cannot be read, ConfigError; nothing is made then.
    """
    manifest, config = _read_start(path)
    config = config.replace(user=user) if user else config
    environment = _environment(config)
    decision_maker = _new_user(config, environment)
    checkpoint = _the_checkpoint(path, generation, manifest)
    state = replace(_unpacked(path, checkpoint, config, environment), silent_generations=0)
    parent = {"run": manifest["run"], "name": path.resolve().name, "generation": generation}
    check_free(out, force)
    if out.resolve() in (path.resolve(), *path.resolve().parents):
        raise FolderInUse(f"{out} holds the run that is branched off; choose another folder")
    folder = RunFolder.create(out, config, environment, force, parent)
    try:
        _restore_logs(folder, checkpoint)
        for file in (path / "policies").glob("*.npz"):
            if file.stem.isdigit() and int(file.stem) < state.policies:
                shutil.copyfile(file, folder.policy_path(int(file.stem)))
        _restore_front(folder, state)
        folder.checkpoints.save(state, folder.logs())
        folder.checkpoints.wait()
        return Continued(folder, state, user=decision_maker)
    except BaseException:
        folder.close()
        raise


def _read_start(path: Path) -> tuple[Manifest, Config]:
    """What a run was started with."""
    if not (path / "manifest.json").exists():
        raise CannotContinue(f"{path} is not a run folder: it has no manifest.json")
    if not (path / "config.toml").exists():
        raise CannotContinue(f"the run in {path} ended before it began; start it again with `jmorl train`")
    try:
        manifest = read_manifest(path)
        config = resolve(file=path / "config.toml")
        run, started, version = manifest["run"], manifest["config"], manifest["packages"]["jmorl"]
        if config.digest() != started:
            raise CannotContinue(
                f"{path / 'config.toml'} is not what run {run} was started with (by jmorl {version}: {started}, now: "
                f"{config.digest()}); restore it, or start a run of its own with `jmorl train --config`"
            )
    except (CannotContinue, NewerFormat):
        raise
    except ConfigError as error:
        raise CannotContinue(f"{path / 'config.toml'} cannot be used: {'; '.join(error.problems)}") from error
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise CannotContinue(f"{path} cannot be read as a run: {error}") from error
    return manifest, config


def _environment(config: Config) -> Environment[Any]:
    environment = envs.make(config.env)
    check_run(environment, config)
    return environment


def _its_user(path: Path, config: Config, environment: Environment[Any]) -> DecisionMaker:
    """Who decides in a run that has begun. A script that is gone is not missed where everything is answered."""
    log = path / "decisions.jsonl"
    try:
        return make_user(config.user, environment.objectives)
    except ValueError as error:
        if _is_answered(log):
            return make_user(f"script={log}", environment.objectives)
        raise CannotContinue(
            f"the run in {path} is decided by {config.user}, but {error}; put that right, or let another user decide "
            f"in a branch: jmorl branch {path} --generation K --out NEW --user USER"
        ) from error


def _is_answered(log: Path) -> bool:
    """Whether a decision log goes to the end of its run."""
    try:
        records = read_log(log)
    except ScriptError:
        return False
    last = records[-1] if records else None
    return isinstance(last, DecisionRecord) and (last.purpose == "final" or last.stop)


def _new_user(config: Config, environment: Environment[Any]) -> DecisionMaker:
    """Who decides in a run that begins. Raises ConfigError."""
    try:
        return make_user(config.user, environment.objectives)
    except ValueError as error:
        raise ConfigError([f"user: {error}"]) from error


def _tidy(path: Path) -> None:
    """Delete what a process left that was killed after the end of its run, if the folder may be written."""
    try:
        lock = RunLock(path)
    except OSError:
        return
    remove_partial(path)
    lock.release()


@contextmanager
def _locked(path: Path) -> Iterator[RunLock]:
    """The folder's lock, which stays held unless the block fails."""
    try:
        lock = RunLock(path)
    except OSError as error:
        raise CannotContinue(f"{path} cannot be written: {error.strerror}") from error
    try:
        yield lock
    except BaseException:
        lock.release()
        raise


def _opened(path: Path, config: Config, environment: Environment[Any], lock: RunLock, manifest: Manifest) -> RunFolder:
    remove_partial(path)
    (path / "policies").mkdir(exist_ok=True)
    return RunFolder(path, config, environment, lock, manifest)


Found = tuple[Checkpoint, RunState]


def _last_good(
    path: Path, manifest: Manifest, config: Config, environment: Environment[Any]
) -> tuple[Found | None, list[str]]:
    """The last checkpoint that is whole, and its state; None if there is none; and what is wrong with later ones."""
    notes: list[str] = []
    for generation in reversed(stored_generations(path / "checkpoints")):
        try:
            checkpoint = _own_checkpoint(path, generation, manifest)
            return (checkpoint, _unpacked(path, checkpoint, config, environment)), notes
        except DamagedCheckpoint as error:
            notes.append(str(error))
    return None, notes


def _own_checkpoint(path: Path, generation: int, manifest: Manifest) -> Checkpoint:
    """A checkpoint of the run in a folder. Raises DamagedCheckpoint, for one of another run, too."""
    folder = path / "checkpoints"
    checkpoint = read_checkpoint(folder, generation)
    if checkpoint.run != manifest["run"]:
        raise DamagedCheckpoint(f"{checkpoint_path(folder, generation)} belongs to another run")
    return checkpoint


def _unpacked(path: Path, checkpoint: Checkpoint, config: Config, environment: Environment[Any]) -> RunState:
    """The state in a checkpoint. Raises CannotContinue if the run has no such states now."""
    try:
        return unpack(checkpoint.state, config, environment)
    except PackingError as error:
        place = checkpoint_path(path / "checkpoints", checkpoint.generation)
        raise CannotContinue(f"{place} does not fit this jmorl: {error}") from error


def _the_checkpoint(path: Path, generation: int, manifest: Manifest) -> Checkpoint:
    """The checkpoint of a generation, for a branch."""
    stored = stored_generations(path / "checkpoints")
    if generation not in stored:
        raise CannotContinue(
            f"{path} has no checkpoint of generation {generation}, only of: {', '.join(map(str, stored)) or 'none'}"
        )
    try:
        return _own_checkpoint(path, generation, manifest)
    except DamagedCheckpoint as error:
        raise CannotContinue(f"{error}; branch off another generation") from error


def _restore(folder: RunFolder, found: Found | None, notes: list[str]) -> RunState | None:
    """Take the folder back to a checkpoint, or to the beginning."""
    checkpoint, state = found or (None, None)
    later = [each for each in stored_generations(folder.path / "checkpoints") if not state or each > state.generation]
    if later:
        notes.append(f"the run goes on from {f'generation {state.generation}' if state else 'the beginning'} instead")
    _restore_logs(folder, checkpoint)
    if folder.decisions.restored:
        notes.append(f"{folder.decisions.path} was not as the checkpoint knows it, and is restored from there")
    known = state.policies if state else 0
    for file in (folder.path / "policies").glob("*.npz"):
        if re.fullmatch(r"\d+", file.stem) and int(file.stem) >= known:
            file.unlink()
    if state:
        _restore_front(folder, state)
    else:
        (folder.path / "front.csv").unlink(missing_ok=True)
    (folder.path / "chosen.npz").unlink(missing_ok=True)
    for generation in later:
        shutil.rmtree(checkpoint_path(folder.path / "checkpoints", generation))
    return state


def _restore_logs(folder: RunFolder, checkpoint: Checkpoint | None) -> None:
    logs = checkpoint.logs if checkpoint else {}
    for log in (folder.metrics, folder.policies):
        log.restore(logs.get(log.path.name, ""))
    path = folder.decisions.path
    folder.decisions = DecisionLog(path, logs.get(path.name, ""))


def _restore_front(folder: RunFolder, state: RunState) -> None:
    """front.csv, and the files of its policies that are not there."""
    members: tuple[Policy, ...] = state.archive.members
    folder.save_policies([policy for policy in members if not folder.policy_path(policy.id).exists()])
    folder.write_front(members)


def _note_resumption(folder: RunFolder, state: RunState | None, notes: list[str]) -> None:
    """In the manifest, and what is other than it was at the start in the notes."""
    here = circumstances()
    changes = differences(folder.manifest, here)
    if changes:
        notes.append(f"since the run began, {'; '.join(changes)}: what it finds may differ in the last bits")
    resumption = {"at": now(), "after_generation": state.generation if state else None, **here}
    folder.manifest = {**folder.manifest, "resumed": [*folder.manifest["resumed"], resumption]}
    write_json(folder.path / "manifest.json", folder.manifest)

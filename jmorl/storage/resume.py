"""Going on with what a run folder holds: resuming a run, branching off one, and blending the front of one."""

import re
import shutil
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import envs
from envs.core import Environment, Objective
from jmorl.config import Config, ConfigError
from jmorl.decision.protocol import DecisionMaker
from jmorl.decision.records import DecisionRecord, ScriptError, read_log
from jmorl.decision.remembered import Remembered, by_stand_in
from jmorl.decision.users import make_user
from jmorl.display.commands import command
from jmorl.events import Blended, Event
from jmorl.learning.check import check_run
from jmorl.learning.population import Population
from jmorl.loop import blend as blend_state
from jmorl.loop import make_method, run
from jmorl.search.policy import Policy
from jmorl.state import RunState
from jmorl.storage.checkpoints import Checkpoint, stored_generations
from jmorl.storage.decision_log import DecisionLog
from jmorl.storage.documents import DocumentError
from jmorl.storage.families_file import read_families
from jmorl.storage.files import remove, remove_partial, write_json, written_whole
from jmorl.storage.layout import Layout, checkpoint_path
from jmorl.storage.lock import FolderInUse, RunLock
from jmorl.storage.manifest import Manifest, circumstances, differences, now
from jmorl.storage.notes_file import read_notes, write_notes
from jmorl.storage.policy_file import PolicyFileError, holds, load_policy
from jmorl.storage.run_folder import RunFolder, check_free
from jmorl.storage.stored_run import read_run
from jmorl.storage.stored_state import CannotContinue, Found, last_good, read_start, state_after
from jmorl.storage.versions import NewerFormat

BLENDS = 4  # for each agent, that may join a front


class AlreadyFinished(CannotContinue):
    """The run has ended with a result."""


@dataclass(frozen=True)
class Continued:
    """A run that is ready to go on, in a folder that is to be closed at the end."""

    folder: RunFolder
    state: RunState | None  # None: from the beginning
    notes: tuple[str, ...] = ()  # what somebody should know about it, sentences
    user: DecisionMaker | None = None  # who decides; None: as the config says
    ask_now: bool = False  # the next question is not for a stand-in

    def events(
        self,
        user: DecisionMaker | None = None,
        asking: Callable[[], AbstractContextManager[object]] = nullcontext,
        population: Population | None = None,
        selecting: Callable[[], AbstractContextManager[object]] = nullcontext,
        early: Callable[[tuple[Policy, ...]], None] | None = None,
    ) -> Iterator[Event]:
        """Run on, recording every event before it is passed on; answers that the log has are not asked for again.

        `user` takes the place of the run's own, and is asked within `asking()`; `population`, `selecting` and
        `early` are as in `run`.
        """
        config, environment = self.folder.config, self.folder.environment
        user = user or self.user or make_user(config.user, environment.objectives)
        decisions = self.folder.decisions
        remembered = Remembered(user, [record for record in decisions.ahead if not by_stand_in(record)], asking)
        parent = self.folder.manifest["parent"] or {}
        before = parent.get("generation", 0) if parent.get("another_user") else 0  # what somebody else has said
        answered = [record for record in decisions.answered if record.generation > before]
        made = run(config, remembered, environment, self.state, population, answered, selecting, self.ask_now, early)
        for event in made:
            self.folder.record(event)
            yield event


def resume(path: Path | str, user: DecisionMaker | None = None, ask_now: bool = False) -> Continued:
    """Take up a run from its last good checkpoint, or from the beginning if it has none yet.

    Logs that are ahead of the checkpoint are cut back to it, but answers are kept, and what a killed process left
    half-written is deleted. `user` takes the place of the config's, who then need not be there any more. With `ask_now`
    they are asked the next question, however sure a stand-in is. Raises
    CannotContinue, FolderInUse, NewerFormat and NotAsDeclared, having changed nothing.
    """
    path = Path(path)
    manifest, config = read_start(path)
    ended = AlreadyFinished(f"the run in {path} has ended; there is nothing to resume")
    if Layout(path).result.exists():
        _tidy(path)
        raise ended
    environment = _environment(config)
    _refuse_to_rescale(path, manifest, environment)
    user = user or _its_user(path, config, environment)
    with _locked(path) as lock:
        if Layout(path).result.exists():  # since it was looked for
            raise ended
        found, notes = last_good(path, manifest, config, environment)
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
        return Continued(folder, state, tuple(notes), user, ask_now)


def blend(path: Path | str, most: int | None = None, population: Population | None = None) -> Blended:
    """Make the front of a run that has ended denser by blends, and record them in its folder.

    At most so many join, by default four for each agent. The run's result stays as it is. Raises CannotContinue,
    FolderInUse, NewerFormat, NotAsDeclared, StoredRunError and ValueError, having changed nothing.
    """
    path = Path(path)
    if most is not None and most < 1:
        raise ValueError(f"at least one blend must be allowed to join, not {most}")
    manifest, config = read_start(path)
    if not Layout(path).result.exists():
        raise CannotContinue(f"the run in {path} has not ended; first go on with it: {command('resume', path)}")
    if config.evaluation.units == "paper":
        raise CannotContinue(f"the run in {path} has scores in paper units, in which none can be made for blends")
    environment = _environment(config)
    _refuse_to_rescale(path, manifest, environment)
    user = _its_user(path, config, environment)
    with _locked(path) as lock:
        found, notes = last_good(path, manifest, config, environment)
        _refuse_to_forget(path, found, notes)
        assert found is not None
        if len(found[1].archive.members) < 2:
            raise CannotContinue(f"the front in {path} has one policy, and so nothing to blend it with")
        with _opened(path, config, environment, lock, manifest) as folder:
            state = _restore(folder, found, notes)
            assert state is not None
            most = BLENDS * config.population.agents if most is None else most
            event = blend_state(config, environment, state, most, user, population)
            folder.record(event)
            return event


def branch(
    path: Path | str,
    generation: int,
    out: Path | str,
    user: str | None = None,
    force: bool = False,
    steps: int | None = None,
) -> Continued:
    """Make a new run, in the folder `out`, that begins where a run was after a generation.

    It has the earlier run's logs, and the notes about its policies, up to there, and decides for itself from then on,
    at once. `user` says who, if not as before: what somebody else has said then counts no more. `steps` says how many
    environment steps it may use, those before it included. Raises CannotContinue, FolderInUse, NewerFormat,
    NotAsDeclared and, if the user does not fit or has a script that cannot be read, ConfigError; nothing is made then.
    """
    path, out = Path(path), Path(out)
    manifest, config = read_start(path)
    user = None if user == config.user else user
    config = config.replace(**{"user": user or config.user, "steps": steps or config.steps})
    environment = _environment(config)
    _refuse_to_rescale(path, manifest, environment)
    deciding = decision_maker(config.user, environment.objectives)
    checkpoint, state = state_after(path, generation, manifest, config, environment)
    used = state.iterations * config.steps_per_iteration
    if steps is not None and config.iteration_budget <= state.iterations:
        raise CannotContinue(f"the run in {path} had used {used} steps by then; give the branch more of them than that")
    method = make_method(config, environment)
    search = method.asking_at_once(state.search)
    state = replace(state, search=method.with_another_user(search) if user else search)
    parent = {"run": manifest["run"], "name": path.resolve().name, "generation": generation}
    parent |= {"another_user": True} if user else {}
    check_free(out, force)
    if out.resolve() in (path.resolve(), *path.resolve().parents):
        raise FolderInUse(f"{out} holds the run that is branched off; choose another folder")
    folder = RunFolder.create(out, config, environment, force, parent)
    try:
        _restore_logs(folder, checkpoint)
        notes = _restore_policies(folder, Layout(path), state)
        notes += _take_over_notes(folder, path, state)
        folder.write_front(state.archive.members)
        folder.checkpoints.save(state, folder.logs())
        folder.checkpoints.wait()
        return Continued(folder, state, tuple(notes), deciding, ask_now=True)
    except BaseException:
        folder.close()
        raise


def _refuse_to_forget(path: Path, found: Found | None, notes: Sequence[str]) -> None:
    """Raise CannotContinue if the last checkpoint that is whole is not of the end of the run in a folder.

    Files may be ahead of it by one blending that was broken off.
    """
    policies = read_run(path).policies
    trained = max(policy.generation for policy in policies if policy.blend is None)
    known = found[1].generation if found else -1
    if known < max(trained, max(policy.generation for policy in policies) - 1):
        why = f"{path} has no whole checkpoint of its end, which has the networks of its front"
        raise CannotContinue("; ".join([why, *notes]))


def _environment(config: Config) -> Environment[Any]:
    environment = envs.make(config.env)
    check_run(environment, config.learning, envs.make_anew(config.env))
    return environment


def _refuse_to_rescale(path: Path, manifest: Manifest, environment: Environment[Any]) -> None:
    """Raise CannotContinue for a run whose networks put out actions in units that are scaled now.

    Versions with format 1 clipped what a network puts out to the box, and did not scale it.
    """
    box = environment.action_box
    if manifest["format"] == 1 and ((box.centre != 0).any() or (box.half_width != 1).any()):
        raise CannotContinue(
            f"the run in {path} is of a version that did not scale actions to the environment's bounds; its policies "
            "can be shown, evaluated and exported, but their training cannot go on: start a new run"
        )


def _its_user(path: Path, config: Config, environment: Environment[Any]) -> DecisionMaker:
    """Who decides in a run that has begun. A script that is gone is not missed where everything is answered."""
    log = Layout(path).decisions
    try:
        return make_user(config.user, environment.objectives)
    except ValueError as error:
        if _is_answered(log):
            return make_user(f"script={log}", environment.objectives)
        raise CannotContinue(
            f"the run in {path} is decided by {config.user}, but {error}; put that right, or let another user decide "
            f"in a branch: {command('branch', path)} --round K --out NEW --user USER"
        ) from error


def _is_answered(log: Path) -> bool:
    """Whether a decision log goes to the end of its run."""
    try:
        records = read_log(log)
    except ScriptError:
        return False
    last = records[-1] if records else None
    return isinstance(last, DecisionRecord) and (last.purpose == "final" or last.stop)


def decision_maker(spec: str, objectives: tuple[Objective, ...]) -> DecisionMaker:
    """Return the decision maker that a config's `user` names. Raises ConfigError if there is none, or no script."""
    try:
        return make_user(spec, objectives)
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
    """Hold the folder's lock, which stays held unless the block fails."""
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
    Layout(path).policy_files.mkdir(exist_ok=True)
    return RunFolder(path, config, environment, lock, manifest)


def _restore(folder: RunFolder, found: Found | None, notes: list[str]) -> RunState | None:
    """Take the folder back to a checkpoint, or to the beginning."""
    checkpoint, state = found or (None, None)
    layout = folder.layout
    later = [each for each in stored_generations(layout.checkpoints) if not state or each > state.generation]
    if later:
        notes.append(f"the run goes on from {f'round {state.generation}' if state else 'the beginning'} instead")
    _restore_logs(folder, checkpoint)
    if folder.decisions.restored:
        notes.append(f"{folder.decisions.path} was not as the checkpoint knows it, and is restored from there")
    for number, file in _policy_files(layout).items():
        if not state or number >= state.policies:
            file.unlink()
    if state:
        notes += _restore_policies(folder, layout, state)
        folder.write_front(state.archive.members)
    else:
        layout.front.unlink(missing_ok=True)
    if not layout.result.exists():
        layout.chosen.unlink(missing_ok=True)
    if not state or _is_of_later(layout.families, state.generation):
        layout.families.unlink(missing_ok=True)
    for generation in later:
        remove(checkpoint_path(layout.checkpoints, generation))
    return state


def _is_of_later(families: Path, generation: int) -> bool:
    """Return whether a file of families is of a later generation, or cannot be read."""
    try:
        return read_families(families).generation > generation
    except FileNotFoundError:
        return False
    except (OSError, DocumentError):
        return True


def _restore_logs(folder: RunFolder, checkpoint: Checkpoint | None) -> None:
    logs = checkpoint.logs if checkpoint else {}
    for log in (folder.metrics, folder.policies):
        log.restore(logs.get(log.path.name, ""))
    path = folder.decisions.path
    folder.decisions = DecisionLog(path, logs.get(path.name, ""))


def _restore_policies(folder: RunFolder, source: Layout, state: RunState) -> list[str]:
    """Give the folder the policies that a state had, from the files of `source`, which may be the folder's own.

    A file that is damaged is written again from the state, and so is one of the front that is not there. Returns what
    somebody should know of the damaged ones.
    """
    notes = []
    known = {policy.id: policy for policy in _with_snapshots(folder, state)}
    for number, file in _policy_files(source).items():
        if number >= state.policies:
            continue
        if _is_sound(file, number, known.get(number)):
            if source != folder.layout:
                with written_whole(folder.layout.policy(number)) as temporary:
                    shutil.copyfile(file, temporary)
        elif number in known:
            folder.save_policies([known[number]])
            notes.append(f"{file} was damaged, and is written again from the checkpoint")
        else:
            notes.append(f"{file} is damaged, and the checkpoint does not have this policy any more")
    members: tuple[Policy, ...] = state.archive.members
    folder.save_policies([policy for policy in members if not folder.layout.policy(policy.id).exists()])
    return notes


def _take_over_notes(folder: RunFolder, source: Path, state: RunState) -> list[str]:
    """Give a branch the notes about the policies that it shares. Returns why there are none, if they cannot be read."""
    noted = read_notes(source)
    write_notes(folder.path, noted.before(state.policies))
    return [f"{noted.problem}; the branch begins without notes"] if noted.problem else []


def _with_snapshots(folder: RunFolder, state: RunState) -> tuple[Policy, ...]:
    choice = (state.choice,) if state.choice else ()
    return (*state.archive.members, *folder.method.pack(state.search).policies, *choice)


def _policy_files(layout: Layout) -> dict[int, Path]:
    """Return the files of a run's policies, by id."""
    files = sorted(file for file in layout.policy_files.glob("*.npz") if re.fullmatch("[0-9]+", file.stem))
    return {int(file.stem): file for file in files if file == layout.policy(int(file.stem))}


def _is_sound(file: Path, number: int, policy: Policy | None) -> bool:
    """Return whether a file has all the numbers of its policy, or if they are not known, whether it can be read."""
    if policy:
        return holds(file, policy)
    try:
        return bool(load_policy(file).header["id"] == number)
    except (PolicyFileError, NewerFormat):
        return False


def _note_resumption(folder: RunFolder, state: RunState | None, notes: list[str]) -> None:
    """In the manifest, and what is other than it was at the start in the notes."""
    here = circumstances()
    changes = differences(folder.manifest, here)
    if changes:
        notes.append(
            f"since the run began, {'; '.join(changes)}: numbers are rounded in other ways, which learning enlarges; "
            "from here on the run finds other policies than it would have found"
        )
    resumption = {"at": now(), "after_generation": state.generation if state else None, **here}
    folder.manifest = {**folder.manifest, "resumed": [*folder.manifest["resumed"], resumption]}
    write_json(folder.layout.manifest, folder.manifest)

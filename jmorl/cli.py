"""The command line: arguments to config to run. No logic of its own.

Exit codes: 0 done; 1 the run failed, what it had is kept; 2 bad input, nothing was made; 130 and 143 ended by SIGINT
(Ctrl-C) and SIGTERM, what it had is kept.
"""

import argparse
import json
import os
import secrets
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jmorl.arguments import SETTING, parse
from jmorl.config import Config, ConfigError, resolve
from jmorl.display.characters import substitute_in
from jmorl.display.commands import command
from jmorl.module_path import working_directory_last
from jmorl.signals import Interrupted, StopSignals
from jmorl.storage.layout import Layout

if TYPE_CHECKING:
    from jmorl.display.console import PlainConsole
    from jmorl.storage.resume import Continued
    from jmorl.storage.stored_run import StoredRun
    from jmorl.studio.session import Session

EXIT_FAILED, EXIT_BAD_INPUT, EXIT_INTERRUPTED = 1, 2, 130
AT_ONCE = 96  # environments, where their speed is measured: those of six agents on HalfCheetah


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command. Returns the exit code; argparse itself exits with 2 for unknown flags."""
    substitute_in(sys.stdout, sys.stderr)
    options = parse(sys.argv[1:] if arguments is None else arguments)
    working_directory_last()  # for an environment of one's own, as `--env my_module:my-env-v0`
    os.environ["MPLBACKEND"] = "agg"  # matplotlib is to draw files; it fails at a notebook's backend that is not here
    from envs.checks import NotAsDeclared
    from envs.drawing import NoDrawing
    from jmorl.decision.records import ScriptError
    from jmorl.evaluation import NotInGymnasium
    from jmorl.experiments.record import RecordError
    from jmorl.learning.devices import NoDevices, check_devices, use_all_cpu_cores
    from jmorl.learning.execution import ComputationFailed, own_settings
    from jmorl.learning.memory import DoesNotFit
    from jmorl.learning.population import TrainingFault
    from jmorl.methods.base import MethodError
    from jmorl.playback import PlaybackError
    from jmorl.storage.checkpoints import CheckpointError
    from jmorl.storage.lock import FolderInUse
    from jmorl.storage.policy_file import PolicyFileError
    from jmorl.storage.resume import CannotContinue
    from jmorl.storage.stored_run import StoredRunError
    from jmorl.storage.versions import NewerFormat

    wrong_place = (CannotContinue, FolderInUse, NewerFormat, PolicyFileError, RecordError, StoredRunError)
    use_all_cpu_cores()
    try:
        if options.command in COMPUTING:
            check_devices()
        with own_settings() if options.command in COMPUTING else nullcontext():
            COMMANDS[options.command](options)
    except ConfigError as error:
        return _failed(error.problems, EXIT_BAD_INPUT)
    except (*wrong_place, DoesNotFit, NoDevices, NoDrawing, NotAsDeclared, NotInGymnasium, PlaybackError) as error:
        return _failed([str(error)], EXIT_BAD_INPUT)
    except (TrainingFault, ComputationFailed, MethodError, ScriptError, EOFError, OSError, CheckpointError) as error:
        return _failed([f"stopped: {error}", *_notes(error)], EXIT_FAILED)
    except MemoryError as error:
        return _failed([f"stopped: there is no memory left: {error}", *_notes(error)], EXIT_FAILED)
    except Interrupted as error:
        return _failed([str(error), *_notes(error)], error.exit_code)
    except KeyboardInterrupt:
        return _failed(["interrupted"], EXIT_INTERRUPTED)
    return 0


def _failed(problems: Sequence[str], code: int) -> int:
    for problem in problems:
        print(f"jmorl: {problem}", file=sys.stderr)
    return code


def _notes(error: BaseException) -> list[str]:
    return getattr(error, "__notes__", [])


def _train(options: argparse.Namespace) -> None:
    _follow(_begun(options), options)


def _resume(options: argparse.Namespace) -> None:
    from jmorl.storage.resume import AlreadyFinished, resume
    from jmorl.storage.stored_run import read_run

    if not Layout(options.run).result.exists():
        _check_json(options, _stored_user(options.run))
    try:
        continued = resume(options.run, ask_now=options.ask_now)
    except AlreadyFinished as finished:
        if not options.quiet:
            print(f"jmorl: {finished}", file=sys.stderr)
        _draw(read_run(options.run))  # it may have been killed in doing so
        return
    _follow(continued, options)


def _branch(options: argparse.Namespace) -> None:
    from jmorl.storage.resume import branch

    _check_json(options, options.user or _stored_user(options.run))
    continued = branch(options.run, options.generation, options.out, options.user, options.force, options.steps)
    _follow(continued, options)


def _begun(options: argparse.Namespace, defaults: Mapping[str, Any] | None = None) -> "Continued":
    """Begin a new run, over defaults of a command's own. Bad input makes nothing."""
    from jmorl.storage.begin import begin

    def problems(config: Config | None) -> list[str]:
        return _problems_of_json(options, config.user) if config else []

    overrides = {**(defaults or {}), **_overrides(options)}
    return begin(options.preset, options.config, overrides, options.out, options.force, problems_of=problems)


def _follow(continued: "Continued", options: argparse.Namespace) -> None:
    """Run to the end, or until a signal; show it, and draw it.

    What breaks the run off, but not for good, says how to go on.
    """
    from jmorl.display.console import PlainConsole
    from jmorl.events import RunFinished
    from jmorl.learning.execution import ComputationFailed
    from jmorl.report.progress import kind_of_progress, watcher
    from jmorl.storage.checkpoints import CheckpointError
    from jmorl.storage.run_folder import folder_bytes
    from jmorl.storage.stored_run import read_run
    from jmorl.units import measured_in

    console = PlainConsole()
    kind = kind_of_progress(options.json, options.quiet, console)
    for note in continued.notes:
        print(f"jmorl: {note}", file=sys.stderr)
    path, config = continued.folder.path, continued.folder.config
    objectives = measured_in(config.evaluation.units, continued.folder.environment.objectives)
    try:
        with (
            continued.folder,
            watcher(kind, config, objectives, console) as watching,
            StopSignals() as stop,
        ):

            @contextmanager
            def asking() -> Iterator[None]:
                with watching.asking(), stop.interruptible():
                    yield

            for event in continued.events(asking=asking, selecting=stop.interruptible):
                watching.show(event)
                if not isinstance(event, RunFinished):
                    stop.check()
    except (CheckpointError, ComputationFailed, EOFError, Interrupted, MemoryError, OSError) as error:
        error.add_note(f"what the run had is kept; go on with: {command('resume', path)}")
        raise
    stored = read_run(path)
    _draw(stored)
    if kind in ("live", "lines"):
        megabytes, generations = folder_bytes(path) / 1e6, len(stored.metrics["generation"])
        size = f"{megabytes:.1f} MB, {megabytes / generations:.1f} for each round"
        _tell_of_reference(stored)
        where = f"Everything is in {path} ({size}), the chosen policy in {Layout(path).chosen}."
        console.print(where, soft_wrap=True)


def _tell_of_reference(run: "StoredRun") -> None:
    """Say which part of the front the hypervolume does not see, if there is one."""
    if run.below_reference:
        print(
            f"Policies of the front below the reference point: {run.below_reference} of {len(run.front)}. The "
            f"hypervolume does not count them. The reference point is "
            f"{tuple(run.config.reference_point) or 'what the warm-up set'}; set a lower one with --reference-point."
        )


def _draw(run: "StoredRun") -> None:
    """Draw a run that is over. It is complete without its plots: what goes wrong with them is only said."""
    from jmorl.report.plots import PlotError, draw_run

    try:
        draw_run(run, Layout(run.path).plots)
    except PlotError as error:
        again = f"the run is complete, and {command('show', run.path)} draws it again"
        print(f"jmorl: {error}; {again}", file=sys.stderr)


def _studio(options: argparse.Namespace) -> None:
    try:
        from jmorl.studio import server
    except ModuleNotFoundError as error:
        raise ConfigError([f"the studio needs {error.name}: pip install 'jmorl[studio]'"]) from error
    from jmorl.studio.guard import is_loopback
    from jmorl.studio.session import Session

    server.check_address(options.host, options.port)
    token = options.token or (None if is_loopback(options.host) else secrets.token_urlsafe())
    watch_token = options.watch_token or secrets.token_urlsafe()
    if watch_token == token:
        raise ConfigError(["--watch-token must not be --token: who may watch could steer, too"])
    address = server.address(options.host, options.port, token)
    session = Session(runs=_home_folder(options))
    with StopSignals() as stop:
        try:
            _open(session, options)
            print(f"The studio is at {address} (Ctrl-C ends it)", flush=True)
            print(f"Others can watch, and nothing else, at {server.watch_address(address, watch_token)}", flush=True)
            with stop.interruptible():
                server.serve(session, options.host, options.port, token, watch_token)
        except Interrupted as error:
            if session.is_open:
                error.add_note(f"what the run has is kept; open it again with: {command('studio', session.view.path)}")
            raise
        finally:
            session.close()


def _open(session: "Session", options: argparse.Namespace) -> None:
    """Go on with the run that is named, or begin a new one; of a folder of runs none is open until one is picked."""
    from jmorl.studio.view import PERSON

    if options.run is None:
        session.drive(_begun(options, {"user": PERSON}))
    elif options.run != session.runs:
        session.open(options.run)


def _home_folder(options: argparse.Namespace) -> Path:
    """Return the folder of runs: the one that is named, or that in which the run is."""
    from jmorl.storage.run_folder import RUNS
    from jmorl.studio.home import is_run

    folder: Path | None = options.run
    if folder is None:
        return options.out.resolve().parent if options.out else RUNS
    if not folder.exists():
        raise ConfigError([f"{folder} does not exist; name a run or a folder of runs, or leave it out for a new run"])
    return folder if folder.is_dir() and not is_run(folder) else folder.resolve().parent


def _check_json(options: argparse.Namespace, user: str) -> None:
    """Raise ConfigError if a person at this terminal would be asked among lines of JSON."""
    problems = _problems_of_json(options, user)
    if problems:
        raise ConfigError(problems)


def _problems_of_json(options: argparse.Namespace, user: str) -> list[str]:
    if getattr(options, "json", False) and user.strip() == "terminal":
        return ["json: questions at this terminal would stand between its lines; take another --user"]
    return []


def _stored_user(run: Path) -> str:
    """Whom the run in a folder asks. What is wrong with the folder is said by those who read it."""
    try:
        return resolve(file=Layout(run).config).user
    except ConfigError:
        return ""


def _overrides(options: argparse.Namespace) -> dict[str, Any]:
    """Return the settings given as flags, as nested as the config; values are still strings."""
    overrides: dict[str, Any] = {}
    for name, value in vars(options).items():
        if name.startswith(SETTING) and value is not None:
            *sections, field = name.removeprefix(SETTING).split(".")
            inner = overrides
            for section in sections:
                inner = inner.setdefault(section, {})
            inner[field] = value
    return overrides


def _evaluate(options: argparse.Namespace) -> None:
    import jax
    import numpy as np

    from jmorl.display.console import PlainConsole
    from jmorl.evaluation import difference_in_errors, evaluate_in_gymnasium, evaluate_stored
    from jmorl.report.tables import comparison_table, evaluation_table
    from jmorl.storage.policy_file import load_policy, policy_path

    path = policy_path(options.policy, options.id)
    policy = load_policy(path)
    theirs = evaluate_in_gymnasium(policy, options.episodes, options.seed) if options.where else None
    returns = evaluate_stored(policy, jax.random.split(jax.random.key(options.seed), options.episodes))
    ours = np.asarray(returns.undiscounted, np.float64)
    printed = {"policy": str(path), "seed": options.seed, "returns": ours.tolist()}
    table = evaluation_table(policy.header, returns)
    if theirs is not None:
        z = difference_in_errors(ours, theirs)
        differences = [None if np.isnan(value) else float(value) for value in z]
        printed[options.where] = {"returns": theirs.tolist(), "difference_in_standard_errors": differences}
        table = comparison_table(policy.header, ours, theirs, z)
    if options.json:
        print(json.dumps(printed))
    else:
        PlainConsole().print(table)


def _play(options: argparse.Namespace) -> None:
    import jax

    from jmorl.playback import record
    from jmorl.report.playback import check_playback, write_playback
    from jmorl.storage.policy_file import load_policy, policy_name, policy_path

    check_playback(options.out, options.force)
    policy = load_policy(policy_path(options.policy, options.id))
    recording = record(policy, jax.random.split(jax.random.key(options.seed), 1)[0], options.steps)
    write_playback(recording, options.out, options.size)
    print(f"{options.out}: {recording.steps} steps of {policy_name(policy.header)}")


def _export(options: argparse.Namespace) -> None:
    from jmorl.report.tables import scores_in_words
    from jmorl.storage.policy_file import export_policy, policy_name

    if options.blend:
        from jmorl.evaluation import export_blend

        policy = export_blend(options.run, options.blend, options.to, options.force)
    else:
        policy = export_policy(options.run, options.policy, options.to, options.force)
    print(f"{options.to}: {policy_name(policy.header)}, {scores_in_words(policy.header)}")


def _blend(options: argparse.Namespace) -> None:
    from jmorl.display.console import PlainConsole
    from jmorl.report.blending_tables import blending_tables
    from jmorl.report.watchers import blending_fields
    from jmorl.storage.resume import blend
    from jmorl.storage.stored_run import read_run

    event = blend(options.run, options.blends)
    stored = read_run(options.run)
    _draw(stored)
    if options.json:
        print(json.dumps(blending_fields(event.blending)))
        return
    console = PlainConsole()
    for table in blending_tables(event, stored.objectives):
        console.print(table)


def _enautilus(options: argparse.Namespace) -> None:
    from jmorl.display.console import PlainConsole
    from jmorl.display.fronts import front_table
    from jmorl.storage.afterwards import choose_afterwards
    from jmorl.storage.resume import decision_maker
    from jmorl.storage.stored_run import read_run

    stored = read_run(options.run)
    _check_json(options, options.user or stored.config.user)
    user = decision_maker(options.user or stored.config.user, stored.objectives)
    chosen = choose_afterwards(stored, user, options.iterations, options.points)
    if options.json:
        print(Layout(options.run).enautilus.read_text(encoding="utf-8"), end="")
    else:
        PlainConsole().print(front_table(stored.front, stored.objectives, chosen_id=chosen.id))


def _show(options: argparse.Namespace) -> None:
    from jmorl.display.console import PlainConsole
    from jmorl.report.journey import write_journey
    from jmorl.report.plots import draw_run
    from jmorl.report.tables import run_tables
    from jmorl.storage.stored_run import read_run

    stored = read_run(options.run)
    console = PlainConsole()
    for table in run_tables(stored):
        console.print(table)
    _tell_of_reference(stored)
    plots = draw_run(stored, Layout(options.run).plots)
    for plot in plots:
        console.print(f"plot: {plot}", soft_wrap=True)
    if options.html:
        write_journey(stored, plots, options.html)
        console.print(f"page: {options.html}", soft_wrap=True)


def _paper(options: argparse.Namespace) -> None:
    from jmorl.paper.command import make_paper

    units = ("raw", "paper") if options.units == "both" else (options.units,)
    run, out, work = not options.report, options.out, options.work
    make_paper(options.only, units, options.seeds, options.quick, run, out, work, options.together)


def _study(options: argparse.Namespace) -> None:
    from jmorl.experiments.study.command import make_study

    make_study(options.plan, not options.report, options.out, options.work)


def _envs(options: argparse.Namespace) -> None:
    import envs
    from jmorl.display.console import PlainConsole
    from jmorl.report.tables import environment_tables

    ids = options.env or envs.ids()
    problems = []
    for name in ids:
        try:
            envs.make(name)
        except ValueError as error:
            problems.append(str(error))
    if problems:
        raise ConfigError(problems)
    console = PlainConsole()
    speeds = dict(_speeds(ids, console)) if options.speed else {}
    for table in environment_tables(ids, speeds):
        console.print(table)
    if not options.env:
        console.print("By their names: brax:NAME, such as brax:ant; playground:NAME, such as playground:CheetahRun.")


def _speeds(ids: Sequence[str], console: "PlainConsole") -> Iterator[tuple[str, str]]:
    """Measure environments, and say at once how long each took to compile."""
    import envs
    from envs.speed import measure_speed
    from jmorl.display.text import short_count

    for name in ids:
        speed = measure_speed(envs.make(name), AT_ONCE)
        console.print(f"{name}: {AT_ONCE} at once on one core, {speed.compile_seconds:.0f} s to compile")
        yield name, short_count(speed.steps_per_second)


COMMANDS: dict[str, Callable[[argparse.Namespace], None]] = {
    "train": _train,
    "resume": _resume,
    "branch": _branch,
    "studio": _studio,
    "show": _show,
    "evaluate": _evaluate,
    "play": _play,
    "export": _export,
    "blend": _blend,
    "enautilus": _enautilus,
    "paper": _paper,
    "study": _study,
    "envs": _envs,
}

# These need JAX's devices.
COMPUTING = ("train", "resume", "branch", "studio", "evaluate", "play", "blend", "export", "paper", "study")


if __name__ == "__main__":
    sys.exit(main())

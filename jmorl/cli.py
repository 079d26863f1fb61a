"""The command line: arguments to config to run. No logic of its own.

Exit codes: 0 done; 1 the run failed, what it had is kept; 2 bad input, nothing was made; 130 interrupted.
"""

import argparse
import json
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from envs.core import Objective
from jmorl.config import PRESETS, Config, ConfigError, Section, resolve
from jmorl.decision.protocol import DecisionMaker

SETTING = "setting."  # marks the parsed options that are fields of the config
EXIT_FAILED, EXIT_BAD_INPUT, EXIT_INTERRUPTED = 1, 2, 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command. Returns the exit code; argparse itself exits with 2 for unknown flags."""
    options = _parser().parse_args(arguments)
    sys.path.insert(0, os.getcwd())  # for an environment of one's own, as `--env my_module:my-env-v0`
    from envs.drawing import NoDrawing
    from jmorl.decision.records import ScriptError
    from jmorl.learning.devices import use_all_cpu_cores
    from jmorl.learning.population import TrainingFault
    from jmorl.playback import PlaybackError
    from jmorl.scoring import NotInGymnasium
    from jmorl.storage.policy_file import PolicyFileError
    from jmorl.storage.run_folder import FolderInUse
    from jmorl.storage.stored_run import StoredRunError

    use_all_cpu_cores()
    try:
        options.command(options)
    except ConfigError as error:
        return _failed(error.problems, EXIT_BAD_INPUT)
    except (FolderInUse, NoDrawing, NotInGymnasium, PlaybackError, PolicyFileError, StoredRunError) as error:
        return _failed([str(error)], EXIT_BAD_INPUT)
    except (TrainingFault, ScriptError, EOFError, OSError) as error:
        return _failed([f"the run stopped: {error}"], EXIT_FAILED)
    except KeyboardInterrupt:
        return _failed(["interrupted"], EXIT_INTERRUPTED)
    return 0


def _failed(problems: Sequence[str], code: int) -> int:
    for problem in problems:
        print(f"jmorl: {problem}", file=sys.stderr)
    return code


def _train(options: argparse.Namespace) -> None:
    from rich.console import Console

    import envs
    from jmorl.report.plots import draw_run
    from jmorl.report.progress import watcher
    from jmorl.run import run
    from jmorl.storage.run_folder import RunFolder
    from jmorl.storage.stored_run import read_run

    config = _checked_config(options)
    environment = envs.make(config.env)
    decision_maker = _decision_maker(config.user, environment.objectives)
    folder = RunFolder.create(options.out, config, environment, options.force)
    console = Console()
    kind = "json" if options.json else "quiet" if options.quiet else "live" if console.is_terminal else "lines"
    with watcher(kind, config, environment.objectives, console) as watching:
        for event in run(config, decision_maker, environment):
            folder.record(event)
            watching.show(event)
    draw_run(read_run(folder.path), folder.path / "plots")
    if kind in ("live", "lines"):
        where = f"Everything is in {folder.path}, the chosen policy in {folder.path / 'chosen.npz'}."
        console.print(where, soft_wrap=True, highlight=False)


def _checked_config(options: argparse.Namespace) -> Config:
    """The config of the options; every problem, that of the output folder included, in one ConfigError."""
    from jmorl.storage.run_folder import FolderInUse, check_free

    problems = []
    if options.out is None:
        options.out = Path("runs") / time.strftime("%Y%m%d-%H%M%S")
    try:
        check_free(options.out, options.force)
    except FolderInUse as error:
        problems.append(f"out: {error}")
    try:
        config = resolve(options.preset, options.config, _overrides(options))
    except ConfigError as error:
        raise ConfigError(error.problems + problems) from None
    if problems:
        raise ConfigError(problems)
    return config


def _decision_maker(spec: str, objectives: tuple[Objective, ...]) -> DecisionMaker:
    from jmorl.decision.users import make_user

    try:
        return make_user(spec, objectives)
    except ValueError as error:
        raise ConfigError([f"user: {error}"]) from error


def _overrides(options: argparse.Namespace) -> dict[str, Any]:
    """The settings given as flags, as nested as the config; values are still strings."""
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
    from rich.console import Console

    from jmorl.report.tables import comparison_table, evaluation_table
    from jmorl.scoring import difference_in_errors, evaluate_in_gymnasium, evaluate_stored
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
        Console().print(table)


def _play(options: argparse.Namespace) -> None:
    import jax

    from jmorl.playback import record
    from jmorl.report.playback import check_playback, write_playback
    from jmorl.storage.policy_file import load_policy, policy_path

    check_playback(options.out, options.force)
    policy = load_policy(policy_path(options.policy, options.id))
    recording = record(policy, jax.random.split(jax.random.key(options.seed), 1)[0], options.steps)
    write_playback(recording, options.out, options.size)
    print(f"{options.out}: {recording.steps} steps of policy {policy.header['id']}")


def _enautilus(options: argparse.Namespace) -> None:
    from rich.console import Console

    from jmorl.display.fronts import front_table
    from jmorl.storage.afterwards import choose_afterwards
    from jmorl.storage.stored_run import read_run

    stored = read_run(options.run)
    user = _decision_maker(options.user or stored.config.user, stored.objectives)
    chosen = choose_afterwards(stored, user, options.iterations, options.points)
    if options.json:
        print((options.run / "enautilus.json").read_text(), end="")
    else:
        Console().print(front_table(stored.front, stored.objectives, chosen_id=chosen.id))


def _show(options: argparse.Namespace) -> None:
    from rich.console import Console

    from jmorl.report.plots import draw_run
    from jmorl.report.tables import run_tables
    from jmorl.storage.stored_run import read_run

    stored = read_run(options.run)
    console = Console()
    for table in run_tables(stored):
        console.print(table)
    for plot in draw_run(stored, options.run / "plots"):
        console.print(f"plot: {plot}", soft_wrap=True, highlight=False)


def _envs(options: argparse.Namespace) -> None:
    from rich.console import Console

    from jmorl.report.tables import environments_table

    Console().print(environments_table())


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="jmorl",
        description="Interactive multi-objective reinforcement learning: train a population, choose, converge.",
        epilog="Exit codes: 0 done, 1 the run failed (what it had is kept), 2 bad input (nothing was made), "
        "130 interrupted.",
    )
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    _add_train(commands)

    enautilus = commands.add_parser(
        "enautilus", help="choose a policy from the front of a finished run, step by step (E-NAUTILUS)"
    )
    enautilus.add_argument("run", type=Path, metavar="RUN", help="run folder")
    enautilus.add_argument("--user", help="who decides, as in train (default: the run's own user)")
    enautilus.add_argument("--iterations", type=_count, default=3, help="choices until the front (default: 3)")
    enautilus.add_argument("--points", type=_count, default=3, help="points shown each time (default: 3)")
    enautilus.add_argument("--json", action="store_true", help="print the chosen policy as JSON")
    enautilus.set_defaults(command=_enautilus)

    evaluate = commands.add_parser("evaluate", help="score a saved policy on fresh episodes")
    _add_policy(evaluate)
    evaluate.add_argument("--in", dest="where", choices=["gymnasium"], help="also in MO-Gymnasium, side by side")
    evaluate.add_argument("--episodes", type=_count, default=100, help="default: 100")
    evaluate.add_argument("--seed", type=int, default=0, help="of the start states (default: 0)")
    evaluate.add_argument("--json", action="store_true", help="print every episode's returns as JSON")
    evaluate.set_defaults(command=_evaluate)

    play = commands.add_parser("play", help="draw an episode of a saved policy: animation, film, or strip of poses")
    _add_policy(play)
    play.add_argument("--out", type=Path, required=True, metavar="FILE", help="ends in .gif, .mp4 or .png (a strip)")
    play.add_argument("--seed", type=int, default=0, help="of the start state, as in evaluate (default: 0)")
    play.add_argument("--steps", type=_count, help="at most so many (default: the whole episode)")
    play.add_argument("--size", type=_size, metavar="PIXELS", help="width (default: 640, for a strip 1280)")
    play.add_argument("--force", action="store_true", help="overwrite the file")
    play.set_defaults(command=_play)

    show = commands.add_parser("show", help="print a run's tables and draw its plots")
    show.add_argument("run", type=Path, metavar="RUN", help="run folder")
    show.set_defaults(command=_show)

    listing = commands.add_parser("envs", help="list the environments")
    listing.set_defaults(command=_envs)
    return parser


def _add_train(commands: Any) -> None:
    train = commands.add_parser(
        "train",
        help="train a population, with a decision maker in the loop",
        description="Preset, then config file, then flags: each overrides the one before.",
        formatter_class=argparse.RawTextHelpFormatter,
    )
    train.set_defaults(command=_train)
    train.add_argument("--preset", default="default", help=f"{', '.join(PRESETS)} (default: default)")
    train.add_argument("--config", type=Path, metavar="FILE", help="settings as TOML, for instance a run's config.toml")
    train.add_argument("--out", type=Path, metavar="FOLDER", help="run folder (default: runs/DATE-TIME)")
    train.add_argument("--force", action="store_true", help="overwrite the run that is in the folder")
    train.add_argument("--quiet", action="store_true", help="print nothing but errors")
    train.add_argument("--json", action="store_true", help="print one JSON object for each event")
    _add_settings(train, train.add_argument_group("settings"), Config, "")


def _add_policy(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("policy", type=Path, metavar="RUN_OR_POLICY", help="run folder, or policy file")
    parser.add_argument("--policy", dest="id", type=int, metavar="ID", help="of a run folder (default: its choice)")


def _add_settings(parser: argparse.ArgumentParser, group: Any, section: type[Section], prefix: str) -> None:
    """One flag for every field. Values stay strings here, so that the config can name all problems at once."""
    for name, field in section.model_fields.items():
        kind = field.annotation
        if isinstance(kind, type) and issubclass(kind, Section):
            title = f"{name}: {(kind.__doc__ or '').splitlines()[0]}"
            _add_settings(parser, parser.add_argument_group(title), kind, f"{prefix}{name}.")
        else:
            default = field.default if not isinstance(field.default, tuple) else ",".join(map(str, field.default))
            shown = "" if default is None else f" ({default})"
            group.add_argument(
                f"--{prefix}{name}".replace("_", "-"),
                dest=f"{SETTING}{prefix}{name}",
                metavar=name.rpartition("_")[2].upper(),
                help=f"{field.description}{shown}".replace("%", "%%"),
            )


def _count(text: str) -> int:
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f"must be at least 1, not {number}")
    return number


def _size(text: str) -> int:
    number = int(text)
    if not 160 <= number <= 4096:
        raise argparse.ArgumentTypeError(f"must be from 160 to 4096, not {number}")
    return number


if __name__ == "__main__":
    sys.exit(main())

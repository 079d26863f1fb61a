"""What the command line takes: commands, their arguments, and a flag for every setting."""

import argparse
import math
import re
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NoReturn

from envs.names import did_you_mean, nearest
from jmorl.config import Config
from jmorl.display.characters import to_path, unicode_argument
from jmorl.presets import PRESETS
from jmorl.search.policy import Blend
from jmorl.settings import Section

SETTING = "setting."  # marks the parsed options that are fields of the config
FLAG, NEGATIVE_VALUE = re.compile(r"--[^=]+"), re.compile(r"-\.?\d.*")
OF_SETTINGS = """\
In parentheses is a setting's value; below it are values for environments in which the default preset, or another one
that is named, has something else."""
STUDIO_RUN = "run folder, to go on with or to look at; or a folder of runs, to pick one or to begin one there"
PAPER_ITEMS = ("table1", "fig5", "fig6", "fig9", "fig10", "table2", "fig7", "fig8", "fig11", "targets")


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Return the options that are given.

    A flag may be followed by `-999,-999`, which argparse alone takes for a flag.
    """
    joined: list[str] = []
    for argument in map(unicode_argument, arguments):
        if joined and FLAG.fullmatch(joined[-1]) and NEGATIVE_VALUE.fullmatch(argument):
            argument = f"{joined.pop()}={argument}"
        joined.append(argument)
    return parser().parse_args(joined)


class _Parser(argparse.ArgumentParser):
    """One whose errors are a line each, and which names the flag that was meant."""

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        options, unknown = super().parse_known_args(args, namespace)
        if unknown:
            flags = [argument.partition("=")[0] for argument in unknown if argument.startswith("-")]
            many = f"too many arguments: {' '.join(unknown)}"
            self.error("; ".join(map(self._unknown, flags)) if flags else many)
        return options, unknown

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"jmorl: {message} ({self.prog} --help says what there is)\n")

    def _unknown(self, flag: str) -> str:
        meant = nearest(flag.strip("-"), (each.strip("-") for each in self._option_string_actions))
        return f"there is no flag {flag}{did_you_mean(meant and f'--{meant}')}"


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line. `command` of the parsed options names the command."""
    whole = _Parser(
        prog="jmorl",
        description="Interactive multi-objective reinforcement learning: train a population, choose, converge.",
        epilog="Exit codes: 0 done, 1 the run failed (what it had is kept), 2 bad input (nothing was made), "
        "130 and 143 ended by SIGINT (Ctrl-C) and SIGTERM (what it had is kept).",
    )
    commands = whole.add_subparsers(dest="command", metavar="COMMAND", required=True)
    _add_train(commands)
    _add_continuing(commands)
    _add_studio(commands)

    enautilus = commands.add_parser(
        "enautilus", help="choose a policy from the front of a finished run, step by step (E-NAUTILUS)"
    )
    enautilus.add_argument("run", type=to_path, metavar="RUN", help="run folder")
    enautilus.add_argument("--user", help="who decides, as in train (default: the run's own user)")
    enautilus.add_argument("--iterations", type=_count, default=3, help="choices until the front (default: 3)")
    enautilus.add_argument("--points", type=_count, default=3, help="points shown each time (default: 3)")
    enautilus.add_argument("--json", action="store_true", help="print the chosen policy as JSON")

    evaluate = commands.add_parser("evaluate", help="score a saved policy on fresh episodes")
    _add_policy(evaluate)
    evaluate.add_argument("--in", dest="where", choices=["gymnasium"], help="also in MO-Gymnasium, side by side")
    evaluate.add_argument("--episodes", type=_count, default=100, help="default: 100")
    evaluate.add_argument("--seed", type=_seed, default=0, help="of the start states (default: 0)")
    evaluate.add_argument("--json", action="store_true", help="print every episode's returns as JSON")

    play = commands.add_parser("play", help="draw an episode of a saved policy: animation, film, or strip of poses")
    _add_policy(play)
    play.add_argument("--out", type=to_path, required=True, metavar="FILE", help="ends in .gif, .mp4 or .png (a strip)")
    play.add_argument("--seed", type=_seed, default=0, help="of the start state, as in evaluate (default: 0)")
    play.add_argument("--steps", type=_count, help="at most so many (default: the whole episode)")
    play.add_argument("--size", type=_size, metavar="PIXELS", help="width (default: 640, for a strip 1280)")
    play.add_argument("--force", action="store_true", help="overwrite the file")

    blend = commands.add_parser(
        "blend", help="make the front of a run that has ended denser, by blends of its policies, without training"
    )
    blend.add_argument("run", type=to_path, metavar="RUN", help="run folder")
    blend.add_argument("--blends", type=_count, metavar="N", help="that may join the front (default: 4 for each agent)")
    blend.add_argument("--json", action="store_true", help="print families and blends as JSON")

    show = commands.add_parser("show", help="print a run's tables and draw its plots")
    show.add_argument("run", type=to_path, metavar="RUN", help="run folder")
    show.add_argument("--html", type=to_path, metavar="FILE", help="write all of it as one page that needs no network")

    _add_paper(commands)
    _add_study(commands)

    listed = commands.add_parser("envs", help="list the environments")
    listed.add_argument("env", nargs="*", metavar="ENV", help="ids, also of yours: MODULE:ID (default: all)")
    listed.add_argument("--speed", action="store_true", help="measure how fast each is here (some 15 seconds each)")
    return whole


def _add_train(commands: Any) -> None:
    train = commands.add_parser(
        "train",
        help="train a population, with a decision maker in the loop",
        description=f"Preset, then config file, then flags: each overrides the one before.\n{OF_SETTINGS}",
        formatter_class=argparse.RawTextHelpFormatter,
    )
    _add_new_run(train)
    _add_output(train)
    _add_settings(train, train.add_argument_group("settings"), Config, "")


def _add_paper(commands: Any) -> None:
    paper = commands.add_parser(
        "paper",
        help="repeat the paper's experiments, and write the report",
        description="Runs that are done are skipped, one that was interrupted goes on, and the report says what is "
        "missing. Raw units come first.",
    )
    paper.add_argument("--only", type=_items, metavar="ITEM,...", help=f"of {', '.join(PAPER_ITEMS)} (default: all)")
    paper.add_argument("--units", choices=["raw", "paper", "both"], default="both", help="default: both")
    paper.add_argument("--seeds", type=_seeds, metavar="SEED,...", help="default: the paper's")
    paper.add_argument("--quick", action="store_true", help="all of it at a tiny size, to see that it works")
    paper.add_argument(
        "--together",
        type=_count,
        default=1,
        metavar="RUNS",
        help="made in one program, where one alone does not fill the machine (default: 1)",
    )
    paper.add_argument("--report", action="store_true", help="make no runs, only the report of those there are")
    paper.add_argument("--out", type=to_path, metavar="FOLDER", help="default: benchmarks/paper, or runs/paper-quick")
    paper.add_argument("--work", type=to_path, metavar="FOLDER", help="run folders (default: runs/paper, or OUT/work)")


def _add_study(commands: Any) -> None:
    study = commands.add_parser(
        "study",
        help="compare what users get from methods, and what they are asked",
        description="The plan says which users, methods and seeds; see benchmarks/study/plan.toml. Runs that are done "
        "are skipped, one that was interrupted goes on, and the report is about the runs there are.",
    )
    study.add_argument("plan", type=to_path, metavar="PLAN", help="a TOML file")
    study.add_argument("--report", action="store_true", help="make no runs, only the report of those there are")
    study.add_argument("--out", type=to_path, metavar="FOLDER", help="report and records (default: the plan's folder)")
    study.add_argument("--work", type=to_path, metavar="FOLDER", help="run folders (default: runs/study)")


def _add_studio(commands: Any) -> None:
    studio = commands.add_parser(
        "studio",
        help="steer a run on a web page: a new one, one that was interrupted or has ended, or one of a folder of runs",
        description="Without RUN a new one is made, as by train; you are its user unless --user names another.\n"
        f"{OF_SETTINGS}",
        formatter_class=argparse.RawTextHelpFormatter,
    )
    studio.add_argument("run", type=to_path, nargs="?", metavar="RUN", help=STUDIO_RUN)
    studio.add_argument("--host", default="127.0.0.1", help="address to listen on (default: this machine alone)")
    studio.add_argument("--port", type=_port, default=8080, help="default: 8080")
    studio.add_argument("--token", help="what the page asks for (default: none on this machine, else a random one)")
    studio.add_argument("--watch-token", help="what the address for watching asks for (default: a random one)")
    _add_new_run(studio)
    _add_settings(studio, studio.add_argument_group("settings of a new run"), Config, "")


def _add_new_run(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--preset", default="default", help=f"{', '.join(PRESETS)} (default: default)")
    parser.add_argument(
        "--config", type=to_path, metavar="FILE", help="settings as TOML, for instance a run's config.toml"
    )
    parser.add_argument("--out", type=to_path, metavar="FOLDER", help="run folder (default: runs/DATE-TIME)")
    parser.add_argument("--force", action="store_true", help="overwrite the run that is in the folder")


def _add_continuing(commands: Any) -> None:
    resume = commands.add_parser(
        "resume", help="go on with a run that was interrupted, to the result it would have had"
    )
    resume.add_argument("run", type=to_path, metavar="RUN", help="run folder")
    resume.add_argument("--ask-now", action="store_true", help="the next question is for the user, not for a stand-in")
    _add_output(resume)

    branch = commands.add_parser("branch", help="begin a new run where a run was after one of its rounds (generations)")
    branch.add_argument("run", type=to_path, metavar="RUN", help="run folder, which stays as it is")
    branch.add_argument(
        "--round",
        "--generation",
        dest="generation",
        type=_id,
        required=True,
        metavar="K",
        help="the last one taken over; 0: warm-up",
    )
    branch.add_argument("--out", type=to_path, required=True, metavar="FOLDER", help="folder of the new run")
    branch.add_argument("--user", help="who decides from then on, as in train (default: the run's own user)")
    branch.add_argument("--steps", type=_count, metavar="N", help="budget of steps, those before the branch included")
    branch.add_argument("--force", action="store_true", help="overwrite the run that is in the folder")
    _add_output(branch)

    export = commands.add_parser("export", help="copy a policy of a run to a file of its own")
    export.add_argument("run", type=to_path, metavar="RUN", help="run folder")
    which = export.add_mutually_exclusive_group()
    which.add_argument("--policy", type=_id, metavar="ID", help="default: the run's choice")
    which.add_argument(
        "--blend",
        type=_shares,
        metavar="ID:SHARE,...",
        help="a blend of policies, scored anew: 12:0.4,15:0.6 between two, 12:1.5,15:-0.5 beyond 12, away from 15",
    )
    export.add_argument("--to", type=to_path, required=True, metavar="FILE", help="a NumPy archive, .npz")
    export.add_argument("--force", action="store_true", help="overwrite the file")


def _add_output(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--quiet", action="store_true", help="print nothing but errors")
    parser.add_argument("--json", action="store_true", help="print one JSON object for each event")


def _add_policy(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("policy", type=to_path, metavar="RUN_OR_POLICY", help="run folder, or policy file")
    parser.add_argument("--policy", dest="id", type=_id, metavar="ID", help="of a run folder (default: its choice)")


def _add_settings(parser: argparse.ArgumentParser, group: Any, section: type[Section], prefix: str) -> None:
    """One flag for every field. Values stay strings here, so that the config can name all problems at once."""
    for name, field in section.model_fields.items():
        kind = field.annotation
        if isinstance(kind, type) and issubclass(kind, Section):
            title = f"{name}: {kind.summary()}"
            _add_settings(parser, parser.add_argument_group(title), kind, f"{prefix}{name}.")
        else:
            default = _written(field.default)
            texts = [f"{field.description} ({default})" if default else f"{field.description}"]
            texts += _in_presets([*prefix.split(".")[:-1], name], default)
            group.add_argument(
                f"--{prefix}{name}".replace("_", "-"),
                dest=f"{SETTING}{prefix}{name}",
                metavar=name.rpartition("_")[2].upper(),
                help="\n".join(texts).replace("%", "%%"),
            )


def _in_presets(path: Sequence[str], default: str) -> Iterator[str]:
    """Yield what presets say of a setting: first everywhere, then `ENV: value` for environments of which they do."""
    everywhere = {name: _preset_value(preset.everywhere, path, default) for name, preset in PRESETS.items()}
    yield from (f"in preset {name} {value}" for name, value in everywhere.items() if value != default)
    for env in PRESETS["default"].environments:
        values = {name: _preset_value(preset.settings(env), path, default) for name, preset in PRESETS.items()}
        usual = values.pop("default")
        others = [f"in preset {preset} {value}" for preset, value in values.items() if value != usual]
        if any(_preset_value(preset.environments.get(env, {}), path, "") for preset in PRESETS.values()):
            yield f"{env}: {', '.join([usual, *others])}"


def _preset_value(settings: Any, path: Sequence[str], default: str) -> str:
    for name in path:
        if name not in settings:
            return default
        settings = settings[name]
    return _written(settings)


def _written(value: Any) -> str:
    """Return a value as on the command line."""
    return ",".join(f"{each:g}" for each in value) if isinstance(value, tuple) else str(value)


def _whole(least: int, most: int | None = None) -> Callable[[str], int]:
    """Return a parser of whole numbers within bounds."""

    def number(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"must be a whole number, not {text!r}") from None
        if value < least or (most is not None and value > most):
            limits = f"at least {least}" if most is None else f"from {least} to {most}"
            raise argparse.ArgumentTypeError(f"must be {limits}, not {value}")
        return value

    return number


_count, _id = _whole(1, 2**31 - 1), _whole(0)  # compiled programs count in 32 bits
_seed, _port, _size = _whole(0, 2**32 - 1), _whole(1, 65535), _whole(160, 4096)


def _items(text: str) -> list[str]:
    items = text.split(",")
    unknown = [item for item in items if item not in PAPER_ITEMS]
    if unknown:
        raise argparse.ArgumentTypeError(f"unknown {', '.join(unknown)}; known: {', '.join(PAPER_ITEMS)}")
    return items


def _shares(text: str) -> Blend:
    """Return what `12:0.4,15:0.6` says; shares need not add up to one."""
    pairs = [part.partition(":") for part in re.split("[, ]+", text.strip())]
    try:
        shares = {_id(policy): float(share) for policy, _, share in pairs}
    except (ValueError, argparse.ArgumentTypeError):
        shares = {}
    total = sum(shares.values())
    if len(shares) < len(pairs) or not (0 < total < math.inf):
        rule = "give ids with shares, such as 12:0.4,15:0.6, each id once; the shares must add up to more than 0"
        raise argparse.ArgumentTypeError(f"{text!r} is no blend: {rule}")
    return Blend(tuple(sorted(shares)), tuple(shares[each] / total for each in sorted(shares)))


def _seeds(text: str) -> tuple[int, ...]:
    return tuple(_seed(word) for word in text.split(","))

"""Which runs a benchmark makes: methods, users and seeds, of a preset or a variant of it."""

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from jmorl.config import Config, resolve
from jmorl.decision.utility import USERS

SEEDS = (1, 7, 10, 42, 100)


def add_arms(parser: argparse.ArgumentParser, result: Path) -> None:
    """Add the flags that `arms` reads, and `--out`, where the result goes."""
    parser.add_argument("--seeds", type=int, nargs="+", default=SEEDS)
    parser.add_argument("--users", nargs="+", choices=USERS, default=list(USERS))
    parser.add_argument("--methods", nargs="+", choices=("pgmorl", "interactive"), default=["pgmorl", "interactive"])
    parser.add_argument("--preset", default="default")
    add_settings(parser)
    parser.add_argument("--out", type=Path, default=result)


def add_settings(parser: argparse.ArgumentParser) -> None:
    """Add `--set`, which gives {SECTION: {NAME: VALUE}}."""
    parser.add_argument("--set", nargs="+", default={}, action=_Nested, metavar="SECTION.NAME=VALUE")


def arms(options: argparse.Namespace, env: str) -> Iterator[Config]:
    """Yield the config of each run. PGMORL asks nobody before its end, so one run of a seed serves all users."""
    for seed in options.seeds:
        for method in options.methods:
            for user in options.users[:1] if method == "pgmorl" else options.users:
                overrides = {"env": env, "method": method, "user": user, "seed": seed}
                yield resolve(options.preset, None, overrides).replace(**options.set)


class _Nested(argparse.Action):
    """SECTION.NAME=VALUE ... as {SECTION: {NAME: VALUE}}; values stay texts, which the config parses."""

    def __call__(self, parser: argparse.ArgumentParser, namespace: Any, values: Any, option: str | None = None) -> None:
        nested: dict[str, dict[str, str]] = {}
        for text in values:
            name, equals, value = text.partition("=")
            section, dot, field = name.partition(".")
            if not (equals and dot):
                parser.error(f"--set takes SECTION.NAME=VALUE, not {text!r}")
            nested.setdefault(section, {})[field] = value
        setattr(namespace, self.dest, nested)

"""Variants of a preset on the command line of a benchmark: `--set SECTION.NAME=VALUE ...`."""

import argparse
from typing import Any


def add_variant(parser: argparse.ArgumentParser) -> None:
    """Add `--preset`, and `--set`, which parses to the nested overrides that `Config.replace` takes."""
    parser.add_argument("--preset", default="default")
    parser.add_argument("--set", nargs="+", default={}, action=_Nested, metavar="SECTION.NAME=VALUE")


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

"""Formats have numbers: what a newer jmorl wrote in a way unknown here is refused, never guessed at."""

import importlib.metadata
from collections.abc import Mapping
from typing import Any


class NewerFormat(ValueError):
    """A file is in a format that this jmorl does not know yet."""


def check_format(fields: Mapping[str, Any], known: int, writer: str | None, name: str) -> None:
    """Raise NewerFormat if `fields["format"]` is above the one known; `writer` is the version that wrote it."""
    if fields["format"] > known:
        here = importlib.metadata.version("jmorl")
        raise NewerFormat(
            f"{name} has format {fields['format']}, written by jmorl {writer or 'of an unknown version'}; this is "
            f"jmorl {here}, which knows formats up to {known}: update it"
        )

"""Formats have numbers: what a newer jmorl wrote in a way unknown here is refused, never guessed at."""

import importlib.metadata
from collections.abc import Mapping
from typing import Any

from jmorl.storage.documents import DocumentError


class NewerFormat(ValueError):
    """A file is in a format that this jmorl does not know yet."""


def check_format(fields: Mapping[str, Any], known: int, name: str) -> None:
    """Raise NewerFormat if `fields["format"]` is above the one known, DocumentError if it is none."""
    found = fields.get("format")
    if type(found) is not int or found < 1:
        problem = f"format: {found!r} is not a whole number above zero" if "format" in fields else "format is missing"
        raise DocumentError(f"{name} is damaged: {problem}")
    if found > known:
        here = importlib.metadata.version("jmorl")
        raise NewerFormat(
            f"{name} has format {found}, written by jmorl {_writer(fields)}; this is "
            f"jmorl {here}, which knows formats up to {known}: update it"
        )


def _writer(fields: Mapping[str, Any]) -> str:
    """Return the version that wrote a document; a manifest has it among the packages."""
    packages = fields.get("packages")
    version = packages.get("jmorl") if isinstance(packages, Mapping) else fields.get("jmorl")
    return str(version or "of an unknown version")

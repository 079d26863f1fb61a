"""Names that files are called after."""

import re

NAME = re.compile(r"\w[\w .+=-]*")


def is_name(text: str) -> bool:
    """Return whether a file may be named after a text on every system."""
    return bool(NAME.fullmatch(text))

"""Names that were meant."""

import difflib
from collections.abc import Iterable


def nearest(name: str, known: Iterable[str]) -> str | None:
    """Return the known name that is most like this one, or whose last part is; None if there is no such name."""
    written = {part.lower(): each for each in known for part in (each.rpartition(".")[2], each)}
    near = difflib.get_close_matches(name.lower(), written, n=1)
    return written[near[0]] if near else None


def did_you_mean(name: str | None) -> str:
    """Return the end of a sentence about an unknown name, `; did you mean 'x'?`; nothing for None."""
    return f"; did you mean {name!r}?" if name else ""

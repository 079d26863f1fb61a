"""Commands of this program, as people can paste them into a shell."""

import shlex
from pathlib import Path


def command(*words: str | Path) -> str:
    """Return `jmorl` and the words, each quoted where a shell would take it for something else."""
    return shlex.join(["jmorl", *map(str, words)])

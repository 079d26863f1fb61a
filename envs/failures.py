"""What somebody's own code raised, in a sentence."""

import sysconfig
import traceback
from pathlib import Path

LIBRARIES = tuple(sysconfig.get_path(name) for name in ("stdlib", "purelib", "platlib"))


def failure(error: Exception) -> str:
    """Kind and message of a caught error, and the last line outside the libraries that it came through, if any."""
    frames = traceback.extract_tb(error.__traceback__)[1:]  # the first is the one that caught it
    own = [frame for frame in frames if not frame.filename.startswith(("<", *LIBRARIES))]
    place = f" ({Path(own[-1].filename).name}, line {own[-1].lineno})" if own else ""
    return f"{type(error).__name__}: {error}{place}"

"""Numbers and counts as people read them."""

import math
import re

import numpy as np

from envs.core import Objective
from jmorl.search.scaling import core

PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"))
REASONS = {  # why a run ended
    "budget": "the budget of environment steps is used up",
    "satisfied": "the user is satisfied",
    "stopped": "the user ended it",
}


def number_format(values: np.ndarray, digits: int = 3) -> str:
    """Return a format that shows the range of most of the values [N] with so many significant digits.

    NaN and infinity are ignored, and values far out do not count; without a range, the distance to 0 does.
    """
    present = values[np.isfinite(values)]
    near = present[core(present[:, None])]
    extent = (np.ptp(near) or abs(near[0]) or 1.0) if len(near) else 1.0
    if len(present) and np.abs(present).max() >= 1e9 or extent < 1e-6:
        return f".{digits}g"
    return f".{max(digits - 1 - math.floor(math.log10(extent)), 0)}f"


def number(value: float) -> str:
    """Return a number that stands alone, with four significant digits."""
    return f"{value:{number_format(np.array([value]), digits=4)}}" if value else "0"


def short_count(count: float) -> str:
    """Return a number of at least 0 with three significant digits: 950, 24.0 k, 2.64 M."""
    for size, prefix in PREFIXES:
        scaled = count / size
        if scaled >= 0.9995:
            return f"{scaled:.{2 if scaled < 9.995 else 1 if scaled < 99.95 else 0}f} {prefix}"
    return f"{count:.0f}"


def duration(seconds: float) -> str:
    """Seconds as 8.2 s, 45 s, 3 min 20 s or 2 h 5 min."""
    if seconds < 9.95:
        return f"{seconds:.1f} s"
    if seconds < 59.5:
        return f"{seconds:.0f} s"
    if seconds < 3599.5:
        minutes, rest = divmod(round(seconds), 60)
        return f"{minutes} min {rest} s"
    hours, rest = divmod(round(seconds / 60), 60)
    return f"{hours} h {rest} min"


def minus(text: str) -> str:
    """Write numbers with the sign for minus that is as wide as a digit."""
    return re.sub(r"(?<!\w)-(?=\d)", "\N{MINUS SIGN}", text)


def plural(count: int, noun: str) -> str:
    """`1 step`, `2 steps`, `2 policies`."""
    if count == 1:
        return f"1 {noun}"
    return f"{count} {noun[:-1]}ies" if noun.endswith("y") else f"{count} {noun}s"


def objective_label(objective: Objective) -> str:
    """Return the quantity and the unit of its returns, for headings and axes."""
    return f"{objective.label} ({objective.unit})"

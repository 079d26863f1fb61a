"""How methods and numbers are called in sentences, tables and figures."""

import numpy as np

from jmorl.paper.plan import SHORTER

NAMES = {"interactive": "the interactive method", "pgmorl": "PGMORL", SHORTER: "PGMORL with warm-up 40"}


def named(method: str) -> str:
    """A method of this project's, or somebody else's, in a sentence."""
    return NAMES.get(method, method)


def million(steps: float) -> str:
    return f"{steps / 1e6:.2f} M"


def number(value: float, form: str, otherwise: str = "") -> str:
    """`otherwise` for NaN: where there is nothing to average."""
    return otherwise if np.isnan(value) else f"{value:{form}}"


def sentence(text: str) -> str:
    return text[0].upper() + text[1:]


def share(count: int, total: int) -> str:
    return f"{count} of {total}"

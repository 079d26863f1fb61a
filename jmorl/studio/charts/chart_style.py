"""What the charts of the studio have in common: colours that colour-blind people can tell apart, letters, numbers."""

from typing import Any

import numpy as np

from envs.core import Objective
from jmorl.display.text import number_format, objective_label
from jmorl.report.style import BLUE, GREEN, GREY, INK, ORANGE, PALE, RED

__all__ = ["BLUE", "GREEN", "GREY", "INK", "ORANGE", "PALE", "RED"]

LETTER_COLOURS = {"A": RED, "B": GREEN, "C": "#AA4499"}  # differ in lightness, too
TEXT = {"fontFamily": "Roboto, sans-serif", "fontSize": 11, "color": INK}
# Text that is drawn, not HTML: nothing that a name holds is markup. Values as p.value, their names as the dimensions'.
TOOLTIP_TEXT = """
(p) => {
  const number = (v) => v.toLocaleString("en", { maximumSignificantDigits: 5 }).replace("-", "−");
  const values = p.dimensionNames.slice(1, -1).map((name, i) => `${name}  ${number(p.value[i + 1])}`);
  return [`policy ${p.value[0]}`, ...values, p.value[p.value.length - 1]].filter(Boolean).join("\\n");
}
"""
# The same for lines of parallel coordinates, [values..., policy], whose dimensions have no names: they come first.
LINE_TOOLTIP = """
(p) => {
  const names = %s;
  const number = (v) => v.toLocaleString("en", { maximumSignificantDigits: 5 }).replace("-", "−");
  return [`policy ${p.data[names.length]}`, ...names.map((name, i) => `${name}  ${number(p.data[i])}`)].join("\\n");
}
"""


def base() -> dict[str, Any]:
    """Options that every chart begins with."""
    return {"animation": False, "textStyle": TEXT, "tooltip": {"renderMode": "richText", "confine": True}}


def better(objective: Objective) -> str:
    """The title of an axis: quantity, unit and direction."""
    return f"{objective_label(objective)}, more is better →"


def decimals(values: np.ndarray) -> list[int | None]:
    """Digits after the point for each objective of the vectors [N, M]; None: as few significant ones as possible."""
    formats = [number_format(column) for column in values.T]
    return [int(fmt[1:-1]) if fmt.endswith("f") else None for fmt in formats]


def plain(values: np.ndarray) -> list[Any]:
    """Numbers for JSON, with seven significant digits; infinity, which it does not have, is left out."""
    return [[_number(value) for value in row] for row in np.atleast_2d(values)]


def _number(value: float) -> float | None:
    return float(f"{value:.7g}") if np.isfinite(value) else None

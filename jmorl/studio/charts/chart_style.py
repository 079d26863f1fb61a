"""The common style of the charts: colours that colour-blind people can tell apart, text, tooltips, numbers."""

from typing import Any

import numpy as np

from envs.core import Objective
from jmorl.display.text import number_format, objective_label
from jmorl.report.style import BLUE, GREEN, GREY, INK, ORANGE, PALE, RED

__all__ = ["BLUE", "GREEN", "GREY", "INK", "ORANGE", "PALE", "RED"]

LETTER_COLOURS = {"A": RED, "B": GREEN, "C": "#AA4499"}  # differ in lightness, too
TEXT = {"fontFamily": "Roboto, sans-serif", "fontSize": 11, "color": INK}
# Text that is drawn, not HTML: nothing that a name holds is markup. Of points [policy, values..., note].
TOOLTIP_TEXT = """
(p) => {
  const names = %s;
  const number = (v) => v.toLocaleString("en", { maximumSignificantDigits: 5 }).replace("-", "−");
  const values = names.map((name, i) => `${name}  ${number(p.value[i + 1])}`);
  return [`policy ${p.value[0]}`, ...values, p.value[names.length + 1]].filter(Boolean).join("\\n");
}
"""
# The same for lines of parallel coordinates, [values..., policy].
LINE_TOOLTIP = """
(p) => {
  const names = %s;
  const number = (v) => v.toLocaleString("en", { maximumSignificantDigits: 5 }).replace("-", "−");
  return [`policy ${p.data[names.length]}`, ...names.map((name, i) => `${name}  ${number(p.data[i])}`)].join("\\n");
}
"""


def base() -> dict[str, Any]:
    """Return the options that every chart begins with."""
    return {"animation": False, "textStyle": TEXT, "tooltip": {"renderMode": "richText", "confine": True}}


def better(objective: Objective) -> str:
    """Return the title of an axis: quantity, unit and direction."""
    return f"{objective_label(objective)}, better →"


def decimals(values: np.ndarray) -> list[int | None]:
    """Return the digits after the point for each objective of `values` [N, M]; None: significant digits, as needed."""
    formats = [number_format(column) for column in values.T]
    return [int(fmt[1:-1]) if fmt.endswith("f") else None for fmt in formats]


def plain(values: np.ndarray) -> list[Any]:
    """Return numbers for JSON, with seven significant digits; infinity becomes None, as JSON has none."""
    return [[_number(value) for value in row] for row in np.atleast_2d(values)]


def _number(value: float) -> float | None:
    return float(f"{value:.7g}") if np.isfinite(value) else None

"""The common style of the charts: colours that colour-blind people can tell apart, text, tooltips, numbers."""

import json
import math
import textwrap
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from envs.core import Objective
from jmorl.display.readings import reading_label
from jmorl.report.style import BLUE, GREEN, GREY, INK, ORANGE, PALE, RED

__all__ = ["BLUE", "GREEN", "GREY", "INK", "ORANGE", "PALE", "RED"]

LETTER_COLOURS = {"A": RED, "B": GREEN, "C": "#AA4499"}  # differ in lightness, too
TEXT = {"fontFamily": "Roboto, sans-serif", "fontSize": 11, "color": INK}
# Text that is drawn, not HTML: nothing that a name holds is markup. Of points [policy, values..., note].
TOOLTIP_TEXT = """
(p) => {
  const objectives = %s;
  const number = (v) => (v + 0).toLocaleString("en", { maximumSignificantDigits: 5 }).replace("-", "−");
  const values = objectives.map(([label, scale], i) => `${label}  ${number(p.value[i + 1] * scale)}`);
  return [`policy ${p.value[0]}`, ...values, p.value[objectives.length + 1]].filter(Boolean).join("\\n");
}
"""
# The same for lines of parallel coordinates, [values..., policy, name].
LINE_TOOLTIP = """
(p) => {
  const objectives = %s;
  const number = (v) => (v + 0).toLocaleString("en", { maximumSignificantDigits: 5 }).replace("-", "−");
  const values = objectives.map(([label, scale], i) => `${label}  ${number(p.data[i] * scale)}`);
  const policy = `policy ${p.data[objectives.length]} ${p.data[objectives.length + 1]}`;
  return [policy, ...values].join("\\n");
}
"""
INTERVALS = 5  # between the numbers along an axis, about
TICK = """
(v) => {
  const [scale, places] = %s;
  const digits = { minimumFractionDigits: places, maximumFractionDigits: places };
  return (Number((v * scale).toFixed(places)) + 0).toLocaleString("en", digits).replace("-", "−");
}
"""


def base() -> dict[str, Any]:
    """Return the options that every chart begins with."""
    return {"animation": False, "textStyle": TEXT, "tooltip": {"renderMode": "richText", "confine": True}}


def better(objective: Objective, room: int) -> str:
    """Return the title of an axis: quantity, unit and direction, the quantity cut to so many characters."""
    label = textwrap.shorten(objective.label, max(room, 1), placeholder=" …")
    return f"{reading_label(replace(objective, label=label))}, better →"


def read_ticks(objective: Objective, low: float, high: float) -> dict[str, str]:
    """Return what writes numbers along an axis of returns from low to high as people say them, with equal digits."""
    interval = abs(objective.read.scale) * (high - low) / INTERVALS
    places = max(-math.floor(math.log10(interval)), 0) if interval > 1e-9 else 9
    return {":formatter": TICK % [objective.read.scale, min(places, 9)]}


def tooltip(text: str, objectives: Sequence[Objective]) -> dict[str, str]:
    """Return what writes a tooltip: TOOLTIP_TEXT or LINE_TOOLTIP, for these objectives."""
    return {":formatter": text % json.dumps([(reading_label(each), each.read.scale) for each in objectives])}


def plain(values: np.ndarray) -> list[Any]:
    """Return numbers for JSON, with seven significant digits; infinity becomes None, as JSON has none."""
    return [[_number(value) for value in row] for row in np.atleast_2d(values)]


def _number(value: float) -> float | None:
    return float(f"{value:.7g}") if np.isfinite(value) else None

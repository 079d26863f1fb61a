"""The front as lines across an axis for each objective, a line for each policy."""

import textwrap
from typing import Any

import numpy as np

from jmorl.display.limits import around
from jmorl.display.readings import reading_label
from jmorl.search.bounds import within
from jmorl.studio.charts.chart_style import (
    BLUE,
    GREEN,
    GREY,
    INK,
    LETTER_COLOURS,
    LINE_TOOLTIP,
    PALE,
    TEXT,
    base,
    plain,
    read_ticks,
    tooltip,
)
from jmorl.studio.selection import Selection
from jmorl.studio.view import View

LETTERS, SHORTEST = 80, 16  # of names beside each other: in all, and of one in a line at least
LINE = 12  # pixels


def parallel_options(view: View) -> dict[str, Any]:
    """Draw what stays while policies are looked at; up is better on every axis. Lines are [values..., policy, name]."""
    inside = within(view.values, view.bounds)
    return {
        **_frame(view, visible=True),
        "series": [
            _lines("outside the bounds", view, ~inside, PALE),
            _lines("within the bounds", view, inside, BLUE),
            _bounds(view),
        ],
    }


def parallel_marks(view: View, selection: Selection) -> dict[str, Any]:
    """Draw the lines of the policies laid out: a chart to put over the other."""
    lines = [
        {
            "value": [*plain(policy.values)[0], policy.id],
            "lineStyle": {
                "color": LETTER_COLOURS[letter],
                "width": 4 if policy.id == selection.focus else 2.5,
                "opacity": 1,
            },
        }
        for policy_id, letter in selection.letters.items()
        if (policy := view.policy(policy_id))
    ]
    prospect = selection.prospect if view.question else None
    lowest = _axes_limits(view)[0]
    proposed = plain(np.maximum(prospect.bounds, lowest)) if prospect and np.isfinite(prospect.bounds).all() else []
    dashed = {"color": GREEN, "width": 1.5, "type": "dashed", "opacity": 1}
    series = [
        _series("bounds that would follow", proposed, lineStyle=dashed, silent=True, z=4),
        _series("laid out", lines, silent=True, z=5),
    ]
    return {**_frame(view, visible=False), "series": series}


def _frame(view: View, visible: bool) -> dict[str, Any]:
    """Return the options that give both charts the same coordinates."""
    limits = _axes_limits(view)
    visible = visible and bool(view.front)
    text = {**TEXT, "color": INK if visible else "transparent", "showMinLabel": False, "showMaxLabel": False}
    room = max(LETTERS // max(len(view.objectives) - 1, 1), SHORTEST)
    names = ["\n".join(textwrap.wrap(f"↑ {reading_label(objective)}", room)) for objective in view.objectives]
    head = 22 + LINE * max(name.count("\n") + 1 for name in names)
    axes = [
        {
            "dim": index,
            "name": names[index] if visible else "",
            "nameTextStyle": {**TEXT, "lineHeight": LINE},
            "nameGap": 12,
            "min": float(low),
            "max": float(high),
            # The first axis has its numbers on its left, where no lines are.
            "axisLabel": {
                **text,
                **read_ticks(objective, low, high),
                **({"margin": -8, "align": "right"} if index == 0 else {"margin": 8}),
            },
            "axisLine": {"show": visible, "lineStyle": {"color": GREY}},
            "axisTick": {"show": visible, "length": -5 if index == 0 else 5},
        }
        for index, (objective, low, high) in enumerate(zip(view.objectives, *limits, strict=True))
    ]
    return {**base(), "parallel": {"left": 70, "right": 90, "top": head, "bottom": 14}, "parallelAxis": axes}


def _axes_limits(view: View) -> np.ndarray:
    """Return the limits [2, M] of the axes: around the front and the bounds in force."""
    shown = np.concatenate([view.values, view.bounds[None]]) if _bounded(view) else view.values
    if not len(shown):
        return np.stack([np.zeros(len(view.objectives)), np.ones(len(view.objectives))])
    return around(shown)


def _bounded(view: View) -> bool:
    return bool(view.front) and bool(np.isfinite(view.bounds).all())


def _lines(name: str, view: View, kept: np.ndarray, colour: str) -> dict[str, Any]:
    data = [
        [*values, policy.id, view.noted.policy(policy.id).quoted]
        for policy, values, shown in zip(view.front, plain(view.values), kept, strict=True)
        if shown
    ]
    opacity = min(0.7, 60 / max(len(view.front), 1))  # of many lines one still sees where most are
    style = {"color": colour, "width": 1.2, "opacity": opacity}
    return _series(name, data, lineStyle=style, tooltip=tooltip(LINE_TOOLTIP, view.objectives), z=2)


def _bounds(view: View) -> dict[str, Any]:
    data = [plain(view.bounds)[0]] if _bounded(view) else []
    style = {"color": INK, "width": 1.5, "type": "dashed", "opacity": 1}
    return _series("bounds", data, lineStyle=style, silent=True, z=4)


def _series(name: str, data: list[Any], **look: Any) -> dict[str, Any]:
    return {"type": "parallel", "id": name, "name": name, "data": data, **look}

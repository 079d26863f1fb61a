"""The front as lines, one for each policy, across an axis for each objective: for any number of them."""

from typing import Any

import numpy as np

from jmorl.display.limits import around
from jmorl.display.text import objective_label
from jmorl.search.bounds import within
from jmorl.studio.desk import Desk
from jmorl.studio.looks import BLUE, GREY, INK, LETTER_COLOURS, PALE, TEXT, base, plain
from jmorl.studio.view import View


def parallel_options(view: View, desk: Desk) -> dict[str, Any]:
    """The whole chart; up is better on every axis. Lines are [values..., policy]."""
    opacity = min(0.7, 60 / max(len(view.front), 1))  # of many lines one still sees where most are
    inside = within(view.values, view.bounds) if view.front else np.zeros(0, bool)
    limits = around(np.concatenate([view.values, view.bounds[None]])) if _bounded(view) else None
    if limits is None:
        limits = around(view.values) if view.front else np.stack([np.zeros(len(view.objectives))] * 2) + [[0], [1]]
    axes = [
        {"dim": index, "name": f"↑ {objective_label(objective)}", "min": float(low), "max": float(high)}
        for index, (objective, low, high) in enumerate(zip(view.objectives, *limits, strict=True))
    ]
    return {
        **base(),
        "parallel": {
            "left": 70,
            "right": 90,
            "top": 34,
            "bottom": 14,
            "parallelAxisDefault": {
                "nameTextStyle": TEXT,
                "nameGap": 12,
                "axisLabel": {**TEXT, "showMinLabel": False, "showMaxLabel": False},
                "axisLine": {"lineStyle": {"color": GREY}},
            },
        },
        "parallelAxis": axes,
        "series": [
            _lines("outside the bounds", view, ~inside, {"color": PALE, "width": 1, "opacity": opacity}),
            _lines("within the bounds", view, inside, {"color": BLUE, "width": 1.2, "opacity": opacity}),
            _bounds(view),
            parallel_marks(view, desk),
        ],
    }


def parallel_marks(view: View, desk: Desk) -> dict[str, Any]:
    """The lines of what is laid out, the last series."""
    lines = [
        {
            "value": [*plain(policy.values)[0], policy.id],
            "lineStyle": {"color": LETTER_COLOURS[letter], "width": 4 if policy.id == desk.focus else 2.5},
        }
        for policy_id, letter in desk.letters.items()
        if (policy := view.policy(policy_id))
    ]
    return {"type": "parallel", "id": "laid out", "name": "laid out", "data": lines, "silent": True, "z": 5}


def _bounded(view: View) -> bool:
    return bool(view.front) and bool(np.isfinite(view.bounds).all())


def _lines(name: str, view: View, kept: np.ndarray, look: dict[str, Any]) -> dict[str, Any]:
    data = [
        [*values, policy.id]
        for policy, values, shown in zip(view.front, plain(view.values), kept, strict=True)
        if shown
    ]
    return {"type": "parallel", "id": name, "name": name, "data": data, "lineStyle": look, "z": 2}


def _bounds(view: View) -> dict[str, Any]:
    data = [plain(view.bounds)[0]] if _bounded(view) else []
    look = {"color": INK, "width": 1.5, "type": "dashed", "opacity": 1}
    return {
        "type": "parallel",
        "id": "bounds",
        "name": "bounds",
        "data": data,
        "lineStyle": look,
        "silent": True,
        "z": 4,
    }

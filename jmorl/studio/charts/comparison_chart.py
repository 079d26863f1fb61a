"""The fronts of several branches as points in two of their objectives."""

from collections.abc import Set
from typing import Any

import numpy as np

from jmorl.display.limits import around, inside
from jmorl.search.scaling import core
from jmorl.studio.charts.chart_style import BLUE, GREEN, INK, RED, TEXT, TOOLTIP_TEXT, plain, tooltip
from jmorl.studio.charts.front_chart import STAR, frame
from jmorl.studio.comparison import BranchFront, Comparison
from jmorl.studio.view import View

COLOURS = (BLUE, RED, GREEN, "#AA4499", "#7A5900", "#4B5563")
CROSS = "path://M0 2 L2 0 L6 4 L10 0 L12 2 L8 6 L12 10 L10 12 L6 8 L2 12 L0 10 L4 6 Z"
SYMBOLS = ("circle", "triangle", "diamond", "rect", CROSS)  # with the colours a pair for each of thirty branches
FAINT = "40"  # of a colour, so that points of several branches at the same place are all seen
LEGEND_ROOM = 40  # pixels


def comparison_options(view: View, axes: tuple[int, int], comparison: Comparison, runs: Set[str]) -> dict[str, Any]:
    """Draw the fronts of these runs, by ids, with their results as stars; the axes are those of the front's chart.

    A branch has the same colour and symbol whichever others are shown. What is far out stands at the edge.
    """
    shown = [each for each in comparison.fronts if each.branch.run in runs]
    limits = _limits(view, shown)
    options = frame(view, axes, limits, visible=True)
    return {
        **options,
        "grid": {**options["grid"], "top": LEGEND_ROOM},
        "legend": {
            "type": "scroll",
            "top": 6,
            "itemWidth": 12,
            "itemHeight": 12,
            "data": [each.branch.title for each in shown],
            "selectedMode": False,
            "textStyle": TEXT,
        },
        # Those that are not shown have no points: the browser's chart keeps a series that it is not sent.
        "series": [_series(view, each, axes, limits, each in shown) for each in comparison.fronts],
    }


def _limits(view: View, shown: list[BranchFront]) -> np.ndarray:
    """Return the limits [2, M] of the axes: around all that is shown, but for what is far out, and all results."""
    values = [each.front.values for each in shown]
    results = [each.front.result[1][None] for each in shown if each.front.result]
    seen = np.concatenate([np.zeros((0, len(view.objectives))), *values])
    return around(np.concatenate([seen[core(seen)], *results]))


def _series(view: View, shown: BranchFront, axes: tuple[int, int], limits: np.ndarray, visible: bool) -> dict[str, Any]:
    """Return the points [policy, values..., note, x, y] of a branch."""
    front, colour = shown.front, COLOURS[shown.place % len(COLOURS)]
    data: list[Any] = []
    if visible:
        data = [_point(shown, *point, axes, limits) for point in zip(front.ids, front.values, strict=True)]
        if front.result:
            star = {"color": colour, "borderColor": INK, "borderWidth": 1}
            value = _point(shown, *front.result, axes, limits, "the result")
            data.append({"value": value, "symbol": STAR, "symbolSize": 24, "itemStyle": star})
    count = len(view.objectives)
    return {
        "type": "scatter",
        "id": shown.branch.run,
        "name": shown.branch.title,
        "data": data,
        "encode": {"x": count + 2, "y": count + 3},
        "tooltip": tooltip(TOOLTIP_TEXT, view.objectives),
        "symbol": SYMBOLS[shown.place % len(SYMBOLS)],
        "symbolSize": 9,
        "itemStyle": {"color": f"{colour}{FAINT}", "borderColor": colour, "borderWidth": 1.3},
        "clip": False,
    }


def _point(
    shown: BranchFront, policy: int, values: np.ndarray, axes: tuple[int, int], limits: np.ndarray, role: str = ""
) -> list[Any]:
    here = list(axes)
    place = np.clip(values[here], *limits[:, here])
    far_out = "" if inside(values[here], limits[:, here]) else "far out"
    note = ", ".join(filter(None, (shown.branch.noted.policy(policy).quoted, role, far_out)))
    return [policy, *plain(values)[0], "\n".join(filter(None, (note, shown.branch.title))), *place.tolist()]

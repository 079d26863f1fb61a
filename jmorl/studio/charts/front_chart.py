"""The front as points in two of its objectives, with its bounds, earlier fronts, choices and expectations."""

from typing import Any

import numpy as np

from envs.core import Objective
from jmorl.decision.protocol import PointQuestion
from jmorl.display.limits import around, inside
from jmorl.display.text import minus, number
from jmorl.methods.base import Prospect
from jmorl.search.bounds import within
from jmorl.search.policy import Policy
from jmorl.search.scaling import core
from jmorl.studio.charts.chart_style import (
    BLUE,
    GREEN,
    GREY,
    INK,
    INTERVALS,
    LETTER_COLOURS,
    ORANGE,
    PALE,
    TEXT,
    TOOLTIP_TEXT,
    base,
    better,
    plain,
    read_ticks,
    tooltip,
)
from jmorl.studio.selection import Selection, wanted
from jmorl.studio.view import View

STAR = "path://M10 0 L12.9 6.9 L20 7.6 L14.6 12.4 L16.2 20 L10 16 L3.8 20 L5.4 12.4 L0 7.6 L7.1 6.9 Z"
GHOSTS = 6  # earlier fronts
IN_FORCE = {"color": BLUE, "opacity": 0.1, "borderColor": BLUE, "borderWidth": 1}
PROPOSED = {"color": "transparent", "borderColor": GREEN, "borderWidth": 1.5, "borderType": "dashed", "opacity": 1}
RULED_OUT = {"color": INK, "opacity": 0.12}
LONGEST_LABELS = 50, 14  # characters, to the right and upwards
DIGIT = 7  # pixels
MANY = 300  # policies; more are drawn smaller


def front_options(view: View, axes: tuple[int, int], asked: PointQuestion | None) -> dict[str, Any]:
    """Draw what stays while policies are looked at; `axes` are the objectives to the right and upwards."""
    limits = _limits(view, asked)
    return {
        **frame(view, axes, limits, visible=True),
        "series": [
            _area("bounds", view.bounds, axes, limits, IN_FORCE),
            _ghosts(view, axes),
            _members(view, axes, limits, within_bounds=False),
            _members(view, axes, limits, within_bounds=True),
            _far_out(view, axes, limits),
            _journey(view, axes),
            _result(view, axes),
        ],
    }


def front_marks(view: View, selection: Selection, axes: tuple[int, int], asked: PointQuestion | None) -> dict[str, Any]:
    """Draw what follows from the selection: a chart to put over the other, so that little is drawn anew."""
    limits = _limits(view, asked)
    prospect = selection.prospect if view.question else None  # what is answered brings nothing any more
    bounds = prospect.bounds if prospect else np.full(len(view.objectives), -np.inf)
    return {
        **frame(view, axes, limits, visible=False),
        "series": [
            _ruled_out(selection, axes, limits),
            _area("bounds that would follow", bounds, axes, limits, PROPOSED),
            _expected(prospect, axes),
            _wanted(view, selection, axes, limits),
            _laid_out(view, selection, axes, limits),
            _points(asked, axes),
        ],
    }


def frame(view: View, axes: tuple[int, int], limits: np.ndarray, visible: bool) -> dict[str, Any]:
    """Return the options that give both charts the same coordinates: no label may move or shrink their grids."""
    visible = visible and bool(view.front)
    digits = max(len(f"{value:,.4g}") for value in view.objectives[axes[1]].read.of(limits[:, axes[1]]))
    room = max(36, DIGIT * digits)  # for the numbers at the left
    x, y = (
        _axis(view.objectives[axis], limits[:, axis], gap, letters, visible)
        for axis, gap, letters in zip(axes, (26, room + 10), LONGEST_LABELS, strict=True)
    )
    grid = {"left": room + 26, "right": 18, "top": 14, "bottom": 44, "containLabel": False, "outerBoundsMode": "none"}
    return {**base(), "grid": grid, "xAxis": x, "yAxis": y}


def _limits(view: View, asked: PointQuestion | None) -> np.ndarray:
    """Return the limits [2, M] of the axes: around the front (but for what is far out), bounds, choices and points."""
    if not view.front:
        return np.stack([np.zeros(len(view.objectives)), np.ones(len(view.objectives))])
    seen = np.vstack([view.values, *(values for _, values in view.choices)])
    shown = [
        seen[core(seen)],
        *(choice.values[None] for choice in (view.previous, view.result) if choice),
    ]
    if np.isfinite(view.bounds).all():
        shown.append(view.bounds[None])
    if asked:
        shown.append(np.stack([asked.state.point, *(point.value for point in asked.points)]))
    return around(np.concatenate(shown))


def _axis(objective: Objective, limits: np.ndarray, gap: int, letters: int, visible: bool) -> dict[str, Any]:
    low, high = limits.tolist()
    return {
        "type": "value",
        "show": visible,
        "name": better(objective, letters),
        "nameLocation": "middle",
        "nameGap": gap,
        "nameTextStyle": TEXT,
        "min": low,
        "max": high,
        "axisLabel": {
            **TEXT,
            **read_ticks(objective, low, high),
            "showMinLabel": False,
            "showMaxLabel": False,
            "hideOverlap": True,
        },
        "axisLine": {"onZero": False, "lineStyle": {"color": GREY}},
        "splitLine": {"lineStyle": {"color": "#ececec"}},
        "splitNumber": INTERVALS,
    }


def _scatter(name: str, data: list[Any], axes: tuple[int, int], **style: Any) -> dict[str, Any]:
    """Return a series of points [policy, values..., note]; only those that are not silent answer the mouse."""
    return {
        "type": "scatter",
        "id": name,
        "name": name,
        "data": data,
        "encode": {"x": axes[0] + 1, "y": axes[1] + 1},
        **style,
    }


def _members(view: View, axes: tuple[int, int], limits: np.ndarray, within_bounds: bool) -> dict[str, Any]:
    """Draw the members of the front within the bounds, or those outside them, as far as the chart reaches."""
    kept = (within(view.values, view.bounds) == within_bounds) & _in_chart(view.values, axes, limits)
    data = [
        [policy.id, *values, _note(view, policy, "" if within_bounds else "outside the search area")]
        for policy, values, shown in zip(view.front, plain(view.values), kept, strict=True)
        if shown
    ]
    style: dict[str, Any] = {"color": BLUE, "borderColor": "#ffffff"}
    if not within_bounds:
        style = {"color": "#ffffff", "borderColor": BLUE, "borderWidth": 1.5}
    return _scatter(
        "within the bounds" if within_bounds else "outside the bounds",
        data,
        axes,
        tooltip=tooltip(TOOLTIP_TEXT, view.objectives),
        symbolSize=(9 if within_bounds else 7) if len(view.front) <= MANY else 5,
        itemStyle=style,
        emphasis={"scale": 1.6},
        z=4 if within_bounds else 3,
    )


def _far_out(view: View, axes: tuple[int, int], limits: np.ndarray) -> dict[str, Any]:
    """Draw the members of the front beyond the chart at its edge, as arrows, with the values that are far out."""
    data = []
    outside = ~_in_chart(view.values, axes, limits)
    for policy in (view.front[row] for row in np.flatnonzero(outside)):
        beyond = [int(np.sign(policy.values[axis] - np.clip(policy.values[axis], *limits[:, axis]))) for axis in axes]
        told = [
            minus(f"{view.objectives[axis].label} {number(float(view.objectives[axis].read.of(policy.values[axis])))}")
            for axis, side in zip(axes, beyond, strict=True)
            if side
        ]
        position = {-1: "right", 1: "left"}.get(beyond[0]) or {-1: "top", 1: "bottom"}[beyond[1]]
        data.append(
            {
                "value": _clipped(policy, axes, limits, _note(view, policy, "far out")),
                "symbolRotate": round(float(np.degrees(np.arctan2(-beyond[0], beyond[1])))),
                "label": {"formatter": ", ".join(told), "position": position},
            }
        )
    return _scatter(
        "far out",
        data,
        axes,
        encode=_clipped_encode(view),
        tooltip=tooltip(TOOLTIP_TEXT, view.objectives),
        symbol="arrow",
        symbolSize=13,
        itemStyle={"color": BLUE, "borderColor": "#ffffff"},
        label={"show": True, "fontSize": 10, "color": INK},
        labelLayout={"hideOverlap": True},
        clip=False,
        z=5,
    )


def _note(view: View, policy: Policy, place: str) -> str:
    """Return what stands below the values of a policy: the name that somebody has given it, and where it lies."""
    return ", ".join(filter(None, (view.noted.policy(policy.id).quoted, place)))


def _in_chart(values: np.ndarray, axes: tuple[int, int], limits: np.ndarray) -> np.ndarray:
    """Which of the vectors [N, M] lie within the axes of the chart, [N]."""
    return inside(values[:, list(axes)], limits[:, list(axes)])


def _clipped(policy: Policy, axes: tuple[int, int], limits: np.ndarray, note: str = "") -> list[Any]:
    """Return a point that has its place after the note: its values, or the edge of the chart."""
    place = [float(np.clip(policy.values[axis], *limits[:, axis])) for axis in axes]
    return [policy.id, *plain(policy.values)[0], note, *place]


def _clipped_encode(view: View) -> dict[str, int]:
    """Return where `_clipped` has the place of a point."""
    return {"x": len(view.objectives) + 2, "y": len(view.objectives) + 3}


def _ghosts(view: View, axes: tuple[int, int]) -> dict[str, Any]:
    earlier = view.generations[:-1][-GHOSTS:]
    data = [[0, *values, ""] for generation in earlier for values in plain(generation.front)]
    return _scatter("earlier fronts", data, axes, silent=True, symbolSize=4, itemStyle={"color": PALE}, z=1)


def _journey(view: View, axes: tuple[int, int]) -> dict[str, Any]:
    """Draw the choices so far, each with the generation it was made for."""
    data = [
        {"value": [0, *plain(values)[0], ""], "label": {"formatter": _when(view, generation)}}
        for generation, values in view.choices
    ]
    return {
        **_scatter("choices", data, axes, silent=True, symbolSize=15, z=5),
        "type": "line",
        "symbol": "circle",
        "showAllSymbol": True,
        "itemStyle": {"color": "transparent", "borderColor": INK, "borderWidth": 1.5},
        "lineStyle": {"color": INK, "width": 1, "type": "dotted"},
        "label": {"show": True, "position": "left", "distance": 12, "fontSize": 10, "color": INK},
        "labelLayout": {"hideOverlap": True},
    }


def _when(view: View, generation: int) -> str:
    """Say when a choice was made: before which generation, or after the last one."""
    return "end" if view.result and view.generations and generation > view.generations[-1].number else str(generation)


def _result(view: View, axes: tuple[int, int]) -> dict[str, Any]:
    data = [[view.result.id, *plain(view.result.values)[0], "the result"]] if view.result else []
    style = {"symbol": STAR, "symbolSize": 32, "itemStyle": {"color": ORANGE, "borderColor": INK, "borderWidth": 1}}
    return _scatter("result", data, axes, silent=True, z=6, **style)


def _area(
    name: str, bounds: np.ndarray, axes: tuple[int, int], limits: np.ndarray, style: dict[str, Any]
) -> dict[str, Any]:
    """Draw the area at least as good as the bounds, as far as the chart reaches; nothing without bounds."""
    corners: list[dict[str, Any]] = []
    low, high = limits[:, list(axes)].tolist()
    if np.isfinite(bounds[list(axes)]).any():
        x, y = np.clip(bounds[list(axes)], low, high).tolist()
        corners = [{"coord": [x, y]}, {"coord": high}]
    area = {"silent": True, "itemStyle": style, "data": [corners] if corners else []}
    return {"type": "scatter", "id": name, "name": name, "data": [], "silent": True, "markArea": area}


def _ruled_out(selection: Selection, axes: tuple[int, int], limits: np.ndarray) -> dict[str, Any]:
    """Draw the area that does not reach what somebody wants to be reached."""
    x, y = axes
    (left, bottom), (right, top) = limits[:, list(axes)].tolist()
    least = selection.limits or (-np.inf,) * limits.shape[1]
    areas = []
    if least[x] > left:
        areas.append([{"coord": [left, bottom]}, {"coord": [min(least[x], right), top]}])
    if least[y] > bottom:
        areas.append([{"coord": [left, bottom]}, {"coord": [right, min(least[y], top)]}])
    area = {"silent": True, "itemStyle": RULED_OUT, "data": areas}
    return {"type": "scatter", "id": "limits", "name": "limits", "data": [], "silent": True, "markArea": area}


def _expected(prospect: Prospect | None, axes: tuple[int, int]) -> dict[str, Any]:
    expected = prospect.expected if prospect else np.zeros((0, 0))
    data = [[0, *values, ""] for values in plain(expected)] if len(expected) else []
    style = {"symbol": "path://M4 0h2v4h4v2h-4v4h-2v-4h-4v-2h4z", "symbolSize": 8, "itemStyle": {"color": GREEN}}
    return _scatter("expected by the model", data, axes, silent=True, z=2, **style)


def _wanted(view: View, selection: Selection, axes: tuple[int, int], limits: np.ndarray) -> dict[str, Any]:
    """Draw rings around the policies that are better in the objective asked for."""
    more = set(wanted(view, selection) or ())
    data = [_clipped(policy, axes, limits) for policy in view.front if policy.id in more]
    style = {"color": "transparent", "borderColor": ORANGE, "borderWidth": 2.5}
    look = {"silent": True, "symbolSize": 14, "itemStyle": style, "clip": False, "z": 6}
    return _scatter("more of an objective", data, axes, encode=_clipped_encode(view), **look)


def _laid_out(view: View, selection: Selection, axes: tuple[int, int], limits: np.ndarray) -> dict[str, Any]:
    data = []
    for policy_id, letter in selection.letters.items():
        policy = view.policy(policy_id)
        if policy:
            focused = policy_id == selection.focus
            data.append(
                {
                    "value": _clipped(policy, axes, limits),
                    "label": {"formatter": letter},
                    "symbolSize": 22 if focused else 17,
                    "itemStyle": {
                        "color": LETTER_COLOURS[letter],
                        "borderColor": INK if focused else "#ffffff",
                        "opacity": 1,
                    },
                }
            )
    label = {"show": True, "position": "inside", "color": "#ffffff", "fontWeight": "bold", "fontSize": 11}
    look = {"silent": True, "label": label, "clip": False, "z": 7, "itemStyle": {"borderWidth": 1.5}}
    return _scatter("laid out", data, axes, encode=_clipped_encode(view), **look)


def _points(asked: PointQuestion | None, axes: tuple[int, int]) -> dict[str, Any]:
    """Draw the points of E-NAUTILUS, and the point where the person stands."""
    data: list[dict[str, Any]] = []
    if asked:
        label = {"formatter": "you", "position": "right"}
        here = {"value": [0, *plain(asked.state.point)[0], ""], "symbol": "triangle", "label": label}
        points = [
            {"value": [0, *plain(point.value)[0], ""], "label": {"formatter": str(number)}}
            for number, point in enumerate(asked.points, start=1)
        ]
        data = [here, *points]
    text = {"show": True, "position": "inside", "fontSize": 10, "fontWeight": "bold", "color": INK}
    style = {"symbol": "diamond", "symbolSize": 24, "itemStyle": {"color": ORANGE, "borderColor": INK}}
    return _scatter("points of E-NAUTILUS", data, axes, silent=True, label=text, z=8, **style)

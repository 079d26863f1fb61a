"""The progress of the search as curves over the generations."""

from typing import Any

from jmorl.studio.charts.chart_style import BLUE, GREY, ORANGE, TEXT, base
from jmorl.studio.view import View


def curve_options(view: View) -> dict[str, Any]:
    """Draw the hypervolume over the generations, and the best utility where the user has one."""
    has_utility = any(generation.utility is not None for generation in view.generations)
    names = ["hypervolume", "best utility"] if has_utility else ["hypervolume"]
    return {
        **base(),
        "tooltip": {"renderMode": "richText", "trigger": "axis", "confine": True},
        "grid": {"left": 66, "right": 66 if has_utility else 24, "top": 34, "bottom": 40},
        "legend": {"data": names, "top": 4, "textStyle": TEXT},
        "xAxis": {
            "type": "category",
            "data": [str(generation.number) for generation in view.generations],
            "name": "round (0: warm-up)",
            "nameLocation": "middle",
            "nameGap": 24,
            "nameTextStyle": TEXT,
            "axisLabel": TEXT,
        },
        "yAxis": [_axis(BLUE, shown=True), _axis(ORANGE, shown=has_utility)],
        "series": [
            _curve("hypervolume", [generation.hypervolume for generation in view.generations], BLUE, 0, "circle"),
            _curve("best utility", [generation.utility for generation in view.generations], ORANGE, 1, "triangle"),
        ],
    }


def _axis(colour: str, shown: bool) -> dict[str, Any]:
    return {
        "type": "value",
        "scale": True,
        "show": shown,
        "axisLabel": TEXT,
        "axisLine": {"show": True, "lineStyle": {"color": colour}},
        "splitLine": {"lineStyle": {"color": "#ececec" if colour == BLUE else "transparent"}},
        "nameTextStyle": {"color": GREY},
    }


def _curve(name: str, data: list[Any], colour: str, axis: int, symbol: str) -> dict[str, Any]:
    return {
        "type": "line",
        "id": name,
        "name": name,
        "data": data,
        "yAxisIndex": axis,
        "symbol": symbol,
        "symbolSize": 7,
        "itemStyle": {"color": colour},
        "lineStyle": {"color": colour},
    }

"""Charts of Apache ECharts on the page: drawing options, marking what is looked at, and reading clicks."""

import json
from collections.abc import Sequence
from typing import Any

from nicegui import ui
from nicegui.events import EChartPointClickEventArguments

# A chart that the browser has not made yet has its marks from the first update.
SET_SERIES = "getElement(%d)?.chart?.setOption({series: %s})"


def draw(chart: ui.echart, options: dict[str, Any]) -> None:
    """Give a chart its options, unless it has them: painting takes a processor that may be training."""
    if chart.options == options:
        return
    chart.options.clear()
    chart.options.update(options)
    chart.update()


def mark(chart: ui.echart, marks: Sequence[dict[str, Any]]) -> None:
    """Replace those series of a chart that have the ids of `marks`, and send only them: the others are many points."""
    kept = [each for each in chart.options["series"] if each["id"] not in {new["id"] for new in marks}]
    series = [*kept, *marks]
    if series == chart.options["series"]:
        return
    chart.options["series"] = series  # which is what the next update sends
    ui.run_javascript(SET_SERIES % (chart.id, json.dumps(marks)))


def clicked(event: EChartPointClickEventArguments) -> Any:
    """Return the numbers that the clicked point or line was drawn from."""
    return event.data

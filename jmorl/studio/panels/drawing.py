"""Charts of Apache ECharts on the page: drawing options, and reading clicks."""

from typing import Any

from nicegui import ui
from nicegui.events import EChartPointClickEventArguments


def draw(chart: ui.echart, options: dict[str, Any]) -> None:
    """Give a chart its options, unless it has them: painting takes a processor that may be training."""
    if chart.options == options:
        return
    chart.options.clear()
    chart.options.update(options)
    chart.update()


def clicked(event: EChartPointClickEventArguments) -> Any:
    """Return the numbers that the clicked point or line was drawn from."""
    return event.data

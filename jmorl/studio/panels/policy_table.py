"""The table of policies on the page."""

from typing import Any

from nicegui.element import Element

from jmorl.display.readings import direction, reading_label
from jmorl.search.bounds import within
from jmorl.studio import texts
from jmorl.studio.charts.chart_style import plain
from jmorl.studio.panels.panel import Shown
from jmorl.studio.selection import listed
from jmorl.studio.tab import Tab


class Grid(Element, component="policy_table.js"):
    """The rows and columns, in the browser."""


class PolicyTable:
    """The front as rows: id, values with their standard deviations, generation."""

    def __init__(self, tab: Tab):
        self.tab = tab
        self.drawn, self.marked = Shown(), Shown()
        self.by: int | None = None  # the objective asked for when the marks were last sent
        self.grid = Grid().classes("table")
        self.grid.props["columns"] = self._columns()
        self.grid.props["rows"] = []
        self.grid.on("look", lambda event: tab.look_at(int(event.args)))

    def show(self) -> None:
        """Send all rows after a new view; send the marks, which are few, whenever the selection changes."""
        view, selection = self.tab.view, self.tab.selection
        if self.drawn.is_new(view):
            self._send_rows()
        if self.marked.is_new(view, selection):
            self._send_marks()

    def _send_rows(self) -> None:
        self.grid.props["columns"] = self._columns()
        self.grid.props["rows"] = self._rows()
        self.grid.update()

    def _send_marks(self) -> None:
        """Send which policies are laid out, and which are listed: within the limits, better in what is asked for."""
        view, selection = self.tab.view, self.tab.selection
        by = None if selection.more_of is None or selection.more_of == self.by else selection.more_of + 1
        self.by = selection.more_of
        self.grid.run_method("lay_out", selection.letters, selection.focus, listed(view, selection), by)

    def _columns(self) -> list[dict[str, Any]]:
        view = self.tab.view
        count = len(view.objectives)
        values = [
            {
                "label": objective.label,
                "hint": f"{reading_label(objective)}, {direction(objective)}: mean and standard deviation over the "
                "evaluation episodes",
                "scale": objective.read.scale,
                "decimals": 2 if places is None else places,
                "std": index + count + 3,
            }
            for index, (objective, places) in enumerate(zip(view.objectives, texts.decimals(view), strict=True))
        ]
        return [
            {"label": "policy", "hint": "number of the policy"},
            *values,
            {"label": "round", "hint": "in which it was trained; 0 is the warm-up"},
        ]

    def _rows(self) -> list[list[Any]]:
        view = self.tab.view
        inside = within(view.values, view.bounds)
        return [
            [policy.id, not kept, *values, policy.generation, *plain(policy.std)[0]]
            for policy, kept, values in zip(view.front, inside.tolist(), plain(view.values), strict=True)
        ]

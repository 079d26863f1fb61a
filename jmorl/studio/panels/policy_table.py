"""The table of policies on the page."""

from typing import Any

from nicegui import ui
from nicegui.element import Element

from jmorl.display.readings import direction, reading_label
from jmorl.search.bounds import within
from jmorl.studio import texts
from jmorl.studio.charts.chart_style import plain
from jmorl.studio.panels.panel import Shown
from jmorl.studio.selection import listed
from jmorl.studio.tab import Tab

REMARKS = {"label": "notes", "hint": "name, and what else there is to know", "words": True}  # a column


class Grid(Element, component="policy_table.js"):
    """The rows and columns, in the browser."""


class PolicyTable:
    """The front as rows: id, values with their standard deviations, generation, remarks; or the favourites only."""

    def __init__(self, tab: Tab):
        self.tab = tab
        self.drawn, self.marked = Shown(), Shown()
        self.by: int | None = None  # the objective asked for when the marks were last sent
        with ui.element("div").classes("favourites") as self.filter:
            self.only = ui.button(on_click=lambda: tab.list_favourites(not tab.selection.favourites)).props(
                "no-caps dense"
            )
        self.grid = Grid().classes("table")
        self.grid.props["columns"] = self._columns()
        self.grid.props["rows"] = self.grid.props["favourites"] = []
        self.grid.on("look", lambda event: tab.look_at(int(event.args)))

    def show(self) -> None:
        """Send all rows after a new view; send the marks, which are few, whenever the selection changes."""
        view, selection = self.tab.view, self.tab.selection
        if self.drawn.is_new(view):
            self._send_rows()
        if self.marked.is_new(view, selection):
            self._send_marks()
            self._show_filter()

    def _show_filter(self) -> None:
        """Offer the favourites where there are some."""
        only = self.tab.selection.favourites
        self.filter.set_visibility(only or bool(self.tab.view.favourites))
        self.only.set_text(f"★ Favourites ({len(self.tab.view.favourites)})")
        self.only.props(f"aria-pressed={str(only).lower()}", remove="outline unelevated")
        self.only.props("unelevated" if only else "outline")

    def _send_rows(self) -> None:
        self.grid.props["columns"] = self._columns()
        self.grid.props["rows"] = self._rows()
        self.grid.props["favourites"] = self.tab.view.noted.favourites
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
                "std": index + count + 4,
            }
            for index, (objective, places) in enumerate(zip(view.objectives, texts.decimals(view), strict=True))
        ]
        return [
            {"label": "policy", "hint": "number of the policy"},
            *values,
            {"label": "round", "hint": "in which it was trained; 0 is the warm-up"},
            *([REMARKS] if any(texts.remarks(view, policy) for policy in view.front + view.favourites) else []),
        ]

    def _rows(self) -> list[list[Any]]:
        """Return the rows of the front, and those of favourites that are no longer in it."""
        view = self.tab.view
        inside = within(view.values, view.bounds).tolist()
        places = {policy.id: "" if kept else "outside" for policy, kept in zip(view.front, inside, strict=True)}
        replaced = tuple(policy for policy in view.favourites if policy.id not in places)
        return [
            [
                policy.id,
                places.get(policy.id, "replaced"),
                *plain(policy.values)[0],
                policy.generation,
                texts.remarks(view, policy),
                *plain(policy.std)[0],
            ]
            for policy in view.front + replaced
        ]

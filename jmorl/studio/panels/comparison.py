"""The dialog that shows the fronts of several branches in one chart."""

from nicegui import background_tasks, ui

from jmorl.studio import words
from jmorl.studio.charts.comparison_chart import comparison_options
from jmorl.studio.comparison import BranchFront
from jmorl.studio.panels.drawing import draw
from jmorl.studio.panels.panel import Shown
from jmorl.studio.tab import Tab


class ComparisonDialog:
    """The chart, and which branches it shows. It follows the run while it is open."""

    def __init__(self, tab: Tab):
        self.tab = tab
        self.seen, self.read, self.offered = Shown(), Shown(), Shown()
        dialog = ui.dialog().props(f'aria-label="{words.COMPARED}"')
        with dialog.bind_value_to(tab, "covered") as self.dialog, ui.card().classes("comparison"):
            with ui.element("div").classes("comparison-head"):
                ui.label(words.COMPARED).classes("title")
                ui.button(words.CLOSE, on_click=tab.stop_comparing).props("flat no-caps")
            self.branches = ui.element("div").classes("comparison-branches")
            self.chart = ui.echart({})
            ui.label(words.COMPARE_HINT).classes("explanation")
            self.problems = ui.label().classes("explanation")
        self.dialog.on_value_change(self._closed)

    def show(self) -> None:
        """Draw the fronts of those branches that are to be shown; have all read anew after a new view."""
        tab, comparison = self.tab, self.tab.comparison
        if not self.seen.is_new(tab.view, comparison, tab.left_out, tab.axes):
            return
        self.dialog.set_value(comparison is not None)
        if comparison is None:
            return
        if self.read.is_new(tab.view):
            background_tasks.create(tab.compare_anew())
        runs = {each.branch.run for each in comparison.fronts}
        draw(self.chart, comparison_options(tab.view, tab.axes, comparison, runs - tab.left_out))
        self.problems.set_text(" ".join(comparison.problems))
        self.problems.set_visibility(bool(comparison.problems))
        if self.offered.is_new(" ".join(each.branch.run + each.branch.title for each in comparison.fronts)):
            self._offer(comparison.fronts)

    def _offer(self, fronts: tuple[BranchFront, ...]) -> None:
        """Offer the branches, where others are there than before: somebody may be about to press one."""
        self.branches.clear()
        with self.branches:
            for run, title in ((each.branch.run, each.branch.title) for each in fronts):
                box = ui.checkbox(title, value=run not in self.tab.left_out)
                box.on_value_change(lambda event, run=run: self.tab.compare_with(run, event.value)).props("dense")

    def _closed(self) -> None:
        if not self.dialog.value and self.tab.comparison:
            self.tab.stop_comparing()

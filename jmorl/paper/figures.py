"""The paper's figures redrawn, for print: readable in grey, vector and PNG.

Methods differ by colour, line and mark; users by their panel.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, MaxNLocator

from envs import make
from jmorl.display.text import objective_label
from jmorl.experiments.targets import TargetRow
from jmorl.paper.analysis import Finals
from jmorl.paper.by_default import BY_DEFAULT, StudyRuns, default_curves, default_targets
from jmorl.paper.plan import NAMES, SHORTER, Item, Plan
from jmorl.paper.results import Curves, Records, curves, final_policies, target_rows
from jmorl.report.style import BLUE, GREEN, GREY, INK, ORANGE, PALE, RED, legend_below, new_figure, style
from jmorl.search.scaling import core
from jmorl.storage.files import written_whole
from jmorl.units import measured_in

LOOKS: dict[str, tuple[Any, ...]] = {  # colour, line, mark and name
    "interactive": (BLUE, "-", "o", "interactive"),
    "pgmorl": (ORANGE, "--", "s", "PGMORL"),
    SHORTER: (GREEN, ":", "D", "PGMORL, warm-up 40"),
    BY_DEFAULT: (RED, "-.", "^", "interactive, by default"),
}
FORMATS = ("png", "svg")
DOTS_PER_INCH = 300  # for print
WIDTH = 10.5  # inches, three panels
STACK = 0.2  # of the distance of two lines


def draw(
    folder: Path, plan: Plan, item: Item, units: Sequence[str], records: Records, study: StudyRuns
) -> dict[str, Path]:
    """Draw an item in each kind of units it has runs in, as PNG and SVG. Returns the PNG of each."""
    drawn = {}
    with style():
        for each in units:
            figure = _figure(plan, item, each, records, study if each == "raw" else StudyRuns())
            if figure is not None:
                drawn[each] = _save(figure, folder / f"{item.name}-{each}")
    return drawn


def _save(figure: Figure, path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    for form in FORMATS:
        with written_whole(path.with_suffix(f".{form}")) as temporary:
            metadata = {"Date": None} if form == "svg" else None
            figure.savefig(temporary, format=form, dpi=DOTS_PER_INCH, metadata=metadata)
    return path.with_suffix(".png")


def _figure(plan: Plan, item: Item, units: str, records: Records, study: StudyRuns) -> Figure | None:
    title = f"{NAMES[item.env]}, {units} units"
    if item.kind == "steps to targets":
        rows = _beside(target_rows(plan, item, units, records), default_targets(plan, item, study))
        return targets_figure(rows, f"Steps until a target is reached: {title}") if rows else None
    if item.kind == "final policies":
        found = final_policies(plan, item, units, records)
        normalised = ", normalised utilities" if item.normalised else ""
        return finals_figure(found, item, units, f"Final policies: {title}{normalised}") if found else None
    rows_of = [*curves(plan, item, units, records), *default_curves(plan, item, study)]
    what = (
        "Greatest utility of the archive"
        if item.kind == "greatest utility"
        else "Mean utility of the policies just trained"
    )
    return curves_figure(rows_of, item, units, f"{what}: {title}") if rows_of else None


def _beside(rows: Sequence[TargetRow], ours: Sequence[TargetRow]) -> list[TargetRow]:
    """Return all rows, those of each target together."""
    return [
        row for target in dict.fromkeys(row.target for row in rows) for row in (*rows, *ours) if row.target == target
    ]


def curves_figure(rows: Sequence[Curves], item: Item, units: str, title: str) -> Figure:
    """Draw a panel for each user: mean over seeds, and the range of the seeds shaded."""
    users = list(dict.fromkeys(row.user for row in rows))
    figure = new_figure(WIDTH, 3.9, title)
    grid = list(figure.subplots(1, len(users), squeeze=False)[0])
    for axes, user in zip(grid, users, strict=True):
        for row in rows:
            if row.user == user:
                _draw_curve(axes, row)
        axes.set_title(_panel(user, item))
        axes.set_xlabel("environment steps")
        axes.xaxis.set_major_formatter(FuncFormatter(lambda steps, _: f"{steps / 1e6:g} M" if steps else "0"))
        axes.xaxis.set_major_locator(MaxNLocator(5))
        axes.set_xlim(left=0)
        _focus(axes, [row.utility for row in rows if row.user == user])
    grid[0].set_ylabel(f"utility ({'weighted raw returns' if units == 'raw' else 'weighted running deviations'})")
    seeds = max(len(row.seeds) for row in rows)
    methods = dict.fromkeys(row.method for row in rows)
    shades = [Patch(facecolor=PALE, alpha=0.4, label=f"range of {seeds} seeds")] * (seeds > 1)
    legend_below(figure, [*(_key(method) for method in methods), *shades], len(methods) + len(shades))
    return figure


def _draw_curve(axes: Axes, row: Curves) -> None:
    colour, dashes, mark, _ = LOOKS[row.method]
    axes.fill_between(row.steps, row.utility.min(0), row.utility.max(0), color=colour, alpha=0.18, linewidth=0)
    every = max(len(row.steps) // 8, 1)
    axes.plot(row.steps, row.utility.mean(0), dashes, color=colour, marker=mark, markersize=4, markevery=every)


def _focus(axes: Axes, utilities: Sequence[np.ndarray]) -> None:
    """Leave the worst of the first generations out of sight, where they would hide all that follows, and say so."""
    later = np.concatenate([each[:, each.shape[1] // 4 :].ravel() for each in utilities])
    low, high = later.min(), max(each.max() for each in utilities)
    margin = 0.08 * (high - low or abs(high) or 1.0)
    axes.set_ylim(low - 3 * margin, high + margin)
    lowest = min(each.min() for each in utilities)
    if lowest < low - 3 * margin:
        _note(axes, f"not shown: the beginning, down to {lowest:.4g}")


def _note(axes: Axes, text: str, place: Literal["left", "right"] = "right") -> None:
    """Write in a lower corner what a picture cuts off."""
    x = 0.02 if place == "left" else 0.98
    lifted = {"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 1.5}  # off the lines below
    axes.annotate(text, (x, 0.02), xycoords="axes fraction", ha=place, va="bottom", fontsize=8, color=GREY, bbox=lifted)


def targets_figure(rows: Sequence[TargetRow], title: str) -> Figure:
    """Draw a line for each target and method: every seed, their restricted mean and its interval."""
    figure = new_figure(WIDTH * 0.75, 1.5 + 0.42 * len(rows), title)
    axes = figure.subplots()
    places = _places(rows)
    for place, row in zip(places, rows, strict=True):
        colour, dashes, mark, _ = LOOKS.get(row.method, (INK, "-", "D", row.method))
        mean = row.times.restricted_mean
        axes.plot([mean.low, mean.high], [place, place], dashes, color=colour, linewidth=2.4, solid_capstyle="butt")
        axes.plot([mean.mean] * 2, [place - 0.24, place + 0.24], color=colour, linewidth=2.4)
        heights = stacked(row.times.restricted)
        for steps, x, height in zip(row.times.reached, row.times.restricted, heights, strict=True):
            face, edge = ("white", colour) if steps is None else (colour, "white")
            axes.plot(x, place + height, mark, markersize=6, markerfacecolor=face, markeredgecolor=edge, zorder=3)
    axes.set_yticks(places, [f"{row.target}, {LOOKS.get(row.method, ('', '', '', row.method))[3]}" for row in rows])
    axes.set_ylim(max(places) + 0.6, min(places) - 0.6)
    axes.grid(axis="y", visible=False)
    axes.set_xlim(0, 1.05 * max(row.times.budget for row in rows))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda steps, _: f"{steps / 1e6:g} M" if steps else "0"))
    axes.set_xlabel("environment steps")
    handles = [
        Line2D([], [], color=INK, marker="o", linestyle="", label="a seed"),
        Line2D([], [], color=INK, marker="o", markerfacecolor="white", linestyle="", label="not reached"),
        Line2D([], [], color=INK, linewidth=2.4, label="95 % interval of the restricted mean"),
    ]
    legend_below(figure, handles, 3)
    return figure


def stacked(values: Sequence[float]) -> list[float]:  # [S]
    """Return how far from its line each value is drawn, so that equal ones do not hide each other."""
    total, seen = Counter(values), Counter[float]()
    heights = []
    for value in values:
        heights.append(STACK * (seen[value] - (total[value] - 1) / 2))
        seen[value] += 1
    return heights


def _places(rows: Sequence[TargetRow]) -> list[float]:
    """Return the height at which each row is drawn: targets apart from each other."""
    order = list(dict.fromkeys(row.target for row in rows))
    return [index + 0.5 * order.index(row.target) for index, row in enumerate(rows)]


def finals_figure(found: Mapping[str, Finals], item: Item, units: str, title: str) -> Figure:
    """Draw a panel for each user: where the interactive runs and E-NAUTILUS ended, and the front it started from."""
    figure = new_figure(WIDTH, 4.3, title)
    grid = list(figure.subplots(1, len(found), squeeze=False, sharex=True, sharey=True)[0])
    x, y = measured_in(units, make(item.env).objectives)
    for axes, (user, finals) in zip(grid, found.items(), strict=True):
        near = core(finals.pooled)
        axes.scatter(*finals.pooled[near].T, s=14, color=PALE, zorder=1)
        if not near.all():
            _note(axes, f"not shown: far policies of the pooled front, {int((~near).sum())}", "left")
        for values, kept in zip(finals.interactive, finals.kept, strict=True):
            axes.scatter(*values, s=62, marker="^", **_face(BLUE, bool(kept)), zorder=3)
        axes.scatter(*finals.enautilus, s=110, marker="s", **_face(ORANGE, finals.enautilus_kept), zorder=2)
        axes.set_title(_panel(user, item))
        axes.set_xlabel(objective_label(x))
        axes.xaxis.set_major_locator(MaxNLocator(5))
    grid[0].set_ylabel(objective_label(y))
    handles = [
        Line2D([], [], color=BLUE, marker="^", markersize=8, linestyle="", label="interactive, one a seed"),
        Line2D([], [], color=ORANGE, marker="s", markersize=7, linestyle="", label="PGMORL + E-NAUTILUS"),
        Line2D([], [], color=INK, marker="^", markersize=8, markerfacecolor="white", linestyle="", label="dominated"),
        Line2D([], [], color=PALE, marker="o", markersize=4, linestyle="", label="PGMORL's pooled front"),
    ]
    legend_below(figure, handles, 4)
    return figure


def _face(colour: str, kept: bool) -> dict[str, str]:
    return {"facecolor": colour if kept else "white", "edgecolor": colour}


def _key(method: str) -> Line2D:
    colour, dashes, mark, label = LOOKS[method]
    return Line2D([], [], color=colour, linestyle=dashes, marker=mark, markersize=5, label=label)


def _panel(user: str, item: Item) -> str:
    """Return the heading of a user's panel: the name, and what this user of the paper wants."""
    first, second = (objective.label for objective in make(item.env).objectives)
    return {"A": "A: balanced", "B": f"B: focus on {first}", "C": f"C: focus on {second}"}[user]

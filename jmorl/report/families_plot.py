"""The continuum of a front that was blended: families, what lies between their members, gaps, and blends."""

from itertools import combinations, cycle
from math import ceil
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from jmorl.display.limits import around
from jmorl.report.style import BLUE, GREEN, GREY, INK, ORANGE, RED, label_axes, legend_below, new_figure
from jmorl.search.policy import Policy, values_of
from jmorl.search.scaling import core
from jmorl.storage.families_file import Families
from jmorl.storage.stored_run import StoredRun

COLOURS = BLUE, ORANGE, GREEN, RED, "#CC79A7", "#56B4E9"  # Okabe and Ito's
COLUMNS = 3  # of pairs of objectives, at most


def families_figure(run: StoredRun, title: str) -> Figure | None:
    """Each pair of objectives: the front that was blended last, and what came of it; None if it never was.

    A line between two policies goes by way of the blend half-way between them. It is solid within a family and dotted
    where the blend loses.
    """
    if run.families is None:
        return None
    pairs = list(combinations(range(len(run.objectives)), 2))
    columns = min(len(pairs), COLUMNS)
    rows = ceil(len(pairs) / columns)
    figure = new_figure(max(5.0 * columns, 8.0), 4.6 * rows + 1.0, title)
    grid = list(figure.subplots(rows, columns, squeeze=False).flat)
    colours = _colours(run.families)
    for axes, pair in zip(grid, pairs, strict=False):
        _draw(axes, run, run.families, list(pair), colours)
    for axes in grid[len(pairs) :]:
        axes.set_visible(False)
    legend_below(figure, _legend(run.families, bool(_blends(run, run.families))), columns=4)
    return figure


def _colours(families: Families) -> dict[int, str]:
    """Return a colour for each policy of the front: a family's own, grey for those that are alone."""
    many = cycle(COLOURS)
    colours = [next(many) if len(family) > 1 else GREY for family in families.families]
    return {policy: colour for family, colour in zip(families.families, colours, strict=True) for policy in family}


def _blends(run: StoredRun, families: Families) -> list[Policy]:
    """Return those that joined the front when it was blended last."""
    return [policy for policy in run.policies if policy.blend and policy.generation == families.generation]


def _draw(axes: Axes, run: StoredRun, families: Families, pair: list[int], colours: dict[int, str]) -> None:
    for link in families.links:
        first, second = (run.policies[end].values[pair] for end in link.ends)
        line = np.stack([first, link.values[pair], second])
        if link.holds:
            axes.plot(*line.T, color=colours[link.ends[0]], linewidth=1.2, zorder=2)
        else:
            axes.plot(*line[[0, 2]].T, color=GREY, linewidth=1.0, linestyle=":", zorder=1)
    blends = _blends(run, families)
    if blends:
        x, y = values_of(blends)[:, pair].T
        axes.scatter(x, y, s=22, facecolors="white", edgecolors=INK, linewidths=0.9, zorder=3)
    front = [run.policies[policy] for policy in colours]
    values = values_of(front)
    x, y = values[:, pair].T
    axes.scatter(x, y, s=30, c=list(colours.values()), edgecolors="white", linewidths=0.6, zorder=4)
    shown = np.concatenate([values[core(values)], *([values_of(blends)] if blends else [])])[:, pair]
    low, high = around(shown)
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    label_axes(axes, *(run.objectives[index] for index in pair))


def _legend(families: Families, blends: bool) -> list[Artist]:
    """Return an entry for each kind of thing that there is."""
    count = sum(len(family) > 1 for family in families.families)
    dot = {"marker": "o", "markeredgecolor": "white"}
    entries: list[tuple[bool, str, dict[str, Any]]] = [
        (count > 0, f"a family (there are {count})", {**dot, "color": BLUE}),
        (count < len(families.families), "a policy without a family", {**dot, "color": GREY, "linestyle": ""}),
        (blends, "a blend that joined", {"marker": "o", "color": INK, "markerfacecolor": "white", "linestyle": ""}),
        (not all(link.holds for link in families.links), "the blend half-way loses", {"color": GREY, "linestyle": ":"}),
    ]
    return [Line2D([], [], label=label, **look) for present, label, look in entries if present]

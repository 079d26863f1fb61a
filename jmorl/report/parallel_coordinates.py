"""The front of more than two objectives: as parallel coordinates, and pair by pair."""

from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from envs.core import Objective
from jmorl.display.readings import reading_label
from jmorl.report.front_plot import close_view, draw_policies, front_name, legend_of, note_outside
from jmorl.report.style import (
    BLUE,
    INK,
    RED,
    ReadingFormatter,
    generation_bar,
    generation_colour,
    legend_below,
    new_figure,
)
from jmorl.search.policy import values_of
from jmorl.storage.stored_run import StoredRun

BOUNDS_BAR: dict[str, Any] = {"color": BLUE, "alpha": 0.25, "linewidth": 9}
WHITE: dict[str, Any] = {"boxstyle": "round,pad=0.1", "facecolor": "white", "edgecolor": "none", "alpha": 0.75}


def parallel_figure(run: StoredRun, title: str) -> Figure:
    """Each member of the front as a line across the objectives, each on an axis of its own, the best at the top."""
    count = len(run.objectives)
    limits = close_view(run)
    figure = new_figure(max(2.6 * count, 7.0) + 1.0, 5.6, title)
    axes = figure.subplots()
    for index in range(count):
        _draw_scale(axes, index, run.objectives[index], limits[:, index])
    handles = _draw_lines(axes, run, limits)
    axes.set_xticks(range(count), [reading_label(objective) for objective in run.objectives])
    axes.set_xlim(-0.35, count - 0.85)
    axes.set_ylim(0, 1)
    axes.tick_params(axis="x", length=0)
    axes.yaxis.set_visible(False)
    axes.grid(False)
    axes.spines[:].set_visible(False)
    note_outside(axes, values_of(run.front), limits)
    generation_bar(figure, [axes], len(run.bounds) - 1)
    legend_below(figure, handles, columns=3)
    return figure


def pairs_figure(run: StoredRun, title: str) -> Figure:
    """Every pair of objectives: all policies, the front, the choices, the last bounds and the chosen policy."""
    last = len(run.objectives) - 1
    limits = close_view(run)
    figure = new_figure(3.4 * last + 1.4, 3.1 * last + 1.2, title)
    grid = figure.subplots(last, last, sharex="col", sharey="row", squeeze=False)
    for row in range(last):
        for column in range(last):
            axes, pair = grid[row, column], [column, row + 1]
            if column > row:
                axes.set_visible(False)
            else:
                draw_policies(axes, run, pair, limits[:, pair])
                axes.label_outer()
    generation_bar(figure, list(grid.flat), len(run.bounds) - 1)
    legend_below(figure, legend_of(run, "choice", without=("earlier", "bounds")), columns=3)
    return figure


def _draw_lines(axes: Axes, run: StoredRun, limits: np.ndarray) -> list[Artist]:
    """Front, chosen policy and last bounds on axes whose limits are [2, M]; what there is to say about them."""
    last = len(run.bounds) - 1
    for policy, heights in zip(run.front, _heights(values_of(run.front), limits), strict=True):
        axes.plot(heights, color=generation_colour(policy.generation, last), linewidth=1.3, alpha=0.85, zorder=3)
    handles: list[Artist] = [
        Line2D([], [], color=generation_colour(last, last), linewidth=1.3, label=front_name(run)),
    ]
    if np.isfinite(run.bounds[-1]).all():
        bounds = _heights(run.bounds[-1], limits)
        axes.vlines(range(len(bounds)), bounds, 1.0, zorder=1, **BOUNDS_BAR)
        handles.append(Line2D([], [], label="within the last bounds", **BOUNDS_BAR))
    if run.chosen:
        label = f"chosen: policy {run.chosen.id}"
        handles += axes.plot(_heights(run.chosen.values, limits), color=RED, linewidth=3.0, zorder=4, label=label)
    return handles


def _heights(values: np.ndarray, limits: np.ndarray) -> np.ndarray:
    """Where on its axis, from 0 to 1, each of the values [..., M] is."""
    return (values - limits[0]) / np.ptp(limits, axis=0)


def _draw_scale(axes: Axes, index: int, objective: Objective, limits: np.ndarray) -> None:
    """Draw the axis of an objective between the limits [2], with its ticks as people say them."""
    axes.axvline(index, color=INK, linewidth=0.9, zorder=2)
    low, high = limits
    ticks = MaxNLocator(6).tick_values(low, high)
    ticks = ticks[(ticks >= low) & (ticks <= high)]
    for tick, text in zip(ticks, ReadingFormatter(objective).format_ticks(ticks), strict=True):
        height = (tick - low) / (high - low)
        axes.plot([index - 0.02, index], [height, height], color=INK, linewidth=0.9, zorder=2)
        axes.text(index - 0.035, height, text, ha="right", va="center", fontsize=8.5, bbox=WHITE, zorder=5)

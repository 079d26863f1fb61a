"""How a run went: its metrics over the environment steps, and how good its predictions were."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator

from envs.core import Objective
from jmorl.decision.records import DecisionRecord
from jmorl.display.limits import around, inside
from jmorl.display.text import objective_label, plural, short_count
from jmorl.report.style import (
    BLUE,
    GREEN,
    INK,
    ORANGE,
    PALE,
    RED,
    Colour,
    generation_bar,
    generation_colour,
    new_figure,
    note,
)
from jmorl.search.prediction import COVERAGE
from jmorl.search.scaling import core
from jmorl.storage.stored_run import StoredRun

BESIDE: dict[str, Any] = {"loc": "center left", "bbox_to_anchor": (1.01, 0.5)}


def progress_figure(run: StoredRun, title: str) -> Figure:
    """Draw utility if the user has one, hypervolume, and sizes, each over the steps used for learning."""
    has_utility = not np.isnan(run.metrics["utility_max"]).all()
    drawings = [_draw_utility] * has_utility + [_draw_hypervolume, _draw_sizes]
    heights = [1.4] * has_utility + [1.4, 0.9]
    figure = new_figure(9.0, 0.9 + 1.9 * sum(heights), title)
    grid = figure.subplots(len(drawings), 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0]
    for axes, draw in zip(grid, drawings, strict=True):
        draw(axes, run)
        for steps in _choice_steps(run):
            axes.axvline(steps, color=PALE, linewidth=0.7, linestyle=":", zorder=0.5)
    figure.align_ylabels(grid)
    grid[-1].set_xlabel(f"environment steps used for learning{'; dotted: a choice' if _choice_steps(run) else ''}")
    grid[-1].xaxis.set_major_formatter(FuncFormatter(lambda steps, _: short_count(max(steps, 0))))
    grid[-1].set_xlim(0, 1.03 * run.metrics["steps"][-1])
    return figure


def prediction_figure(run: StoredRun, title: str) -> Figure | None:
    """Predicted against realised change of every offspring, per objective; None for a run without predictions.

    A line through each goes from end to end of the prediction's interval.
    """
    changes = _changes(run)
    if not changes:
        return None
    generations, predicted, realised, intervals = changes
    last = len(run.bounds) - 1
    colours = [generation_colour(generation, last) for generation in generations]
    figure = new_figure(4.3 * len(run.objectives) + 0.9, 5.3, title)
    grid = list(figure.subplots(1, len(run.objectives), squeeze=False)[0])
    for index, (axes, objective) in enumerate(zip(grid, run.objectives, strict=True)):
        pairs = np.stack([predicted[:, index], realised[:, index]], axis=1)
        _draw_prediction(axes, objective, pairs, intervals[..., index], colours)
    generation_bar(figure, grid, last)
    return figure


def _changes(run: StoredRun) -> tuple[list[int], np.ndarray, np.ndarray, np.ndarray] | None:
    """Return generation, predicted and realised change [N, M] of all offspring, and intervals [N, 2, M].

    NaN where a prediction has no interval; None if there are no predictions.
    """
    generations, predicted, realised, intervals = [], [], [], []
    for policy in run.policies:
        if policy.predicted is not None and policy.parent is not None:
            parent = run.policies[policy.parent]
            generations.append(policy.generation)
            predicted.append(policy.predicted - parent.values)
            realised.append(policy.values - parent.values)
            ends = np.full((2, len(policy.values)), np.nan) if policy.interval is None else policy.interval
            intervals.append(ends - parent.values)
    return (generations, np.stack(predicted), np.stack(realised), np.stack(intervals)) if generations else None


def _draw_utility(axes: Axes, run: StoredRun) -> None:
    steps, metrics = run.metrics["steps"], run.metrics
    _line(axes, steps, metrics["utility_max"], "max of the archive", RED)
    _line(axes, steps, metrics["utility_mean"], "mean of the buffer", BLUE)
    if not np.isnan(metrics["utility_mean_within_bounds"]).all():
        _line(axes, steps, metrics["utility_mean_within_bounds"], "mean of the buffer\nwithin the bounds", BLUE, "--")
    axes.set_ylabel("utility")
    axes.legend(**BESIDE)
    _focus(axes)


def _draw_hypervolume(axes: Axes, run: StoredRun) -> None:
    _line(axes, run.metrics["steps"], run.metrics["hypervolume"], "hypervolume", GREEN)
    axes.set_ylabel("hypervolume")
    _focus(axes)


def _draw_sizes(axes: Axes, run: StoredRun) -> None:
    steps, candidates = run.metrics["steps"], run.metrics["candidates"]
    _line(axes, steps, run.metrics["front_size"], "front", INK)
    _line(axes, steps, np.where(run.metrics["generation"] > 0, candidates, np.nan), "candidates", ORANGE)
    axes.set_ylabel("policies")
    axes.legend(**BESIDE)
    axes.set_ylim(bottom=0)
    axes.yaxis.set_major_locator(MaxNLocator(4, integer=True))


def _line(axes: Axes, steps: np.ndarray, values: np.ndarray, label: str, colour: str, dashes: str = "-") -> None:
    axes.plot(steps, values, dashes, color=colour, marker="o", markersize=3.5, label=label)


def _focus(axes: Axes) -> None:
    """Limits around most of each line, so that a bad start does not hide what comes later."""
    lines = [np.asarray(line.get_ydata(), float) for line in axes.get_lines()]
    points = [line[~np.isnan(line), None] for line in lines]
    low, high = around(np.concatenate([line[core(line)] for line in points])).ravel()
    axes.set_ylim(low, high)
    every = np.concatenate(points)
    outside = {"below": int((every < low).sum()), "above": int((every > high).sum())}
    if any(outside.values()):
        note(axes, ", ".join(f"{plural(count, 'point')} {where}" for where, count in outside.items() if count))


def _choice_steps(run: StoredRun) -> list[float]:
    """Return the environment steps after which the user was asked."""
    return [
        float(run.metrics["steps"][record.generation - 1])
        for record in run.decisions
        if isinstance(record, DecisionRecord) and record.purpose == "steer"
    ]


def _draw_prediction(
    axes: Axes, objective: Objective, pairs: np.ndarray, intervals: np.ndarray, colours: list[Colour]
) -> None:
    """Predicted and realised changes [N, 2] of one objective, intervals [N, 2], and how far off predictions are."""
    low, high = around(np.append(pairs[core(pairs)].ravel(), 0.0)[:, None]).ravel()
    predicted, realised = pairs.T
    axes.plot([low, high], [low, high], color=INK, linewidth=0.9, zorder=1)
    axes.axhline(0, color=PALE, linewidth=0.8, zorder=0.5)
    axes.axvline(0, color=PALE, linewidth=0.8, zorder=0.5)
    known = ~np.isnan(intervals).any(axis=1)
    least, most = intervals[known].T
    lined = [colour for colour, has in zip(colours, known, strict=True) if has]
    axes.hlines(realised[known], least, most, color=lined, linewidth=0.8, alpha=0.35, zorder=1.5)
    axes.scatter(predicted, realised, s=20, c=colours, linewidths=0.4, edgecolors="white", zorder=2)
    axes.set_xlim(low, high)
    axes.set_ylim(low, high)
    axes.set_box_aspect(1)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(6))
    error, change = np.abs(predicted - realised).mean(), np.abs(realised).mean()
    text = f"mean error {error:.3g}; of predicting no change {change:.3g}"
    if known.any():
        held = ((least <= realised[known]) & (realised[known] <= most)).mean()
        text += f"\n{held:.0%} realised within the {COVERAGE:.0%} interval (line)"
    axes.set_title(f"{objective.label}\n{text}", fontsize=9.5)
    axes.set_xlabel(f"predicted change of {objective_label(objective)}")
    axes.set_ylabel("realised change")
    outside = int((~inside(pairs, np.array([[low, low], [high, high]]))).sum())
    if outside:
        beside_label = "\n" * (text.count("\n") + 2)
        note(axes, f"{outside} of {plural(len(pairs), 'prediction')} outside{beside_label}")

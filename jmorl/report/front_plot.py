"""The front of two objectives: how it grew, what was chosen, and what came of it."""

from collections.abc import Container, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from jmorl.decision.records import DecisionRecord
from jmorl.display.limits import around, hopeful, inside
from jmorl.display.text import plural
from jmorl.report.labels import place_labels
from jmorl.report.style import (
    BLUE,
    GREY,
    INK,
    PALE,
    RED,
    generation_bar,
    generation_colour,
    label_axes,
    legend_below,
    new_figure,
    note,
)
from jmorl.search.pareto import non_dominated
from jmorl.search.policy import values_of
from jmorl.search.scaling import core
from jmorl.storage.stored_run import StoredRun

BOUNDS_LINE: dict[str, Any] = {"color": BLUE, "alpha": 0.4, "linewidth": 0.9, "linestyle": (0, (4, 3))}
BOUNDS_AREA: dict[str, Any] = {"facecolor": BLUE, "alpha": 0.07, "edgecolor": "none"}
RING: dict[str, Any] = {"marker": "o", "color": INK, "markerfacecolor": "none", "linestyle": "", "markersize": 7}
RING_OF_STAND_IN: dict[str, Any] = {**RING, "color": GREY, "markersize": 5}
CONFIRMED_LINE: dict[str, Any] = {"color": RED, "linewidth": 1.0}
STAR: dict[str, Any] = {"marker": "*", "color": RED, "markeredgecolor": "white", "linestyle": "", "markersize": 16}
ZOOM = 0.4  # a front that fills less of the whole picture gets one of its own


@dataclass(frozen=True, eq=False)
class Choice:
    """A policy that steered the search."""

    generations: str  # that it was chosen for
    values: np.ndarray  # [M]
    asked: bool  # the decision maker was, at least once; otherwise a stand-in chose it


def front_figure(run: StoredRun, title: str) -> Figure:
    """All policies, the front of each generation, choices and bounds; and the last front close up if it is small."""
    last = len(run.bounds) - 1
    whole, close = whole_view(run), close_view(run)
    views = [whole] if (np.ptp(close, axis=0) >= ZOOM * np.ptp(whole, axis=0)).all() else [whole, close]
    figure = new_figure(6.6 * len(views) + 0.9, 6.0, title)
    grid = list(figure.subplots(1, len(views), squeeze=False)[0])
    for axes, limits in zip(grid, views, strict=True):
        _draw_fronts(axes, run, limits)
        _draw_bounds(axes, run.bounds[1:], limits)
        draw_policies(axes, run, [0, 1], limits)
    if len(views) > 1:
        _frame_close_up(grid[0], grid[1], close)
    generation_bar(figure, grid, last)
    legend_below(figure, legend_of(run, "choice, with its generation"), columns=7 if len(views) > 1 else 4)
    figure.draw_without_rendering()  # settles the layout that labels are placed in
    for axes, limits, hidden in zip(grid, views, [*views[1:], None], strict=True):
        _label_choices(axes, run, limits, hidden)
    return figure


def draw_policies(axes: Axes, run: StoredRun, pair: list[int], limits: np.ndarray) -> None:
    """Two of the objectives within the limits [2, 2]: policies, front, choices, last bounds and the chosen policy."""
    last = len(run.bounds) - 1
    x, y = values_of(run.policies)[:, pair].T
    axes.scatter(x, y, s=12, color=PALE, linewidths=0)
    x, y = values_of(run.front)[:, pair].T
    colours = [generation_colour(policy.generation, last) for policy in run.front]
    axes.scatter(x, y, s=30, c=colours, edgecolors="white", linewidths=0.7, zorder=4)
    for choice in choices_of(run):
        axes.plot(*choice.values[pair], zorder=5, **(RING if choice.asked else RING_OF_STAND_IN))
    if run.chosen:
        if run.chosen.confirmation:
            claimed = run.chosen.confirmation.claimed[pair]
            axes.plot(*np.stack([claimed, run.chosen.values[pair]], axis=1), zorder=6, **CONFIRMED_LINE)
        axes.plot(*run.chosen.values[pair], zorder=7, **STAR)
    x, y = run.bounds[-1, pair]
    if np.isfinite([x, y]).all():
        right, top = limits[1]
        axes.plot([x, x, right], [top, y, y], zorder=1.5, **BOUNDS_LINE)
        axes.add_patch(Rectangle((x, y), right - x, top - y, zorder=0.5, **BOUNDS_AREA))
    axes.set_xlim(*limits[:, 0])
    axes.set_ylim(*limits[:, 1])
    label_axes(axes, *(run.objectives[index] for index in pair))
    note_outside(axes, values_of(run.policies)[:, pair], limits)


def choices_of(run: StoredRun) -> list[Choice]:
    """Return the policies that steered the search, each once."""
    decisions: dict[int, list[DecisionRecord]] = {}
    for record in run.decisions:
        if isinstance(record, DecisionRecord) and record.purpose == "steer":
            decisions.setdefault(record.policy, []).append(record)
    return [
        Choice(
            _ranges(record.generation for record in records),
            np.array(records[0].values),
            not all(record.stand_in for record in records),
        )
        for records in decisions.values()
    ]


def whole_view(run: StoredRun) -> np.ndarray:
    """Limits [2, M] around the whole search."""
    values = values_of(run.policies)
    return around(np.concatenate([values[hopeful(values)], _close(run)]))


def close_view(run: StoredRun) -> np.ndarray:
    """Limits [2, M] around the last front."""
    return around(_close(run), margin=0.12)


def note_outside(axes: Axes, values: np.ndarray, limits: np.ndarray) -> None:
    """Say how many of the policies [N, M] are not within the limits [2, M]."""
    outside = int((~inside(values, limits)).sum())
    if outside:
        note(axes, f"{outside} of {plural(len(values), 'policy')} outside")


def front_name(run: StoredRun) -> str:
    """Return the name of the last known front."""
    return "final front" if run.result else "front so far"


def legend_of(run: StoredRun, choice: str, without: Container[str] = ()) -> list[Artist]:
    """Return an entry for each kind of thing in a run, but for those `without`; a choice is called `choice`."""
    last = len(run.bounds) - 1
    early, late = generation_colour(0, last), generation_colour(last, last)
    entries: dict[str, Artist] = {"policy": Line2D([], [], marker="o", color=PALE, ms=4, ls="", label="policy")}
    if last:
        entries["earlier"] = Line2D([], [], color=early, linewidth=0.9, label="earlier front")
    entries["front"] = Line2D([], [], color=late, marker="o", markeredgecolor="white", label=front_name(run))
    choices = choices_of(run)
    if any(each.asked for each in choices):
        entries["choice"] = Line2D([], [], label=choice, **RING)
    if not all(each.asked for each in choices):
        entries["stand-in"] = Line2D([], [], label=f"{choice}, by the stand-in", **RING_OF_STAND_IN)
    if np.isfinite(run.bounds).all(axis=1).any():
        entries["bounds"] = Line2D([], [], label="bounds of a choice", **BOUNDS_LINE)
    if np.isfinite(run.bounds[-1]).all():
        entries["bounds area"] = Patch(label="within the last bounds", **BOUNDS_AREA)
    if run.chosen:
        confirmed = ", confirmed score" if run.chosen.confirmation else ""
        entries["chosen"] = Line2D([], [], label=f"chosen: policy {run.chosen.id}{confirmed}", **STAR)
    return [entry for kind, entry in entries.items() if kind not in without]


def _close(run: StoredRun) -> np.ndarray:
    """Return what a view of the last front must show: its core, the last bounds and the chosen policy, [N, M]."""
    front, bounds = values_of(run.front), run.bounds[-1:]
    chosen = [run.chosen.values[None]] if run.chosen else []
    return np.concatenate([front[core(front)], bounds[np.isfinite(bounds).all(axis=1)], *chosen])


def _draw_fronts(axes: Axes, run: StoredRun, limits: np.ndarray) -> None:
    """Return the edge of what was dominated after each generation."""
    values = values_of(run.policies)
    generations = np.array([policy.generation for policy in run.policies])
    last = len(run.bounds) - 1
    for generation in range(last + 1):
        known = values[generations <= generation]
        width = 1.8 if generation == last else 0.9
        _staircase(axes, known[non_dominated(known)], limits, generation_colour(generation, last), width)


def _staircase(axes: Axes, front: np.ndarray, limits: np.ndarray, colour: tuple[float, ...], width: float) -> None:
    """Return the edge of what the front [N, 2] dominates, out to the limits [2, 2]."""
    front = front[np.argsort(front[:, 0])]
    left, bottom = np.minimum(limits[0], front.min(axis=0))
    x = np.concatenate([[left], front[:, 0], front[-1:, 0]])
    y = np.concatenate([front[:1, 1], front[:, 1], [bottom]])
    axes.plot(x, y, drawstyle="steps-pre", color=colour, linewidth=width, zorder=2)


def _draw_bounds(axes: Axes, bounds: np.ndarray, limits: np.ndarray) -> None:
    """Return a corner for each of the bounds [G, 2] but the last."""
    right, top = limits[1]
    for x, y in np.unique(bounds[:-1], axis=0):
        if np.isfinite([x, y]).all():
            axes.plot([x, x, right], [top, y, y], zorder=1.5, **BOUNDS_LINE)


def _frame_close_up(whole: Axes, close: Axes, limits: np.ndarray) -> None:
    """Say what the two views are, and show the one within the other."""
    whole.set_title("the whole search")
    close.set_title("around the last front")
    (x, y), (width, height) = limits[0], np.ptp(limits, axis=0)
    whole.add_patch(Rectangle((x, y), width, height, fill=False, edgecolor=INK, linewidth=0.8, zorder=6))


def _label_choices(axes: Axes, run: StoredRun, limits: np.ndarray, hidden: np.ndarray | None) -> None:
    """Return the generation at each choice within the limits [2, 2], but none within those that another view shows."""
    choices = choices_of(run)
    shown = [
        choice
        for choice in choices
        if inside(choice.values, limits) and (hidden is None or not inside(choice.values, hidden))
    ]
    if shown:
        avoid = np.stack([*values_of(run.front), *(choice.values for choice in choices)])
        place_labels(
            axes, np.stack([choice.values for choice in shown]), [choice.generations for choice in shown], avoid
        )


def _ranges(numbers: Iterable[int]) -> str:
    """Ascending numbers with neighbours drawn together: 1, 3–5."""
    runs: list[list[int]] = []
    for number in numbers:
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    return ", ".join(f"{run[0]}–{run[-1]}" if len(run) > 1 else str(run[0]) for run in runs)

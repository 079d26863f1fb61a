"""Figures of a study: what users get for how many questions, and how steps to targets compare."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from jmorl.experiments.study.plan import StudyPart, file_name
from jmorl.experiments.study.results import GOOD, UserRow
from jmorl.experiments.targets import TargetRow
from jmorl.report.style import BLUE, GREEN, GREY, INK, ORANGE, PALE, RED, legend_below, new_figure, save, style

LOOKS = ((BLUE, "o"), (ORANGE, "s"), (GREEN, "D"), (RED, "^"), (GREY, "v"), (INK, "P"))
PANEL = 3.4  # inches
COLUMNS = 4
DOTS_PER_INCH = 150
JITTER = 0.12  # of a question: equal runs lie beside each other


def draw(folder: Path, part: StudyPart, users: Sequence[UserRow], targets: Sequence[TargetRow]) -> list[Path]:
    """Draw what there is of a part. Returns the paths."""
    with style():
        figures = {}
        if users:
            figures[f"{part.name}-questions"] = questions_figure(users, f"{part.name}: what a question is worth")
        if targets:
            figures[f"{part.name}-targets"] = targets_figure(targets, f"{part.name}: steps until a target is reached")
        folder.mkdir(parents=True, exist_ok=True)
        return [save(figure, folder / f"{file_name(name)}.png") for name, figure in figures.items()]


def questions_figure(rows: Sequence[UserRow], title: str) -> Figure:
    """Draw a panel for each user: questions against shortfall, a mark for each run."""
    users, methods = _distinct(row.user for row in rows), _distinct(row.method for row in rows)
    columns = min(len(users), COLUMNS)
    lines = -(-len(users) // columns)
    figure = new_figure(PANEL * columns, 0.9 + PANEL * lines, title)
    grid = figure.subplots(lines, columns, squeeze=False).ravel()
    for axes, user in zip(grid, users, strict=False):
        for row in (row for row in rows if row.user == user):
            colour, mark = LOOKS[methods.index(row.method) % len(LOOKS)]
            beside = JITTER * (methods.index(row.method) - (len(methods) - 1) / 2)
            axes.scatter(row.asked + beside, row.shortfall, color=colour, marker=mark, s=22, linewidths=0.5, ec="white")
        axes.axhline(GOOD, color=PALE, linewidth=1.0, zorder=0.5)
        axes.set_title(user)
        axes.set_xlabel("questions")
        axes.set_ylabel("shortfall (%)")
        axes.xaxis.set_major_locator(MaxNLocator(6, integer=True))
    for axes in grid[len(users) :]:
        axes.remove()
    legend_below(figure, [_handle(number, method) for number, method in enumerate(methods)], len(methods))
    return figure


def _distinct(names: Iterable[str]) -> list[str]:
    return list(dict.fromkeys(names))


def _handle(number: int, method: str) -> Line2D:
    """Return the entry of a method in the legend."""
    colour, mark = LOOKS[number % len(LOOKS)]
    return Line2D([], [], color=colour, marker=mark, linestyle="", label=method)


def targets_figure(rows: Sequence[TargetRow], title: str) -> Figure:
    """Draw a panel for each target: the steps of each run, open marks for those that never arrived."""
    targets, methods = _distinct(row.target for row in rows), _distinct(row.method for row in rows)
    figure = new_figure(PANEL * len(targets), 0.9 + PANEL, title)
    grid = figure.subplots(1, len(targets), squeeze=False, sharey=True)[0]
    for axes, target in zip(grid, targets, strict=True):
        for row in (row for row in rows if row.target == target):
            number = methods.index(row.method)
            colour, mark = LOOKS[number % len(LOOKS)]
            steps = np.array(row.times.restricted) / 1e6
            reached = np.array([each is not None for each in row.times.reached])
            places = number + np.linspace(-0.25, 0.25, len(steps)) if len(steps) > 1 else np.array([float(number)])
            axes.scatter(places, steps, marker=mark, s=22, ec=colour, fc=np.where(reached, colour, "white"))
        axes.set_title(f"target {target}")
        axes.set_xticks(range(len(methods)), methods, rotation=20, ha="right")
    grid[0].set_ylim(bottom=0)  # after all is drawn: from now on the axis, which all share, keeps its upper end
    grid[0].set_ylabel("million steps; open: never reached")
    return figure

"""Figures of the fronts, over the published one, and of how hypervolumes grow."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.lines import Line2D

import envs
from benchmarks.fronts.plan import Published
from jmorl.display.text import objective_label
from jmorl.report.style import BLUE, GREY, INK, ORANGE, legend_below, new_figure, save, style

if TYPE_CHECKING:
    from benchmarks.fronts.report import Result

COLOURS = {"PGMORL": BLUE, "interactive": ORANGE}
PANEL = 4.6  # inches


def draw(folder: Path, env: str, there: Published, results: Mapping[str, Mapping[int, Result]]) -> list[Path]:
    """Draw both figures of a task. Returns their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    with style():
        return [_fronts(folder, env, there, results), _curves(folder, env, there, results)]


def _fronts(folder: Path, env: str, there: Published, results: Mapping[str, Mapping[int, Result]]) -> Path:
    """Draw a panel for each pair of objectives."""
    objectives = envs.make(env).objectives
    pairs = list(combinations(range(len(objectives)), 2))
    figure = new_figure(PANEL * len(pairs) + 1, PANEL, f"{env}: fronts of all seeds")
    for axes, (first, second) in zip(figure.subplots(1, len(pairs), squeeze=False)[0], pairs, strict=True):
        if there.front is not None:
            axes.scatter(*there.front[:, [first, second]].T, s=16, color=GREY, zorder=3)
        for method, found in results.items():
            for result in found.values():
                axes.scatter(*result.front[:, [first, second]].T, s=6, color=COLOURS[method], alpha=0.6, zorder=2)
        axes.set_xlabel(objective_label(objectives[first]))
        axes.set_ylabel(objective_label(objectives[second]))
    handles = [Line2D([], [], marker="o", ls="", color=COLOURS[method], label=method) for method in results]
    if there.front is not None:
        handles.append(Line2D([], [], marker="o", ls="", color=GREY, label="published, one seed"))
    legend_below(figure, handles, len(handles))
    return save(figure, folder / f"{env}-fronts.png")


def _curves(folder: Path, env: str, there: Published, results: Mapping[str, Mapping[int, Result]]) -> Path:
    """Draw the hypervolume of every run over time, and the published mean."""
    figure = new_figure(PANEL + 2, PANEL, f"{env}: hypervolume above the origin")
    axes = figure.subplots()
    axes.axhspan(*(there.hypervolume + np.array([-1, 1]) * there.hypervolume_sd), color="#eeeeee", zorder=0)
    axes.axhline(there.hypervolume, color=INK, linewidth=1.0)
    for method, found in results.items():
        for result in found.values():
            axes.plot(result.record.seconds, result.hypervolumes, color=COLOURS[method], linewidth=1.0)
    axes.set_xlabel("seconds")
    axes.set_ylabel("hypervolume")
    handles = [Line2D([], [], color=COLOURS[method], label=method) for method in results]
    handles.append(Line2D([], [], color=INK, linewidth=1.0, label="published mean, and its standard deviation"))
    legend_below(figure, handles, len(handles))
    return save(figure, folder / f"{env}-hypervolume.png")

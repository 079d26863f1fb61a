"""What a person at a terminal sees: tables of policies and points, and a scatter plot in text."""

import math
from collections.abc import Callable, Mapping

import numpy as np
import plotille
from rich.console import Console
from rich.table import Table
from rich.text import Text

from envs.core import Objective
from jmorl.decision.protocol import PointQuestion, Question
from jmorl.search.bounds import within

PLOT_HEIGHT = 14
PLOT_WIDTH = 64
PLOT_MARGIN = 20  # columns that the plot's axis takes
EMPTY_CELL = "\u2800"  # plotille's blank, a character that not every terminal can show


def show_front(console: Console, question: Question, by: int) -> None:
    """The question, its front with the most of objective `by` first, and a plot of it."""
    count = len(question.front)
    policies = f"{count} {'policies' if count > 1 else 'policy'}"
    if question.purpose == "final":
        heading = f"The run is over. Which of these {policies} is its result?"
    else:
        heading = f"Generation {question.generation}: which of these {policies} do you prefer?"
    console.print()
    console.print(heading, style="bold", markup=False, highlight=False)
    console.print(front_table(question, by))
    chosen = [policy.values for policy in question.front if policy.id == question.previous]
    marks, legend = ({"x": chosen[0]}, "o: a policy, x: your last choice") if chosen else ({}, "o: a policy")
    show_plot(console, question.objectives, question.values, marks, legend)


def show_points(console: Console, question: PointQuestion) -> None:
    """The question, its points, and a plot of them among the policies still reachable."""
    state = question.state
    iterations = f"{state.iterations_left} iteration{'s' if state.iterations_left > 1 else ''} left"
    reachable = f"{state.reachable.sum()} of {len(question.front)} policies reachable"
    console.print()
    heading = f"E-NAUTILUS, {iterations}, {reachable}. Which point do you prefer?"
    console.print(heading, style="bold", markup=False, highlight=False)
    console.print(points_table(question))
    marks = {"+": state.point} | {str(number): point.value for number, point in enumerate(question.points, start=1)}
    legend = "+: you are here, numbers: the points, o: a reachable policy"
    show_plot(console, question.objectives, state.values[state.reachable], marks, legend)


def front_table(question: Question, by: int) -> Table:
    """One row per policy: id, values with their spread, where it comes from."""
    formats = [_number_format(column) for column in question.values.T]
    table = _table("policy", *map(_heading, question.objectives), "born in", "")
    inside = within(question.values, question.bounds)
    for index in np.argsort(-question.values[:, by], kind="stable"):
        policy = question.front[index]
        note = "last choice" if policy.id == question.previous else "" if inside[index] else "outside the bounds"
        cells = [
            f"{value:{fmt}} ± {spread:{fmt}}"
            for value, spread, fmt in zip(policy.values, policy.spread, formats, strict=True)
        ]
        born = f"generation {policy.generation}" if policy.generation else "warm-up"
        table.add_row(str(policy.id), *cells, born, note, style=None if inside[index] else "dim")
    return table


def points_table(question: PointQuestion) -> Table:
    """One row per point: what can still come of it, how near the front it is, and the policy it heads for."""
    formats = [_number_format(column) for column in question.state.values.T]
    ranges = (f"{_heading(objective)}\nworst to best" for objective in question.objectives)
    table = _table("point", *ranges, "closeness", "policies", "heads for")
    for number, point in enumerate(question.points, start=1):
        cells = [
            f"{worst:{fmt}} to {best:{fmt}}" for worst, best, fmt in zip(point.value, point.best, formats, strict=True)
        ]
        heads_for = question.front[point.representative]
        values = ", ".join(f"{value:{fmt}}" for value, fmt in zip(heads_for.values, formats, strict=True))
        table.add_row(
            str(number), *cells, f"{point.closeness:.0f} %", str(point.reachable.sum()), f"{heads_for.id} ({values})"
        )
    return table


def show_plot(
    console: Console,
    objectives: tuple[Objective, ...],
    values: np.ndarray,  # [N, M]
    marks: Mapping[str, np.ndarray],  # character: point [M]
    legend: str,
) -> None:
    """Every vector as an o and the marks as their characters, in ASCII; nothing unless there are two objectives."""
    if len(objectives) != 2:
        return
    figure = plotille.Figure()
    figure.width = max(min(console.width - PLOT_MARGIN, PLOT_WIDTH), 1)
    figure.height = PLOT_HEIGHT
    figure.with_colors = False
    figure.origin = False
    figure.x_label, figure.y_label = (objective.label for objective in objectives)
    figure.x_ticks_fkt, figure.y_ticks_fkt = (_tick_format(column) for column in values.T)
    figure.scatter(values[:, 0], values[:, 1], marker="o")
    for character, point in marks.items():
        figure.text([point[0]], [point[1]], [character])
    plot = figure.show().replace(EMPTY_CELL, " ")
    console.print(Text(f"{plot}\n{legend}"), soft_wrap=True)


def _table(*headings: str) -> Table:
    table = Table(header_style="bold")
    for heading in headings:
        table.add_column(Text(heading), justify="right", overflow="fold")
    return table


def _heading(objective: Objective) -> str:
    return f"{objective.label} ({objective.unit})"


def _tick_format(values: np.ndarray) -> Callable[[float, float], str]:
    """How plotille shall write a tick: by the lower end of its interval."""
    fmt = _number_format(values)
    return lambda low, _: f"{low:{fmt}}"


def _number_format(values: np.ndarray) -> str:
    """Enough decimals to tell apart values [N] that differ by a thousandth of their range."""
    extent = np.ptp(values) or abs(values[0]) or 1.0
    decimals = 3 - math.floor(math.log10(extent))
    return f".{min(max(decimals, 0), 9)}f"

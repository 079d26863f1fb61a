"""What a person at a terminal sees: tables of policies and points, and a scatter plot in text."""

from collections.abc import Mapping

import numpy as np
from rich.console import Console
from rich.table import Table

from envs.core import Objective
from jmorl.decision.protocol import PointQuestion, Question
from jmorl.display.fronts import front_scatter, front_table, plain_table, stacked_label
from jmorl.display.text import number_format, plural

PLOT_WIDTH, PLOT_HEIGHT = 84, 19  # characters at most


def show_front(console: Console, question: Question, by: int) -> None:
    """The question, its front with the most of objective `by` first, and a plot of it."""
    policies = plural(len(question.front), "policy")
    if question.purpose == "final":
        heading = f"The run is over. Which of these {policies} is its result?"
    else:
        heading = f"Generation {question.generation}: which of these {policies} do you prefer?"
    table = front_table(
        question.front, question.objectives, previous_id=question.previous, by=by, bounds=question.bounds
    )
    _show(console, heading, table)
    chosen = [policy.values for policy in question.front if policy.id == question.previous]
    marks, legend = ({"x": chosen[0]}, "o: a policy, x: your last choice") if chosen else ({}, "o: a policy")
    show_plot(console, question.objectives, question.values, marks, legend)


def show_points(console: Console, question: PointQuestion) -> None:
    """The question, its points, and a plot of them among the policies still reachable."""
    state = question.state
    iterations = f"{plural(state.iterations_left, 'iteration')} left"
    reachable = f"{state.reachable.sum()} of {len(question.front)} policies reachable"
    _show(console, f"E-NAUTILUS, {iterations}, {reachable}. Which point do you prefer?", points_table(question))
    marks = {"+": state.point} | {str(number): point.value for number, point in enumerate(question.points, start=1)}
    legend = "+: you are here, numbers: the points, o: a reachable policy"
    show_plot(console, question.objectives, state.values[state.reachable], marks, legend)


def points_table(question: PointQuestion) -> Table:
    """One row per point: what can still come of it, how near the front it is, and the policy it heads for."""
    formats = [number_format(column) for column in question.state.values.T]
    ranges = (f"{stacked_label(objective)}\nworst to best" for objective in question.objectives)
    table = plain_table("point", *ranges, "closeness", "policies", "heads for")
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
    if len(objectives) == 2:
        plot = front_scatter(objectives, values, marks, min(console.width, PLOT_WIDTH), PLOT_HEIGHT)
        console.print(plot, soft_wrap=True)
        console.print(legend, markup=False, highlight=False)


def _show(console: Console, heading: str, table: Table) -> None:
    console.print()
    console.print(heading, style="bold", markup=False, highlight=False)
    console.print(table)

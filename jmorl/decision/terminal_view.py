"""What a person at a terminal sees: tables of policies and points, and a scatter plot in text."""

from collections.abc import Mapping

import numpy as np

from envs.core import Objective
from jmorl.decision.protocol import PointQuestion, Question
from jmorl.display.console import PlainConsole
from jmorl.display.fronts import front_scatter, front_table
from jmorl.display.questions import front_question, introduction, outlook
from jmorl.display.readings import Writer, bounds_in_words, reading_label, writers_for
from jmorl.display.tables import PlainTable
from jmorl.display.text import minus, plural
from jmorl.search.bounds import within

PLOT_WIDTH, PLOT_HEIGHT = 84, 19  # characters at most


def show_front(console: PlainConsole, question: Question, by: int) -> None:
    """Show the question, its front with the best in objective `by` first, and a plot of it."""
    heading = front_question(question.purpose, question.generation, len(question.front), question.form, question.again)
    table = front_table(
        question.front,
        question.objectives,
        previous_id=question.previous,
        by=by,
        bounds=question.bounds,
        limits=question.limits,
        previous_name="chosen for you" if question.previous_by_stand_in else "last choice",
    )
    fresh = next((policy.confirmation.episodes for policy in question.front if policy.confirmation), 0)
    if fresh:
        heading += f"\nThese scores are new, from {plural(fresh, 'fresh episode')}."
    if question.form == "pair" and question.purpose == "steer":
        heading += "\nTraining then goes on from the policy that all your answers so far speak for."
    told = limits_in_words(question)
    if told:
        heading += f"\n{told}"
    if question.others:
        heading += f"\nType all to see {len(question.others)} more."
    _show(console, heading, table)
    chosen = [policy.values for policy in question.front if policy.id == question.previous]
    by_whom = "chosen for you" if question.previous_by_stand_in else "your last choice"
    marks, legend = ({"x": chosen[0]}, f"o: a policy, x: {by_whom}") if chosen else ({}, "o: a policy")
    show_plot(console, question.objectives, question.values, marks, legend)


def show_introduction(console: PlainConsole, question: Question) -> None:
    """Say to somebody new what happens."""
    console.print()
    console.print(introduction(question.objectives))


def show_outlook(console: PlainConsole, question: Question, policy_id: int) -> None:
    """Say what choosing a policy would mean for the search."""
    prospect, values = question.prospect(question.policy(policy_id)), question.whole.values
    writers = writers_for(values, question.objectives)
    area = minus(bounds_in_words(prospect.bounds, writers)) if prospect else ""
    console.print(outlook(f"policy {policy_id}", area, prospect, values, writers))


def limits_in_words(question: Question) -> str:
    """Say which limits there are, and how many of the policies shown reach them; nothing without a limit."""
    limits = np.array(question.limits or ())
    if not np.isfinite(limits).any():
        return ""
    named = bounds_in_words(limits, [Writer(objective, "g") for objective in question.objectives])
    count = int(within(question.values, limits).sum())
    if count:
        reach = "reaches" if count == 1 else "reach"
        return f"Your limits: {named}. {count} of these {len(question.front)} {reach} them."
    return f"Your limits: {named}. None of these reaches them; limit NAME none takes one back."


def show_points(console: PlainConsole, question: PointQuestion) -> None:
    """Show the question, its points, and a plot of them among the policies still reachable."""
    state = question.state
    iterations = f"{plural(state.iterations_left, 'iteration')} left"
    reachable = f"{state.reachable.sum()} of {len(question.front)} policies reachable"
    _show(console, f"E-NAUTILUS, {iterations}, {reachable}. Which point do you prefer?", points_table(question))
    marks = {"+": state.point} | {str(number): point.value for number, point in enumerate(question.points, start=1)}
    legend = "+: you are here, numbers: the points, o: a reachable policy"
    show_plot(console, question.objectives, state.values[state.reachable], marks, legend)


def points_table(question: PointQuestion) -> PlainTable:
    """One row per point: what can still come of it, how near the front it is, and the policy it heads for."""
    writers = writers_for(question.state.values, question.objectives)
    ranges = (f"{reading_label(objective)}\nworst to best" for objective in question.objectives)
    table = PlainTable("point", *ranges, "closeness", "policies", "heads for")
    for number, point in enumerate(question.points, start=1):
        cells = [writer.span(worst, best) for writer, worst, best in zip(writers, point.value, point.best, strict=True)]
        heads_for = question.front[point.representative]
        values = ", ".join(writer.value(value) for writer, value in zip(writers, heads_for.values, strict=True))
        table.add_row(
            str(number), *cells, f"{point.closeness:.0f} %", str(point.reachable.sum()), f"{heads_for.id} ({values})"
        )
    return table


def show_plot(
    console: PlainConsole,
    objectives: tuple[Objective, ...],
    values: np.ndarray,  # [N, M]
    marks: Mapping[str, np.ndarray],  # character: point [M]
    legend: str,
) -> None:
    """Every vector as an o and the marks as their characters, in ASCII; nothing unless there are two objectives."""
    if len(objectives) == 2:
        plot = front_scatter(objectives, values, marks, min(console.width, PLOT_WIDTH), PLOT_HEIGHT)
        console.print(plot, soft_wrap=True)
        console.print(f"{legend}; better is to the right and above")


def _show(console: PlainConsole, heading: str, table: PlainTable) -> None:
    console.print()
    console.print(heading, style="bold")
    console.print(table)

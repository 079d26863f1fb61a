"""A front in text: as a table, and as a scatter plot."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import plotille
from rich.text import Text

from envs.core import Objective
from jmorl.display.limits import around, inside
from jmorl.display.readings import Writer, direction, writers_for
from jmorl.display.tables import PlainTable
from jmorl.display.text import plural
from jmorl.search.bounds import within
from jmorl.search.policy import Policy, values_of
from jmorl.search.scaling import core

AXIS_COLUMNS = 19  # that plotille adds to the width of a plot, besides the label of the axis
AXIS_LINES = 5  # and to its height, with a line about what is left out
EMPTY_CELL = "\u2800"  # plotille's blank, a character that not every terminal can show


def front_table(
    policies: Sequence[Policy],
    objectives: tuple[Objective, ...],
    chosen_id: int | None = None,
    previous_id: int | None = None,
    by: int = 0,
    bounds: np.ndarray | None = None,
    limits: Sequence[float] | None = None,
    previous_name: str = "last choice",
    noted: Mapping[int, str] | None = None,
) -> PlainTable:
    """One row for each of at least one policy, the best in objective `by` first.

    Scores are as people say them, with their standard deviation over the evaluation episodes; weights are those the
    policy was trained with, and round the generation it was born in, 0 being the warm-up. What lies outside the
    bounds [M], or does not reach the limits [M] that somebody has set, is dimmed. `noted` is what somebody has noted
    about policies, by id.
    """
    values = values_of(list(policies))
    stds = np.stack([policy.std for policy in policies])
    bounded = np.ones(len(policies), bool) if bounds is None else within(values, bounds)
    good = np.ones(len(policies), bool) if limits is None else within(values, np.array(limits))
    columns = zip(writers_for(values, objectives), values.T, stds.T, strict=True)
    scores = [_scores(*column) for column in columns]
    table = PlainTable("policy", *map(stacked_label, objectives), "weights", "round", "")
    for index in np.argsort(-values[:, by], kind="stable"):
        policy = policies[index]
        role = {policy.id == previous_id: previous_name, policy.id == chosen_id: "chosen"}.get(True)
        said = (noted or {}).get(policy.id)
        notes = role, said, _origin(policy), _outside(bool(bounded[index]), bool(good[index]))
        table.add_row(
            str(policy.id),
            *(column[index] for column in scores),
            " ".join(f"{weight:.2g}" for weight in policy.weights),
            str(policy.generation),
            ", ".join(filter(None, notes)),
            style="bold" if policy.id == chosen_id else None if bounded[index] and good[index] else "dim",
        )
    return table


def final_title(chosen: Policy) -> str:
    """Return the heading of a run's last front; where the result has another score, too, it says whose these are."""
    return "Final front, by the scores of the search" if chosen.confirmation else "Final front"


def _origin(policy: Policy) -> str:
    """Say what a blend is of."""
    if policy.blend is None:
        return ""
    shares = zip(policy.blend.parents, policy.blend.coefficients, strict=True)
    return f"blend {' '.join(f'{parent}:{share:.3g}' for parent, share in shares)}"


def _outside(bounded: bool, good: bool) -> str:
    """Say what a policy does not reach."""
    return "beyond your limits" if not good else "" if bounded else "outside the bounds"


def front_scatter(
    objectives: tuple[Objective, ...],
    values: np.ndarray,  # [N, M] N >= 1
    marks: Mapping[str, np.ndarray],  # character: point [M]
    width: int,
    height: int,
) -> Text:
    """Draw the vectors as o and the marks as their characters, in plain text; for two objectives.

    The better is to the right and above, numbers are as people say them.
    What is far out is left out, with a word about it, unless a mark is as far out. `width` and `height` are in
    characters, all included.
    """
    near = core(values)
    if not all(inside(point, around(values[near])) for point in marks.values()):
        near[:] = True
    shown = np.stack([*values[near], *marks.values()])
    figure = plotille.Figure()
    figure.width = max(width - AXIS_COLUMNS - len(objectives[0].label), 1)
    figure.height = max(height - AXIS_LINES, 1)
    figure.with_colors = False
    figure.origin = False
    figure.x_label, figure.y_label = (objective.label for objective in objectives)
    figure.x_ticks_fkt, figure.y_ticks_fkt = (_tick_format(writer) for writer in writers_for(shown, objectives))
    figure.scatter(values[near, 0], values[near, 1], marker="o")
    for character, point in marks.items():
        figure.text([point[0]], [point[1]], [character])
    plot = figure.show().replace(EMPTY_CELL, " ")
    left_out = f"\n({plural(int((~near).sum()), 'policy')} far out)" if not near.all() else ""
    return Text(plot + left_out, no_wrap=True)


def stacked_label(objective: Objective) -> str:
    """Return the quantity above its unit and, where that is so, that less is better: the head of a column."""
    less = f"\n{direction(objective)}" if objective.read.less_is_better else ""
    return f"{objective.label}\n({objective.read.unit}){less}"


def _scores(writer: Writer, values: np.ndarray, stds: np.ndarray) -> list[str]:
    """`66.1  ±0.4` for each of the values [N], the values under each other."""
    texts = [f"±{writer.size(std)}" for std in stds]
    width = max(map(len, texts))
    return [f"{writer.value(value)} {text:>{width}}" for value, text in zip(values, texts, strict=True)]


def _tick_format(writer: Writer) -> Callable[[float, float], str]:
    """How plotille shall write a tick: by the lower end of its interval."""
    return lambda low, _: writer.value(low)

"""Small tables of their own: the environments, and a policy's scores on fresh episodes."""

from typing import Any

import numpy as np
from rich.table import Table

import envs
from envs.core import Objective
from jmorl.learning.rollout import EpisodeReturns
from jmorl.report.fronts import plain_table
from jmorl.report.text import number_format, objective_label


def environments_table() -> Table:
    """One row for each registered environment."""
    table = plain_table("id", "objectives", "observation", "actions", "time limit")
    for name in envs.ids():
        environment = envs.make(name)
        labels = ", ".join(objective_label(objective) for objective in environment.objectives)
        sizes = (environment.observation_size, environment.action_size, environment.time_limit)
        table.add_row(name, labels, *map(str, sizes))
    return table


def evaluation_table(header: dict[str, Any], returns: EpisodeReturns) -> Table:
    """Undiscounted returns [episodes, M] of a stored policy, beside the score in its file's header."""
    undiscounted = np.asarray(returns.undiscounted, np.float64)
    episodes = len(undiscounted)
    title = f"Policy {header['id']} in {header['environment']}, {episodes} episodes"
    table = plain_table("undiscounted return", "mean", "± std. error", "std. dev.", "worst", "best", "in its run")
    table.title = title
    for index, fields in enumerate(header["objectives"]):
        column = undiscounted[:, index]
        error = f"{column.std(ddof=1) / np.sqrt(episodes):.2g}" if episodes > 1 else ""
        fmt = number_format(np.array([column.mean()]), digits=5)
        numbers = (column.std(), column.min(), column.max(), header["values"][index])
        mean, *others = (f"{number:{fmt}}" for number in (column.mean(), *numbers))
        table.add_row(objective_label(Objective(**fields)), mean, error, *others)
    lengths = np.asarray(returns.length)
    table.caption = f"Episodes of {lengths.min()} to {lengths.max()} steps, {lengths.mean():.1f} on average."
    return table

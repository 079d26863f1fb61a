"""What `jmorl show` prints of a run folder."""

from collections.abc import Callable

import numpy as np
from rich.console import Group
from rich.table import Table
from rich.text import Text

from jmorl.decision.protocol import Adjust, Back, Choose
from jmorl.decision.records import DecisionRecord, PointRecord, Record
from jmorl.report.fronts import front_table, plain_table, stacked_label
from jmorl.report.text import REASONS, duration, number_format, plural, short_count
from jmorl.search.policy import values_of
from jmorl.storage.stored_run import StoredRun


def run_tables(run: StoredRun) -> Group:
    """Heading, metrics, decisions and final front of a run, one below the other."""
    parts = [run_heading(run), metrics_table(run)]
    if run.decisions:
        parts.append(decisions_table(run))
    chosen = None if run.chosen is None else run.chosen.id
    front = front_table(run.front, run.objectives, chosen)
    front.title = "Final front" if run.result else "Front so far"
    return Group(*[line for part in (*parts, front) for line in ("", part)])


def run_heading(run: StoredRun) -> Table:
    """What was run, on what, for how long, and how it ended."""
    config, device = run.config, run.manifest["device"]
    steps, seconds = run.metrics["steps"][-1], run_seconds(run)
    rows = {
        "run": str(run.path),
        "environment": config.env,
        "method": f"{config.method}, user {config.user}, seed {config.seed}",
        "population": f"{plural(config.population.agents, 'agent')}, "
        f"{plural(config.ppo.environments, 'environment')} each",
        "devices": f"{device['count']} × {device['kind']}",
        "steps": f"{short_count(steps)} (and {short_count(run.metrics['evaluation_steps'][-1])} to evaluate)",
        "time": f"{duration(seconds)}, {short_count(steps / seconds)} steps/s; answers not counted",
        "state": f"finished: {REASONS[run.result['reason']]}" if run.result else "unfinished",
    }
    grid = Table.grid(padding=(0, 2, 0, 0))
    for name, value in rows.items():
        grid.add_row(Text(name, "bold"), Text(value))
    return grid


def run_seconds(run: StoredRun) -> float:
    """The time of all generations, the waiting for answers not counted."""
    return float(sum(run.metrics[f"{part}_seconds"].sum() for part in ("select", "train", "evaluate")))


def metrics_table(run: StoredRun) -> Table:
    """One row for each generation; what all generations lack, as a utility for a person, has no column."""
    metrics = run.metrics
    seconds = metrics["select_seconds"] + metrics["train_seconds"] + metrics["evaluate_seconds"]
    utility_max, utility_mean = metrics["utility_max"], metrics["utility_mean"]
    utility_format = number_format(np.concatenate([utility_max, utility_mean]), digits=4)
    columns = {
        "\ngen": _texts(metrics["generation"], ".0f"),
        "\nsteps": _texts(metrics["steps"], short_count),
        "\nsteps/s": _texts(metrics["steps_per_second"], short_count),
        "front\nsize": _texts(metrics["front_size"], ".0f"),
        "hyper-\nvolume": _texts(metrics["hypervolume"], number_format(metrics["hypervolume"], digits=4)),
        "utility\nmax": _texts(utility_max, utility_format),
        "utility\nmean": _texts(utility_mean, utility_format),
        "candi-\ndates": _texts(np.where(metrics["generation"] > 0, metrics["candidates"], np.nan), ".0f"),
        "predict.\nerror": _texts(metrics["prediction_error"], ".1%"),
        "time\nin s": _texts(seconds, ".1f"),
    }
    present = {heading: cells for heading, cells in columns.items() if any(cells)}
    table = plain_table(*present, title="Generations; 0 is the warm-up")
    for row in zip(*present.values(), strict=True):
        table.add_row(*row)
    return table


def decisions_table(run: StoredRun) -> Table:
    """One row for each answer, with the policy it prefers."""
    formats = [number_format(column) for column in values_of(run.front).T]
    table = plain_table(
        "gen", "question", "among", "policy", *map(stacked_label, run.objectives), "", title="Decisions"
    )
    for record in run.decisions:
        policy, values, note = _answer(record)
        cells = [f"{value:{fmt}}" for value, fmt in zip(values, formats, strict=True)] or [""] * len(formats)
        table.add_row(str(record.generation), record.purpose, str(len(record.shown) or ""), policy, *cells, note)
    return table


def _answer(record: Record) -> tuple[str, tuple[float, ...], str]:
    """The policy that an answer prefers and its values, empty if it prefers none, and what else it says."""
    match record:
        case DecisionRecord():
            more = f"go on for {plural(record.generations, 'generation')}" if record.generations > 1 else ""
            return str(record.policy), record.values, "stop" if record.stop else more
        case PointRecord(answer=Choose(point)):
            return str(record.shown[point].policy), record.shown[point].values, f"point {point + 1}"
        case PointRecord(answer=Back(steps)):
            return "", (), f"back by {steps}"
        case PointRecord(answer=Adjust(0, _)):
            return "", (), "end here"
        case PointRecord(answer=Adjust(left, points)):
            return "", (), f"{plural(left, 'iteration')} of {plural(points, 'point')}"
    raise AssertionError(record)


def _texts(column: np.ndarray, text: str | Callable[[float], str]) -> list[str]:
    """One text for each number by a format or a function, empty for NaN."""
    write = (lambda value: format(value, text)) if isinstance(text, str) else text
    return ["" if np.isnan(value) else write(value) for value in column]

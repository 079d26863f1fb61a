"""The tables that the commands print: a run folder, an evaluation, the environments."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

import envs
from envs.core import Objective
from jmorl.decision.records import DecisionRecord
from jmorl.display.fronts import final_title, front_table, stacked_label
from jmorl.display.readings import Writer, bounds_in_words, confirmed_in_words, writers_for
from jmorl.display.tables import PlainTable
from jmorl.display.text import (
    REASONS,
    duration,
    number,
    number_format,
    objective_label,
    plural,
    short_count,
)
from jmorl.learning.rollout import EpisodeReturns
from jmorl.search.metrics import coverage
from jmorl.search.policy import values_of
from jmorl.search.prediction import COVERAGE
from jmorl.storage.notes_file import Note
from jmorl.storage.policy_file import policy_name
from jmorl.storage.stored_run import StoredRun


def run_tables(run: StoredRun) -> list[RenderableType]:
    """Heading, metrics, decisions and final front of a run, to be printed one after the other."""
    decisions = [decisions_table(run)] if run.decisions else []
    chosen = run.chosen
    noted = {policy_id: _noted(note) for policy_id, note in run.notes.policies.items()}
    front = front_table(run.front, run.objectives, chosen.id if chosen else None, noted=noted)
    front.title = final_title(chosen) if chosen else "Front so far"
    tables: list[RenderableType] = [run_heading(run), metrics_table(run), *decisions, front]
    return [part for table in tables for part in (table, "")]


def run_heading(run: StoredRun) -> RenderableType:
    """Describe a run: its settings, its machine, how long it took, how it ended."""
    config, device = run.config, run.manifest["device"]
    steps, seconds = run.metrics["steps"][-1], run_seconds(run)
    rows = {
        "run": run.notes.run.named(str(run.path)),
        "environment": config.env,
        "method": f"{config.method}, user {config.user}, seed {config.seed}",
        "population": f"{plural(config.population.agents, 'agent')}, "
        f"{plural(config.ppo.environments, 'environment')} each",
        "devices": f"{device['count']} × {device['kind']}",
        "steps": f"{short_count(steps)} (and {short_count(run.metrics['evaluation_steps'][-1])} to evaluate)",
        "time": f"{duration(seconds)}, {short_count(steps / seconds)} steps/s; answers not counted",
        "state": f"finished: {REASONS[run.result['reason']]}" if run.result else "unfinished",
    }
    result = confirmed_in_words(run.chosen, run.objectives) if run.chosen else ""
    if run.chosen and result:
        rows["result"] = f"policy {run.chosen.id}: {result}"
    if run.notes.run.text or run.notes.problem:
        rows["notes"] = run.notes.run.text or run.notes.problem
    held = coverage(run.policies)
    if held is not None:
        known = sum(policy.interval is not None for policy in run.policies)
        rows["forecasts"] = f"{held:.0%} of what {plural(known, 'policy')} reached lay in its {COVERAGE:.0%} interval"
    grid = Table.grid(padding=(0, 2, 0, 0))
    for name, value in rows.items():
        grid.add_row(Text(name, "bold"), value)
    return grid


def _noted(note: Note) -> str:
    """Say in a few words what is noted about a policy: its name, and that it is a favourite."""
    return ", ".join(filter(None, (note.quoted, "favourite" if note.favourite else "")))


def run_seconds(run: StoredRun) -> float:
    """Return the time of all generations, the waiting for answers not counted."""
    return float(sum(run.metrics[f"{part}_seconds"].sum() for part in ("select", "train", "evaluate")))


def metrics_table(run: StoredRun) -> PlainTable:
    """One row for each generation; what all generations lack, as a utility for a person, has no column.

    The model error is that of the predictions, in units of the archive's range.
    """
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
        "model\nerror": _texts(metrics["prediction_error"], ".1%"),
        "time\nin s": _texts(seconds, ".1f"),
    }
    present = {heading: cells for heading, cells in columns.items() if any(cells)}
    table = PlainTable(*present, title="Generations; 0 is the warm-up")
    for row in zip(*present.values(), strict=True):
        table.add_row(*row)
    return table


def decisions_table(run: StoredRun) -> PlainTable:
    """One row for each answer, with the policy it prefers."""
    writers = writers_for(values_of(run.front), run.objectives)
    headings = map(stacked_label, run.objectives)
    table = PlainTable("round", "question", "among", "policy", *headings, "", title="Decisions")
    for record in run.decisions:
        if isinstance(record, DecisionRecord):
            cells = [writer.value(value) for writer, value in zip(writers, record.values, strict=True)]
            among = str(len(record.shown)) if record.shown else ""
            question = f"{record.purpose}, again" if record.again else record.purpose
            kind = _kind_of_answer(record, writers)
            table.add_row(str(record.generation), question, among, str(record.policy), *cells, kind)
    return table


def _kind_of_answer(record: DecisionRecord, writers: Sequence[Writer]) -> str:
    """Say what there is of an answer besides the policy that the run went on with."""
    limits = [-np.inf if limit is None else limit for limit in record.limits or ()]
    known = {
        "by the stand-in": record.stand_in,
        "no difference": record.equal,
        f"in the order {' '.join(map(str, record.ranking))}": record.ranking,
        f"go on for {plural(record.generations, 'round')}": record.generations > 1,
        f"limits: {(bounds_in_words(limits, writers) if limits else '') or 'none'}": record.limits,
        "stop": record.stop,
    }
    return ", ".join(text for text, applies in known.items() if applies)


def evaluation_table(header: Mapping[str, Any], returns: EpisodeReturns) -> PlainTable:
    """Return a table of fresh episodes [N] of a stored policy with this header, beside its score in the run."""
    undiscounted = np.asarray(returns.undiscounted, float)
    spread = "std.\nerror", "std.\ndev.", "\nworst", "\nbest"
    table = PlainTable("\nobjective", "\nmean", *spread, "in its\nrun", "dis-\ncounted", words=["\nobjective"])
    table.title = f"{_title(header)} in {plural(len(undiscounted), 'fresh episode')} of {header['environment']}"
    for index, fields in enumerate(header["objectives"]):
        column = undiscounted[:, index]
        fmt = number_format(column)
        error = f"{column.std(ddof=1) / np.sqrt(len(column)):.2g}" if len(column) > 1 else ""
        discounted = np.mean(returns.discounted[:, index])
        numbers = column.std(), column.min(), column.max(), header["values"][index], discounted
        texts = [f"{value:{fmt}}" for value in numbers]
        table.add_row(objective_label(Objective(**fields)), f"{column.mean():{fmt}}", error, *texts)
    lengths = np.asarray(returns.length)
    table.caption = f"Episodes of {lengths.min()} to {lengths.max()} steps, {lengths.mean():.1f} on average."
    return table


def scores_in_words(header: Mapping[str, Any]) -> str:
    """Return the returns of a stored policy with this header: `time -66.1 -steps, fuel -57.3 -force²·steps`."""
    return ", ".join(
        f"{objective['label']} {number(value)} {objective['unit']}"
        for objective, value in zip(header["objectives"], header["values"], strict=True)
    )


def _title(header: Mapping[str, Any]) -> str:
    name = policy_name(header)
    return name[0].upper() + name[1:]


def comparison_table(header: Mapping[str, Any], ours: np.ndarray, theirs: np.ndarray, z: np.ndarray) -> PlainTable:
    """Return the returns [N, M] here and in MO-Gymnasium, side by side; `z` [M] is their difference in std. errors."""
    spread = "std.\ndev.", "std.\nerror"
    headings = "jmorl\nmean", *spread, "MO-Gym.\nmean", *spread, "difference in\nstd. errors"
    table = PlainTable("\nobjective", *headings, words=["\nobjective"])
    table.title = f"{_title(header)} in {header['environment']}, {plural(len(ours), 'fresh episode')} each"
    for index, fields in enumerate(header["objectives"]):
        cells = [cell for returns in (ours, theirs) for cell in _mean_and_errors(returns[:, index])]
        table.add_row(objective_label(Objective(**fields)), *cells, *_texts(z[index : index + 1], "+.1f"))
    return table


def _mean_and_errors(column: np.ndarray) -> list[str]:
    fmt = number_format(column)
    deviation = column.std(ddof=1) if len(column) > 1 else np.nan
    return [f"{column.mean():{fmt}}", *_texts(np.array([deviation, deviation / np.sqrt(len(column))]), ".3g")]


def environment_tables(ids: Sequence[str], speeds: Mapping[str, str]) -> list[PlainTable]:
    """One table for each family, with a row for each environment: what it optimises, its sizes, its speed if known."""
    texts = "\nenvironment", "\nobjectives"
    tables: dict[str, PlainTable] = {}
    for name in ids:
        environment = envs.make(name)
        if environment.family not in tables:
            headings = *texts, "obser-\nvations", "\nactions", "time\nlimit", *(["\nsteps/s"] if speeds else [])
            tables[environment.family] = PlainTable(*headings, title=environment.family, words=texts)
        objectives = "\n".join(map(objective_label, environment.objectives))
        sizes = environment.observation_size, environment.action_size, environment.time_limit
        speed = [speeds[name]] if speeds else []
        tables[environment.family].add_row(name, objectives, *map(str, sizes), *speed)
    return list(tables.values())


def _texts(column: np.ndarray, text: str | Callable[[float], str]) -> list[str]:
    """One text for each number by a format or a function, empty for NaN."""
    write = (lambda value: format(value, text)) if isinstance(text, str) else text
    return ["" if np.isnan(value) else write(value) for value in column]

"""Parts of the report, as Markdown."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from jmorl.display.text import duration
from jmorl.paper.analysis import Finals, mechanism, questions_asked, seconds_between_questions
from jmorl.paper.data import PublishedRow, PublishedTable
from jmorl.paper.results import Curves, TargetRow
from jmorl.paper.statistics import Interval
from jmorl.paper.verdicts import million


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def vector(values: Sequence[float] | np.ndarray) -> str:
    return f"({', '.join(f'{value:.4g}' for value in values)})"


def between(found: Interval) -> str:
    """A mean of steps and its interval, in millions."""
    return f"{found.mean / 1e6:.2f} [{found.low / 1e6:.2f}, {found.high / 1e6:.2f}]"


def published_steps(row: PublishedRow, cap: int) -> str:
    if row.mean_steps is None or row.std_steps is None:
        return f"≥ {cap / 1e6:.2f}"
    return f"{row.mean_steps / 1e6:.2f} ± {row.std_steps / 1e6:.2f}"


def side_by_side(published: PublishedTable, rows: Mapping[str, Sequence[TargetRow]]) -> str:
    """A published table beside ours, in all units there are: million steps used, and how many runs succeed."""
    head = ["target", "method", "published", "reached"]
    head += [cell for units in rows for cell in (f"{units} units", "reached")]
    lines = []
    for row in published.rows:
        line = [row.target, row.method, published_steps(row, published.cap_steps), f"{5 - row.timeouts} of 5"]
        for each in rows.values():
            ours = next((one for one in each if (one.target, one.method) == (row.target, row.method)), None)
            line += _ours(ours)
        lines.append(line)
    return table(head, lines)


def _ours(row: TargetRow | None) -> list[str]:
    if row is None:
        return ["missing", ""]
    return [between(row.times.restricted_mean), f"{row.times.successes} of {len(row.seeds)}"]


def seed_by_seed(rows: Sequence[TargetRow]) -> str:
    """Million steps of every run; what never arrived is marked by ≥."""
    seeds = list(dict.fromkeys(seed for row in rows for seed in row.seeds))
    lines = []
    for row in rows:
        steps = dict(zip(row.seeds, row.times.reached, strict=True))
        cells = [_steps(steps[seed], row.times.budget) if seed in steps else "missing" for seed in seeds]
        lines.append([row.target, vector(row.values), row.method, *cells])
    return table(["target", "values", "method", *(f"seed {seed}" for seed in seeds)], lines)


def _steps(steps: float | None, budget: float) -> str:
    return f"≥ {budget / 1e6:.2f}" if steps is None else f"{steps / 1e6:.2f}"


def costs(rows: Sequence[TargetRow], published: PublishedTable) -> str:
    """What a run takes of a machine, and of a person."""
    head = ["target", "method", "time per run", "published", "questions", "seconds between questions"]
    lines = []
    for row in rows:
        theirs = duration(published.row(row.target, row.method).seconds)
        wait = _number(seconds_between_questions(row.records), ".1f")
        asked = f"{questions_asked(row.records):.1f}" if row.method == "interactive" else "1, at the end"
        lines.append([row.target, row.method, duration(row.seconds), theirs, asked, wait])
    return table(head, lines)


def honesty(rows: Sequence[TargetRow]) -> str:
    """Paper units: what was reached, in raw returns, and how far the units had moved."""
    head = ["target", "method", "raw returns of what reached it, mean", "sigma after the warm-up", "sigma at the end"]
    head += ["owed to moving units"]
    lines = []
    for row in rows:
        first = np.array([record.generations[0].sigma for record in row.records], float).mean(axis=0)
        last = np.array([record.generations[-1].sigma for record in row.records], float).mean(axis=0)
        raw = vector(row.raw.mean(axis=0)) if len(row.raw) else "never reached"
        drifted = f"{row.drifted} of {row.times.successes}" if row.times.successes else ""
        lines.append([row.target, row.method, raw, vector(first), vector(last), drifted])
    return table(head, lines)


def mechanisms(rows: Sequence[TargetRow]) -> str:
    """How the searches got on."""
    head = ["target", "method", "candidates (median)", "generations with only the choice", "answers that repeat"]
    head += ["predicted gain", "realised gain"]
    lines = []
    for row in rows:
        found = mechanism(row.records)
        shares = [_number(found.candidates, ".0f"), _number(found.alone, ".0%"), _number(found.repeated, ".0%")]
        gains = [_number(gain, "+.1%") for gain in (found.predicted_gain, found.realised_gain)]
        lines.append([row.target, row.method, *shares, *gains])
    return table(head, lines)


def ends(rows: Sequence[Curves], bounded: bool) -> str:
    """Utilities after the last generation, with every seed."""
    head = ["user", "method", "mean", "seed by seed"] + ["within the bounds only"] * bounded
    lines = []
    for row in rows:
        seeds = ", ".join(f"{value:.4g}" for value in row.last)
        inside = [", ".join(f"{value:.4g}" for value in row.bounded[:, -1])] * bounded
        lines.append([row.user, row.method, f"{row.last.mean():.4g}", seeds, *inside])
    return table(head, lines)


def final_table(found: Mapping[str, Finals], weights: Mapping[str, Sequence[float]]) -> str:
    """Every final policy and its utility; struck through if another final policy dominates it."""
    lines = []
    for user, finals in found.items():
        w = np.array(weights[user])
        for values, kept in zip(finals.interactive, finals.kept, strict=True):
            lines.append([user, "interactive", _struck(vector(values), kept), f"{values @ w:.4g}"])
        theirs = _struck(vector(finals.enautilus), finals.enautilus_kept)
        lines.append([user, "pgmorl + E-NAUTILUS", theirs, f"{finals.enautilus @ w:.4g}"])
    return table(["user", "method", "final policy", "utility"], lines)


def _struck(text: str, kept: bool) -> str:
    return text if kept else f"~~{text}~~"


def _number(value: float, form: str) -> str:
    """Empty for NaN: where there is nothing to average."""
    return "" if np.isnan(value) else f"{value:{form}}"


def totals(steps: float, seconds: float, runs: int) -> str:
    return f"{runs} runs, {million(steps)} steps, {duration(seconds)}"

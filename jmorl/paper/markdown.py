"""Parts of the report, as Markdown."""

from collections.abc import Mapping, Sequence

import numpy as np

from jmorl.display.text import duration
from jmorl.experiments.diagnostics import waiting
from jmorl.experiments.record import RunRecord
from jmorl.experiments.tables import between, million, number, share, table, vector
from jmorl.experiments.targets import TargetRow
from jmorl.paper.analysis import ENAUTILUS_ITERATIONS, Finals, seconds_within
from jmorl.paper.data import PublishedRow, PublishedTable
from jmorl.paper.drift import at_the_start, common_generation, drifted, sigma_at
from jmorl.paper.results import Curves


def published_steps(row: PublishedRow, cap: int) -> str:
    """Write mean and deviation; where the printed deviation is another, it comes first."""
    if row.mean_steps is None or row.std_steps is None:
        return f'≥ {cap / 1e6:.2f} ("No results")'
    if row.std_printed is None:
        return f"{row.mean_steps / 1e6:.2f} ± {row.std_steps / 1e6:.2f}"
    return f"{row.mean_steps / 1e6:.2f} ± {row.std_printed / 1e6:.2f} printed, ± {row.std_steps / 1e6:.2f} derived"


def side_by_side(published: PublishedTable, rows: Mapping[str, Sequence[TargetRow]]) -> str:
    """Lay out a published table beside ours, in all units there are: million steps used, and successes."""
    head = ["target", "method", "published", "reached"]
    head += [cell for units in rows for cell in (f"{units} units", "reached")]
    methods = dict.fromkeys(
        [row.method for row in published.rows] + [row.method for each in rows.values() for row in each]
    )
    lines = []
    for target in published.targets:
        for method in methods:
            theirs = next((row for row in published.rows if (row.target, row.method) == (target, method)), None)
            line = [target, method, published_steps(theirs, published.cap_steps) if theirs else "", ""]
            line[3] = f"{theirs.successes} of {theirs.RUNS}" if theirs else ""
            for each in rows.values():
                ours = next((row for row in each if (row.target, row.method) == (target, method)), None)
                line += _ours(ours, bool(theirs))
            lines.append(line)
    return table(head, lines)


def _ours(row: TargetRow | None, wanted: bool) -> list[str]:
    if row is None:
        return ["missing" if wanted else "", ""]
    return [between(row.times.restricted_mean), share(row.times.successes, len(row.seeds))]


def costs(rows: Sequence[TargetRow], published: PublishedTable) -> str:
    """Lay out the time that a run takes of a machine, and of a person."""
    head = ["target", "method", "time per run", "published", "questions", "before the first question"]
    head += ["between questions"]
    lines = []
    for row in rows:
        theirs = next((r.seconds for r in published.rows if (r.target, r.method) == (row.target, row.method)), None)
        asked = waiting(row.records)
        interactive = row.method == "interactive"
        first = asked.before_first if interactive else row.seconds
        lines.append(
            [
                *(row.target, row.method, _time(row.seconds), duration(theirs) if theirs else ""),
                f"{asked.questions:.1f}" if interactive else "1, at the end",
                _time(first),
                _time(asked.between) if interactive else "",
            ]
        )
    return table(head, lines)


def _time(seconds: float) -> str:
    """Write a duration; nothing for NaN, which is not known."""
    return "" if np.isnan(seconds) else duration(seconds)


def waits(rows: Sequence[Curves], steps: int) -> str:
    """Lay out what a figure's runs ask of a person; PGMORL asks at the end, here after the figure's `steps`."""
    lines = []
    for row in rows:
        if row.method == "interactive":
            lines.append([row.user, row.method, *_waiting_cells(row.records)])
        else:
            whole = float(np.mean([seconds_within(record, steps) for record in row.records]))
            lines.append([row.user, row.method, "1, at the end", _time(whole), ""])
    return table(["user", "method", "questions", "before the first", "between"], lines)


def _waiting_cells(records: Sequence[RunRecord]) -> list[str]:
    asked = waiting(records)
    return [f"{asked.questions:.1f}", _time(asked.before_first), _time(asked.between)]


def final_waits(found: Mapping[str, Finals], steps: int) -> str:
    """Lay out the same for final policies: E-NAUTILUS asks when all the runs whose archives it pools have ended."""
    lines = []
    for user, finals in found.items():
        lines.append([user, "interactive", *_waiting_cells(finals.runs)])
        pooled = sum(seconds_within(record, steps) for record in finals.sources)
        lines.append([user, "pgmorl + E-NAUTILUS", str(ENAUTILUS_ITERATIONS), _time(pooled), "at once"])
    return table(["user", "method", "questions", "before the first", "between"], lines)


def honesty(rows: Sequence[TargetRow]) -> str:
    """Lay out for paper units the raw returns of successes, and how far units had moved after equally many steps."""
    head = ["target", "method", "raw returns of what reached it, mean", "sigma after the warm-up"]
    head += ["sigma after as many steps in both methods", "reached with generation 0", "owed to moving units"]
    lines = []
    for row in rows:
        runs = [_sigmas(row, rows, seed) for seed in row.seeds]
        first, last = (np.mean([run[when] for run in runs if run], axis=0) for when in (0, 1))
        returns = [record.raw[hit.policy] for record, hit in row.hits]
        raw = vector(np.mean(returns, axis=0)) if returns else "never reached"
        counts = [share(count, row.times.successes) for count in (at_the_start(row), drifted(row))]
        sigmas = [vector(first), vector(last)] if any(runs) else ["", ""]
        lines.append([row.target, row.method, raw, *sigmas, *(counts if row.times.successes else ["", ""])])
    return table(head, lines)


def _sigmas(row: TargetRow, rows: Sequence[TargetRow], seed: int) -> tuple[np.ndarray, np.ndarray] | None:
    """Return sigma of the row's run with a seed: after the warm-up, and when the shortest of all methods' runs ends."""
    record = row.records[row.seeds.index(seed)]
    peers = [
        other.records[other.seeds.index(seed)] for other in rows if other.target == row.target and seed in other.seeds
    ]
    last = common_generation(peers)
    return (sigma_at(record, 0), sigma_at(record, last)) if last >= 0 else None


def ends(rows: Sequence[Curves]) -> str:
    """Lay out utilities after the last generation, seed by seed, with those of the buffer where there are any."""
    buffers = any(row.buffer is not None for row in rows)
    head = ["user", "method", "mean", "seed by seed"] + ["buffer (authors)", "buffer within bounds (authors)"] * buffers
    lines = []
    for row in rows:
        seeds = ", ".join(f"{value:.4g}" for value in row.last)
        theirs = [
            ", ".join(number(value, ".4g", "nobody") for value in each[:, -1])
            for each in (row.buffer, row.bounded)
            if each is not None
        ]
        lines.append([row.user, row.method, f"{row.last.mean():.4g}", seeds, *theirs])
    return table(head, lines)


def final_table(found: Mapping[str, Finals], weights: Mapping[str, Sequence[float]]) -> str:
    """Lay out every final policy and its utility; struck through if another final policy dominates it."""
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


def totals(steps: float, seconds: float, runs: int) -> str:
    """Return the totals as a sentence."""
    return f"{runs} runs, {million(steps)} steps, {duration(seconds)}"

"""Parts of the report, as Markdown."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from jmorl.display.text import duration
from jmorl.paper.analysis import ENAUTILUS_ITERATIONS, Finals, seconds_within
from jmorl.paper.data import PublishedRow, PublishedTable
from jmorl.paper.drift import common_generation, sigma_at
from jmorl.paper.mechanism import mechanism, waiting
from jmorl.paper.naming import million, number, share
from jmorl.paper.record import RunRecord
from jmorl.paper.results import Curves, TargetRow
from jmorl.paper.statistics import Difference, Interval


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def vector(values: Sequence[float] | np.ndarray) -> str:
    return f"({', '.join(f'{value:.4g}' for value in values)})"


def between(found: Interval | Difference) -> str:
    """A mean of steps and its interval, in millions."""
    return f"{found.mean / 1e6:.2f} [{found.low / 1e6:.2f}, {found.high / 1e6:.2f}]"


def published_steps(row: PublishedRow, cap: int) -> str:
    """Mean and deviation; where the one printed is another, it comes first."""
    if row.mean_steps is None or row.std_steps is None:
        return f'≥ {cap / 1e6:.2f} ("No results")'
    if row.std_printed is None:
        return f"{row.mean_steps / 1e6:.2f} ± {row.std_steps / 1e6:.2f}"
    return f"{row.mean_steps / 1e6:.2f} ± {row.std_printed / 1e6:.2f} printed, ± {row.std_steps / 1e6:.2f} derived"


def side_by_side(published: PublishedTable, rows: Mapping[str, Sequence[TargetRow]]) -> str:
    """A published table beside ours, in all units there are: million steps used, and how many runs succeed."""
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


def seed_by_seed(rows: Sequence[TargetRow]) -> str:
    """Million steps of every run; what never arrived is marked by ≥, what broke down is said to have."""
    seeds = list(dict.fromkeys(seed for row in rows for seed in row.seeds))
    lines = []
    for row in rows:
        runs = {seed: _steps(row, index) for index, seed in enumerate(row.seeds)}
        lines.append([row.target, vector(row.values), row.method, *(runs.get(seed, "missing") for seed in seeds)])
    return table(["target", "values", "method", *(f"seed {seed}" for seed in seeds)], lines)


def _steps(row: TargetRow, index: int) -> str:
    steps, record = row.times.reached[index], row.records[index]
    if steps is not None:
        return f"{steps / 1e6:.2f}"
    return f"≥ {row.times.budget / 1e6:.2f}" + (f" (broke down at {million(record.total_steps)})" * bool(record.fault))


def costs(rows: Sequence[TargetRow], published: PublishedTable) -> str:
    """What a run takes of a machine, and of a person."""
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
    """Empty for NaN, which is not known."""
    return "" if np.isnan(seconds) else duration(seconds)


def waits(rows: Sequence[Curves], steps: int) -> str:
    """What the runs of a figure ask of a person; PGMORL's, which asks at the end, up to the figure's `steps`."""
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
    """The same of final policies: E-NAUTILUS asks when all the runs whose archives it pools have ended."""
    lines = []
    for user, finals in found.items():
        lines.append([user, "interactive", *_waiting_cells(finals.runs)])
        pooled = sum(seconds_within(record, steps) for record in finals.sources)
        lines.append([user, "pgmorl + E-NAUTILUS", str(ENAUTILUS_ITERATIONS), _time(pooled), "at once"])
    return table(["user", "method", "questions", "before the first", "between"], lines)


def honesty(rows: Sequence[TargetRow]) -> str:
    """Paper units: what was reached, in raw returns, and how far the units had moved after equally many steps."""
    head = ["target", "method", "raw returns of what reached it, mean", "sigma after the warm-up"]
    head += ["sigma after as many steps in both methods", "reached with generation 0", "owed to moving units"]
    lines = []
    for row in rows:
        runs = [_sigmas(row, rows, seed) for seed in row.seeds]
        first, last = (np.mean([run[when] for run in runs if run], axis=0) for when in (0, 1))
        raw = vector(row.raw.mean(axis=0)) if len(row.raw) else "never reached"
        counts = [share(count, row.times.successes) for count in (row.at_the_start, row.drifted)]
        sigmas = [vector(first), vector(last)] if any(runs) else ["", ""]
        lines.append([row.target, row.method, raw, *sigmas, *(counts if row.times.successes else ["", ""])])
    return table(head, lines)


def _sigmas(row: TargetRow, rows: Sequence[TargetRow], seed: int) -> tuple[np.ndarray, np.ndarray] | None:
    """Of the row's run with a seed: after the warm-up, and when the shorter of all methods' runs ends."""
    record = row.records[row.seeds.index(seed)]
    peers = [
        other.records[other.seeds.index(seed)] for other in rows if other.target == row.target and seed in other.seeds
    ]
    last = common_generation(peers)
    return (sigma_at(record, 0), sigma_at(record, last)) if last >= 0 else None


def mechanisms(rows: Sequence[TargetRow]) -> str:
    """How the searches got on."""
    head = ["target", "method", "candidates (median)", "generations with only the choice", "answers that repeat"]
    head += ["predicted gain", "realised gain"]
    lines = []
    for row in rows:
        found = mechanism(row.records)
        shares = [number(found.candidates, ".0f"), number(found.alone, ".0%"), number(found.repeated, ".0%")]
        gains = [number(gain, "+.1%") for gain in (found.predicted_gain, found.realised_gain)]
        lines.append([row.target, row.method, *shares, *gains])
    return table(head, lines)


def ends(rows: Sequence[Curves]) -> str:
    """Utilities after the last generation, with every seed; with those of the buffer where there are any."""
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


def totals(steps: float, seconds: float, runs: int) -> str:
    return f"{runs} runs, {million(steps)} steps, {duration(seconds)}"

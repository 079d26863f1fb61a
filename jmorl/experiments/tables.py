"""Tables of a comparison, as Markdown, and the numbers in them."""

from collections.abc import Iterable, Sequence

import numpy as np

from jmorl.display.text import plural
from jmorl.experiments.diagnostics import mechanism
from jmorl.experiments.statistics import FEWEST, Difference, Interval
from jmorl.experiments.targets import TargetRow, compared


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Lay out a table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def vector(values: Sequence[float] | np.ndarray) -> str:
    """Write a vector with four significant digits."""
    return f"({', '.join(f'{value:.4g}' for value in values)})"


def million(steps: float) -> str:
    """Write a number of steps, in millions."""
    return f"{steps / 1e6:.2f} M"


def between(found: Interval | Difference) -> str:
    """Write a mean of steps and its interval, in millions."""
    return f"{found.mean / 1e6:.2f} [{found.low / 1e6:.2f}, {found.high / 1e6:.2f}]"


def gain(found: Difference) -> str:
    """Write a mean gain, with its interval where there are seeds enough for one."""
    if found.count < FEWEST:
        return f"{found.mean:+.3g} (of {plural(found.count, 'seed')})"
    return f"{found.mean:+.3g} [{found.low:+.3g}, {found.high:+.3g}], {found.certainty}"


def number(value: float, form: str, otherwise: str = "") -> str:
    """Write a number, or `otherwise` for NaN: where there is nothing to average."""
    return otherwise if np.isnan(value) else f"{value:{form}}"


def share(count: int, total: int) -> str:
    """Write how many of all."""
    return f"{count} of {total}"


def steps_used(rows: Sequence[TargetRow]) -> str:
    """Lay out restricted mean steps, successes, and what each contender saves against the last one."""
    lines = [
        [
            *(row.target, row.method, between(row.times.restricted_mean)),
            *(share(row.times.successes, len(row.seeds)), _saved(row, rows)),
        ]
        for row in rows
    ]
    last = rows[-1].method
    return table(["target", "method", "million steps used", "reached", f"million steps saved against {last}"], lines)


def _saved(row: TargetRow, rows: Sequence[TargetRow]) -> str:
    """Write the steps saved against the last contender on the same target."""
    baseline = [other for other in rows if other.target == row.target][-1]
    difference = None if row is baseline else compared(row, baseline)
    return between(difference) if difference else ""


def seed_by_seed(rows: Sequence[TargetRow]) -> str:
    """Lay out the million steps of every run. A run that never arrived is marked by ≥; one that broke down says so."""
    seeds = list(dict.fromkeys(seed for row in rows for seed in row.seeds))
    lines = []
    for row in rows:
        runs = {seed: _steps(row, index) for index, seed in enumerate(row.seeds)}
        lines.append([row.target, vector(row.values), row.method, *(runs.get(seed, "missing") for seed in seeds)])
    return table(["target", "values", "method", *(f"seed {seed}" for seed in seeds)], lines)


def _steps(row: TargetRow, index: int) -> str:
    """Write the steps of one run."""
    steps, record = row.times.reached[index], row.records[index]
    if steps is not None:
        return f"{steps / 1e6:.2f}"
    return f"≥ {row.times.budget / 1e6:.2f}" + (f" (broke down at {million(record.total_steps)})" * bool(record.fault))


def mechanisms(rows: Sequence[TargetRow]) -> str:
    """Lay out what the searches were doing."""
    head = ["target", "method", "candidates (median)", "generations with only the choice", "answers that repeat"]
    head += ["predicted gain", "realised gain"]
    lines = []
    for row in rows:
        found = mechanism(row.records)
        shares = [number(found.candidates, ".0f"), number(found.alone, ".0%"), number(found.repeated, ".0%")]
        gains = [number(gain, "+.1%") for gain in (found.predicted_gain, found.realised_gain)]
        lines.append([row.target, row.method, *shares, *gains])
    return table(head, lines)

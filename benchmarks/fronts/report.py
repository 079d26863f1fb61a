"""REPORT.md: what our runs found on the tasks of PGMORL's authors, and what is published.

Letters: S runs, one a seed; G generations; M objectives.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

import envs
from benchmarks.fronts.figures import draw
from benchmarks.fronts.plan import METHODS, SEEDS, TASKS, Published, cell, published
from jmorl.display.text import duration, objective_label
from jmorl.experiments.record import RunRecord
from jmorl.experiments.tables import million, share, table
from jmorl.search.pareto import expected_utility, hypervolume
from jmorl.search.weights import evenly_spaced_weights
from jmorl.storage.files import write_text

WEIGHTS = 101  # of the expected utility


@dataclass(frozen=True)
class Result:
    """What a run found: its fronts are in raw returns, hypervolumes above the origin."""

    record: RunRecord

    @cached_property
    def front(self) -> np.ndarray:  # [N, M]
        """The front at the end."""
        return self.record.values[list(self.record.generations[-1].front)]

    @cached_property
    def hypervolumes(self) -> np.ndarray:  # [G + 1]
        """The hypervolume of the front after each generation."""
        origin = np.zeros(len(self.record.objectives))
        values = self.record.values
        return np.array([hypervolume(values[list(each.front)], origin) for each in self.record.generations])

    @cached_property
    def expected_utility(self) -> float:
        """The mean of the best weighted sums."""
        return expected_utility(self.front, evenly_spaced_weights(self.front.shape[1], WEIGHTS))

    @cached_property
    def best_sum(self) -> float:
        """The greatest mean of all objectives: what a user who weighs them alike is after."""
        return float(self.front.mean(axis=1).max())

    def reached(self, least: float) -> tuple[float, float] | None:
        """Return steps and seconds until the hypervolume was at least so much; None if it never was."""
        there = np.flatnonzero(self.hypervolumes >= least)
        return (float(self.record.steps[there[0]]), float(self.record.seconds[there[0]])) if len(there) else None


def write_report(folder: Path, records: Mapping[str, RunRecord]) -> Path:
    """Write the report, with its figures, into the folder. Returns its path."""
    parts = [_introduction(records)]
    for env in TASKS:
        parts += _section(folder, env, records)
    path = folder / "REPORT.md"
    write_text(path, "\n\n".join(parts) + "\n")
    return path


def _introduction(records: Mapping[str, RunRecord]) -> str:
    devices = ", ".join(sorted({record.device for record in records.values()})) or "none"
    return (
        "# Fronts on the tasks of PGMORL's authors\n\n"
        f"Made by `make fronts` from {share(len(records), len(TASKS) * len(METHODS) * len(SEEDS))} runs, with the "
        f"seeds {', '.join(map(str, SEEDS))}. Devices: {devices}. Returns are undiscounted, hypervolumes above the "
        f"origin, the expected utility is the mean over {WEIGHTS} even weights. Published: hypernetwork MORL (IJCAI "
        "2024), from the results that its authors keep with their program. Seconds do not count compilation. "
        "The interactive method's user weighs all objectives alike: it looks for one policy, not for a front."
    )


def _section(folder: Path, env: str, records: Mapping[str, RunRecord]) -> Iterator[str]:
    """Yield the parts of a section."""
    steps = {method: cell(env, method, SEEDS[0]).config.steps for method in METHODS}
    budgets = " and ".join(dict.fromkeys(f"{million(each)} steps" for each in steps.values()))
    yield f"## {env} ({TASKS[env]}), {budgets}"
    results = {method: _results(env, method, records) for method in METHODS}
    there = published(env)
    yield "Objectives: " + "; ".join(objective_label(each) for each in envs.make(env).objectives) + "."
    yield _table(there, results)
    if any(results.values()):
        yield _seeds(there, results)
        paths = draw(folder / "figures", env, there, results)
        yield "\n".join(f"![{path.stem}](figures/{path.name})" for path in paths)


def _results(env: str, method: str, records: Mapping[str, RunRecord]) -> dict[int, Result]:
    """Return what there is of a method, by seed."""
    keys = {seed: cell(env, method, seed).key for seed in SEEDS}
    return {seed: Result(records[key]) for seed, key in keys.items() if key in records}


def _table(there: Published, results: Mapping[str, Mapping[int, Result]]) -> str:
    head = ["", "seeds", "hypervolume", "expected utility", "best mean of objectives", "front", "steps", "time"]
    utility = f"{there.expected_utility:.4g}" if there.expected_utility else ""
    lines = [
        [
            *("published", str(there.seeds), f"{there.hypervolume:.4g} ± {there.hypervolume_sd:.2g}", utility),
            *("" if there.front is None else f"{there.front.mean(axis=1).max():.4g}",),
            *("" if there.front is None else str(len(there.front)), million(there.steps), duration(there.seconds)),
        ]
    ]
    lines += [_row(method, list(found.values())) for method, found in results.items() if found]
    return table(head, lines)


def _row(method: str, results: Sequence[Result]) -> list[str]:
    volumes = [result.hypervolumes[-1] for result in results]
    spread = f" ± {np.std(volumes, ddof=1):.2g}" if len(volumes) > 1 else ""
    return [
        *(method, str(len(results)), f"{np.mean(volumes):.4g}{spread}"),
        f"{np.mean([result.expected_utility for result in results]):.4g}",
        f"{np.mean([result.best_sum for result in results]):.4g}",
        f"{np.mean([len(result.front) for result in results]):.0f}",
        million(float(np.mean([result.record.total_steps for result in results]))),
        duration(float(np.mean([result.record.total_seconds for result in results]))),
    ]


def _seeds(there: Published, results: Mapping[str, Mapping[int, Result]]) -> str:
    """Lay out each seed: its hypervolume, and when it was at the published mean."""
    lines = []
    for method, found in results.items():
        for seed, result in found.items():
            reached = result.reached(there.hypervolume)
            when = f"{million(reached[0])} steps, {duration(reached[1])}" if reached else "not reached"
            lines.append([method, str(seed), f"{result.hypervolumes[-1]:.4g}", when])
    return table(["", "seed", "hypervolume", f"at {there.hypervolume:.4g}, the published mean"], lines)

"""Train on the tasks of PGMORL's authors, and write REPORT.md with what is published beside it.

    python -m benchmarks.fronts              make the runs that are missing, then the report
    python -m benchmarks.fronts --report     only the report, from the records there are
    python -m benchmarks.fronts --only ENV --pilot 2 3 --set ppo.discount=0.99
                                             PGMORL with these seeds and settings, printed: settings are chosen so

Runs that were interrupted go on where they were.
"""

import argparse
from pathlib import Path

import numpy as np

from benchmarks.arms import add_settings
from benchmarks.fronts.plan import TASKS, cell, cells, published
from benchmarks.fronts.report import Result, write_report
from jmorl.display.console import PlainConsole
from jmorl.display.text import duration
from jmorl.experiments.cells import Cell, Places, known, missing
from jmorl.experiments.progress import Part, make_all
from jmorl.experiments.record import read_record
from jmorl.experiments.runner import make
from jmorl.experiments.tables import million
from jmorl.learning.devices import use_all_cpu_cores

HERE = Path(__file__).parent
SHARES = np.array([0.1, 0.25, 0.5, 0.75, 1.0])  # of the budget, after which a pilot's hypervolume is printed


def main() -> None:
    """Make the runs of all tasks, or of those named, and the report."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=TASKS, default=list(TASKS), metavar="ENV", help="of these tasks")
    parser.add_argument("--report", action="store_true", help="make no runs")
    parser.add_argument("--work", type=Path, default=Path("runs/fronts"), help="for run folders (default %(default)s)")
    parser.add_argument(
        "--pilot", type=int, nargs="+", metavar="SEED", help="make runs with these seeds, not the report"
    )
    add_settings(parser)
    options = parser.parse_args()
    if options.set and not options.pilot:
        parser.error("--set is for pilots: say --pilot with seeds")
    use_all_cpu_cores()
    if options.pilot:
        for env in options.only:
            for seed in options.pilot:
                print(_pilot(env, seed, options.set, options.work / "pilots"), flush=True)
        return
    console = PlainConsole()
    places = Places(HERE / "records", options.work)
    if not options.report:
        make_all([Part(env, cells(env)) for env in options.only], places, 1, console)
    records = known([cell for env in TASKS for cell in cells(env)], places)
    console.print(f"report: {write_report(HERE, records)}", soft_wrap=True)


def _pilot(env: str, seed: int, settings: dict[str, dict[str, str]], work: Path) -> str:
    """Make a run, or find it, and say how its hypervolume grew."""
    config = cell(env, "PGMORL", seed).config.replace(**settings)
    pilot, places = Cell(config.identity(), config), Places(work / "records", work / "work")
    made = make([pilot], places, lambda *_: None)[0] if missing([pilot], places) else read_record(places.record(pilot))
    result, there = Result(made), published(env)
    marks = np.searchsorted(made.steps, SHARES * made.total_steps).clip(max=len(made.steps) - 1)
    growth = ", ".join(f"{result.hypervolumes[mark]:.4g} at {million(made.steps[mark])}" for mark in marks)
    reached = result.reached(there.hypervolume)
    when = f"at the published mean after {duration(reached[1])}" if reached else "not at the published mean"
    return f"{env} seed {seed}: {growth}; {duration(made.total_seconds)}, front of {len(result.front)}; {when}"


if __name__ == "__main__":
    main()

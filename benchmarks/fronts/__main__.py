"""Train on the tasks of PGMORL's authors, and write REPORT.md with what is published beside it.

    python -m benchmarks.fronts              make the runs that are missing, then the report
    python -m benchmarks.fronts --report     only the report, from the records there are

Runs that were interrupted go on where they were.
"""

import argparse
from pathlib import Path

from benchmarks.fronts.plan import TASKS, cells
from benchmarks.fronts.report import write_report
from jmorl.display.console import PlainConsole
from jmorl.experiments.cells import Places, known
from jmorl.experiments.progress import Part, make_all

HERE = Path(__file__).parent


def main() -> None:
    """Make the runs of all tasks, or of those named, and the report."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=TASKS, default=list(TASKS), metavar="ENV", help="of these tasks")
    parser.add_argument("--report", action="store_true", help="make no runs")
    parser.add_argument("--work", type=Path, default=Path("runs/fronts"), help="for run folders (default %(default)s)")
    options = parser.parse_args()
    console = PlainConsole()
    places = Places(HERE / "records", options.work)
    if not options.report:
        make_all([Part(env, cells(env)) for env in options.only], places, 1, console)
    records = known([cell for env in TASKS for cell in cells(env)], places)
    console.print(f"report: {write_report(HERE, records)}", soft_wrap=True)


if __name__ == "__main__":
    main()

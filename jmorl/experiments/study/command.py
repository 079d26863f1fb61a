"""`jmorl study`: the runs of a plan that are missing, one after the other, then the report."""

from pathlib import Path

from jmorl.config import ConfigError
from jmorl.display.console import PlainConsole
from jmorl.experiments.cells import Places, distinct, known
from jmorl.experiments.progress import Part, make_all
from jmorl.experiments.study.plan import read_plan
from jmorl.experiments.study.report import write_report

FRESH_EPISODES = 1000  # on which results are scored after their runs


def make_study(plan: Path, run: bool = True, out: Path | None = None, work: Path | None = None) -> Path:
    """Make what is missing of a plan, and write the report; without `run` only that. Returns its path.

    The records of the runs and the report go into `out`, by default the plan's folder. Raises ConfigError with all that
    is wrong with the plan before anything is made.
    """
    console = PlainConsole()
    study = read_plan(plan)
    out = out or plan.parent
    if out.exists() and not out.is_dir():
        raise ConfigError([f"out: {out} is a file; name a folder"])
    out.mkdir(parents=True, exist_ok=True)
    places = Places(out / "records", work or Path("runs/study"))
    cells = {part.name: distinct(study.cells(part)) for part in study.parts}
    every = distinct(cell for some in cells.values() for cell in some)
    elsewhere = study.made_elsewhere(every)
    if run:
        parts = [Part(name, [cell for cell in some if cell.key not in elsewhere]) for name, some in cells.items()]
        make_all(parts, places, 1, console, FRESH_EPISODES)
    path = write_report(study, out, {**elsewhere, **known(every, places)}, f"jmorl study {plan}")
    console.print(f"report: {path}", soft_wrap=True)
    return path

"""`jmorl paper`: the runs that are missing, one after the other, then the report."""

from collections.abc import Sequence
from pathlib import Path

from jmorl.display.console import PlainConsole
from jmorl.experiments.cells import Places, distinct, known
from jmorl.experiments.progress import Part, make_all
from jmorl.paper.by_default import study_runs
from jmorl.paper.pilots import propose
from jmorl.paper.plan import CHEETAH, ITEMS, NAMES, SHORTER, Plan, in_order, named
from jmorl.paper.report import Scope, write_report


def make_paper(
    only: Sequence[str] | None,
    units: Sequence[str],
    seeds: Sequence[int] | None,
    quick: bool,
    run: bool,
    out: Path | None = None,
    work: Path | None = None,
    together: int = 1,
) -> None:
    """Make what is missing of the items named, all by default, and write the report; without `run` only that.

    Up to `together` runs are made in one program. `only` may have "targets": runs on other seeds, from which targets
    for HalfCheetah are proposed.
    """
    console = PlainConsole()
    plan = Plan(quick, tuple(seeds) if seeds else None)
    out = out or Path("runs/paper-quick" if quick else "benchmarks/paper")
    places = Places(out / "records", work or (out / "work" if quick else Path("runs/paper")))
    items = [item for item in ITEMS.values() if only is None or item.name in only]
    later = {(item.name, each): plan.later(item, each) for item, each in in_order(items, units)}
    parts = []
    for item, each in in_order(items, units):
        first = [cell for cell in plan.cells(item, each) if cell not in later[item.name, each]]
        parts.append(Part(f"{item.name}, {each} units", first))
    if only and "targets" in only:
        parts.append(Part(f"targets, {NAMES[CHEETAH]}, raw units", plan.pilots(CHEETAH)))
    parts += [Part(f"{name}, {named(SHORTER)}, {each} units", cells) for (name, each), cells in later.items() if cells]
    if run:
        make_all(parts, places, together, console)
    if only and "targets" in only:
        proposed = propose(CHEETAH, known(plan.pilots(CHEETAH), places))
        console.print(proposed, soft_wrap=True)
    if items:
        cells = distinct(cell for part in parts for cell in part.cells)
        path = write_report(
            out, Scope(plan, items, units, study_runs(out.parent / "study" / "records")), known(cells, places)
        )
        console.print(f"report: {path}", soft_wrap=True)

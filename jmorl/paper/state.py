"""What a report rests on: runs, time, commits, and what is missing or broke down."""

from collections.abc import Iterator, Sequence

from jmorl.display.text import duration, short_count
from jmorl.experiments import tables
from jmorl.experiments.cells import Cell, distinct
from jmorl.experiments.record import RunRecord
from jmorl.paper import markdown
from jmorl.paper.data import published
from jmorl.paper.plan import ITEMS, NAMES, Item, Plan, in_order
from jmorl.paper.results import Records

Wanted = Sequence[tuple[Item, str, Sequence[Cell]]]
NO_COMMIT = "no commit"


def state(plan: Plan, items: Sequence[Item], units: Sequence[str], records: Records) -> str:
    """Write up what a report rests on."""
    wanted = [(item, each, plan.cells(item, each)) for item, each in in_order(items, units)]
    there = [records[cell.key] for cell in _distinct(wanted) if cell.key in records]
    devices = ", ".join(sorted({run.device for run in there}))
    total = markdown.totals(_steps(there), _seconds(there), len(there))
    parts = [
        f"It rests on {total}" + (f" on {devices}." if devices else "."),
        _commits(there),
        tables.table(["part", "units", "runs", "steps", "time"], _parts(wanted, records)),
        _beside_the_papers(wanted, records),
        _waits(there),
        "\n".join([*_missing(wanted, records), *_broken(wanted, records)]),
    ]
    return "\n\n".join(filter(None, parts))


def _distinct(wanted: Wanted) -> list[Cell]:
    return distinct(cell for _, _, some in wanted for cell in some)


def _steps(runs: Sequence[RunRecord]) -> int:
    return sum(run.total_steps for run in runs)


def _seconds(runs: Sequence[RunRecord]) -> float:
    """Return how long the machine was busy. Runs made together begin together: the longest has the time of all."""
    alone = sum(run.machine_seconds for run in runs if not run.together)
    longest: dict[tuple[str, ...], float] = {}
    for run in runs:
        if run.together:
            longest[run.together] = max(run.machine_seconds, longest.get(run.together, 0.0))
    return alone + sum(longest.values())


def _commits(runs: Sequence[RunRecord]) -> str:
    """Name the commits of the code that made the records."""
    known = [(run.commit or NO_COMMIT)[:12] for run in runs]
    counts = {commit: known.count(commit) for commit in sorted(set(known))}
    if not counts:
        return ""
    told = ", ".join(f"{commit} ({count} runs)" for commit, count in counts.items())
    mixed = " They are of several commits, between which the code may have changed." if len(counts) > 1 else ""
    return f"Commits of the records: {told}.{mixed}"


def _waits(runs: Sequence[RunRecord]) -> str:
    shared = sum(1 for run in runs if run.together)
    if not shared:
        return ""
    return (
        f"{shared} runs were made several at a time in one program: what they took is counted once for those of one "
        "program, with the compilation of smaller ones for those that were left, and nothing is said of how long a "
        "person would wait in them."
    )


def _parts(wanted: Wanted, records: Records) -> Iterator[list[str]]:
    """Yield what each part took. A run that several need counts for the first of them."""
    counted: set[str] = set()
    for item, units, cells in wanted:
        there = [records[cell.key] for cell in cells if cell.key in records and cell.key not in counted]
        counted |= {cell.key for cell in cells}
        yield [item.name, units, str(len(there)), short_count(_steps(there)), duration(_seconds(there))]


def _beside_the_papers(wanted: Wanted, records: Records) -> str:
    """Lay out the time of each environment's runs, and of its table's beside the published."""
    lines = []
    for env, units in dict.fromkeys((item.env, units) for item, units, _ in wanted):
        every = distinct(c for item, each, some in wanted if (item.env, each) == (env, units) for c in some)
        table = next(item for item in ITEMS.values() if (item.env, item.kind) == (env, "steps to targets"))
        cells = [cell for item, each, some in wanted if (item, each) == (table, units) for cell in some]
        theirs = published().tables[table.name].seconds
        times = [_seconds([records[cell.key] for cell in some if cell.key in records]) for some in (every, cells)]
        lines.append([NAMES[env], units, *map(duration, times), duration(theirs)])
    text = (
        "All runs of an environment, those of its table, and the paper's time for that table: the time per run of each "
        "row times its five runs. One run of PGMORL serves all targets here."
    )
    return f"{text}\n\n{tables.table(['environment', 'units', 'all runs', 'table', 'table in the paper'], lines)}"


def _missing(wanted: Wanted, records: Records) -> Iterator[str]:
    for item, units, some in wanted:
        absent = [cell.key for cell in some if cell.key not in records]
        if absent:
            yield f"- Missing: {item.name} in {units} units, {len(absent)} of {len(some)} runs: {_named(absent)}."


def _named(keys: Sequence[str]) -> str:
    """Write the keys of cells, with the seeds of the same kind together."""
    seeds: dict[str, list[str]] = {}
    for key in keys:
        kind, _, seed = key.rpartition("-seed-")
        seeds.setdefault(kind, []).append(seed)
    return "; ".join(f"{kind}, seed{'s' * (len(some) > 1)} {', '.join(some)}" for kind, some in seeds.items())


def _broken(wanted: Wanted, records: Records) -> Iterator[str]:
    for cell in _distinct(wanted):
        record = records.get(cell.key)
        if record and record.fault:
            yield f"- Broke down: {cell.key} after {short_count(record.total_steps)} steps: {record.fault}."

"""REPORT.md: every published table and figure beside ours, made from the records there are."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from jmorl.display.text import duration, short_count
from jmorl.paper import markdown, verdicts
from jmorl.paper.data import PublishedTable, honest, published
from jmorl.paper.figures import draw
from jmorl.paper.plan import NAMES, Cell, Item, Plan, distinct, in_order
from jmorl.paper.results import Records, TargetRow, curves, final_policies, target_rows
from jmorl.storage.files import write_text

TITLES = {
    "steps to targets": "steps until a target is reached",
    "greatest utility": "greatest utility of the archive",
    "mean utility": "mean utility of the population, the performance buffer",
    "final policies": "final policies, interactive and by E-NAUTILUS",
}

INTRODUCTION = """Made by `jmorl paper` from the records in `records/`; nothing here is written by hand.

The paper's experiments are repeated twice. In **raw units** a score is a mean undiscounted return with deterministic
actions, which means the same in every run and at every time; methods have this project's default settings, and targets
were fixed beforehand. In **paper units** policies are scored as the authors' program scores them, with sampled actions,
by rewards divided by a running deviation (sigma) that every policy scored so far has moved; settings and targets are
the published ones. Such units drift: fixed policies reach targets with nothing learned (`python -m benchmarks.drift`).
What is not copied are defects of that program: there the bounds take the place of the chosen policy's values, all
policies share their observation statistics in evaluation, and the discount that is set never reaches the agents.

Steps are environment steps used for learning. A run that does not reach a target is censored at its budget, so that
mean steps are *restricted* means: steps used, time-outs at the budget. Brackets are 95 % bootstrap intervals of a mean
over seeds. Times leave compilation out."""


DIFFERENT_UNITS = (
    "Values of different runs are in different units here, so that comparing them, as the paper does, means little."
)


@dataclass(frozen=True)
class Scope:
    """What a report is of."""

    plan: Plan
    items: Sequence[Item]
    units: Sequence[str]


def write_report(folder: Path, scope: Scope, records: Records) -> Path:
    """Write REPORT.md, and its figures beside it. Runs that are missing are said to be."""
    sections = [f"# The paper's experiments{', at a reduced size' if scope.plan.quick else ''}", INTRODUCTION]
    sections.append(_state(scope, records))
    for item in scope.items:
        drawn = draw(folder / "figures", scope.plan, item, scope.units, records)
        pictures = [f"![{item.name}, {units} units](figures/{path.name})" for units, path in drawn.items()]
        sections += [_heading(item), *_section(scope, item, records), *pictures]
    path = folder / "REPORT.md"
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, "\n\n".join(filter(None, sections)) + "\n")
    return path


def _heading(item: Item) -> str:
    name = item.name.replace("table", "Table ").replace("fig", "Figure ")
    normalised = " (normalised utilities)" if item.normalised else ""
    return f"## {name}: {NAMES[item.env]}, {TITLES[item.kind]}{normalised}"


def _state(scope: Scope, records: Records) -> str:
    """What the report rests on, and what is missing."""
    wanted = [(item, units, scope.plan.cells(item, units)) for item, units in in_order(scope.items, scope.units)]
    cells = distinct(cell for _, _, some in wanted for cell in some)
    there = [records[cell.key] for cell in cells if cell.key in records]
    steps, seconds = sum(run.generations[-1].steps for run in there), sum(float(run.seconds[-1]) for run in there)
    devices = ", ".join(sorted({run.device for run in there}))
    lines = [f"It rests on {markdown.totals(steps, seconds, len(there))}" + (f" on {devices}." if devices else ".")]
    lines += ["", markdown.table(["part", "units", "runs", "steps", "time"], _parts(wanted, records)), ""]
    for item, units, some in wanted:
        absent = sum(cell.key not in records for cell in some)
        if absent:
            lines.append(f"- Missing: {item.name} in {units} units, {absent} of {len(some)} runs.")
        if not some:
            lines.append(f"- Missing: {item.name} in {units} units, whose targets are not fixed yet.")
    return "\n".join(lines)


def _parts(wanted: Sequence[tuple[Item, str, Sequence[Cell]]], records: Records) -> Iterator[list[str]]:
    """What each part took. A run that several need counts for the first of them, and what is left may be nothing."""
    counted: set[str] = set()
    for item, units, cells in wanted:
        there = [records[cell.key] for cell in cells if cell.key in records and cell.key not in counted]
        counted |= {cell.key for cell in cells}
        steps = sum(run.generations[-1].steps for run in there)
        seconds = sum(float(run.seconds[-1]) for run in there)
        yield [item.name, units, str(len(there)), short_count(steps), duration(seconds)]


def _section(scope: Scope, item: Item, records: Records) -> list[str]:
    if item.kind == "steps to targets":
        rows = {units: target_rows(scope.plan, item, units, records) for units in scope.units}
        return _table_section(published().tables[item.name], item, {u: each for u, each in rows.items() if each})
    claims = published().claims[item.name]
    parts = [f"The paper: {claims['text']}"]
    for units in scope.units:
        weights = scope.plan.user_weights(item, units)
        if item.kind == "final policies":
            found = final_policies(scope.plan, item, units, records)
            parts += [f"**{units} units.** {verdicts.finals_verdict(found, weights)}", _normalised(item, units)]
            parts.append(DIFFERENT_UNITS if units == "paper" else "")
            parts.append(markdown.final_table(found, weights) if found else "")
        else:
            rows_of = curves(scope.plan, item, units, records)
            text = verdicts.curve_verdict(claims, rows_of) if rows_of else "Not to be judged yet: runs are missing."
            parts.append(f"**{units} units.** {text}")
            parts.append(markdown.ends(rows_of, item.kind == "mean utility") if rows_of else "")
    return parts


def _table_section(table: PublishedTable, item: Item, rows: Mapping[str, Sequence[TargetRow]]) -> list[str]:
    """A table of steps to targets: side by side, verdicts, and in each kind of units what is behind them."""
    parts = [markdown.side_by_side(table, rows), "Published are mean ± standard deviation; all in million steps."]
    for units, each in rows.items():
        targets = dict.fromkeys(row.target for row in each)
        by_target = {name: [row for row in each if row.target == name] for name in targets}
        parts.append(f"### In {units} units\n\n{verdicts.table_verdict(table, by_target)}")
        parts.append("\n".join(f"- {verdicts.target_verdict(table, pair, units)}" for pair in by_target.values()))
        if units == "raw":
            parts.append(f"The targets: {honest(item.env).targets_reason}")
        parts += [markdown.seed_by_seed(each), markdown.costs(each, table)]
        if units == "paper":
            parts.append(markdown.honesty(each))
        parts += ["What the searches were doing:", markdown.mechanisms(each)]
    return parts


def _normalised(item: Item, units: str) -> str:
    if not item.normalised:
        return ""
    if units == "paper":
        return "Dividing both objectives by the same constant changes no decision: the runs are those of Figure 9."
    return honest(item.env).span_reason

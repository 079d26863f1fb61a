"""REPORT.md: every published table and figure beside ours, made from the records there are."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from jmorl.experiments import tables
from jmorl.experiments.targets import TargetRow
from jmorl.paper import claims, markdown
from jmorl.paper.acceptance import ACCEPTANCE_CRITERION, acceptance_verdict, drift_told, explanations
from jmorl.paper.by_default import StudyRuns, curves_section, default_curves, default_targets, targets_section
from jmorl.paper.data import PublishedTable, honest, published
from jmorl.paper.figures import draw
from jmorl.paper.introduction import DEVIATIONS, DIFFERENT_UNITS, INTRODUCTION, MEAN_UTILITY, POOLED, SWAPPED
from jmorl.paper.plan import ITEMS, NAMES, Item, Plan
from jmorl.paper.results import Records, curves, final_policies, target_rows
from jmorl.paper.state import state
from jmorl.paper.verdicts import MISSING, table_verdict, target_verdict
from jmorl.storage.files import write_text

TITLES = {
    "steps to targets": "steps until a target is reached",
    "greatest utility": "greatest utility of the archive",
    "mean utility": "mean utility of the policies just trained",
    "final policies": "final policies, interactive and by E-NAUTILUS",
}


@dataclass(frozen=True)
class Scope:
    """What a report is of."""

    plan: Plan
    items: Sequence[Item]
    units: Sequence[str]
    study: StudyRuns = StudyRuns()  # of the search by default


def write_report(folder: Path, scope: Scope, records: Records) -> Path:
    """Write REPORT.md, and its figures beside it. Runs that are missing are said to be."""
    sections = [f"# The paper's experiments{', at a reduced size' if scope.plan.quick else ''}", INTRODUCTION]
    sections.append(state(scope.plan, scope.items, scope.units, records))
    for item in scope.items:
        drawn = draw(folder / "figures", scope.plan, item, scope.units, records, scope.study)
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


def _section(scope: Scope, item: Item, records: Records) -> list[str]:
    if item.kind == "steps to targets":
        rows = {units: target_rows(scope.plan, item, units, records) for units in scope.units}
        parts = _table_section(published().tables[item.name], item, {u: each for u, each in rows.items() if each})
        return parts + targets_section(default_targets(scope.plan, item, scope.study), rows.get("raw", []))
    parts = [f"The paper: {published().claims[item.name].text}", MEAN_UTILITY if item.kind == "mean utility" else ""]
    for units in scope.units:
        make = _finals_part if item.kind == "final policies" else _curves_part
        parts += make(scope.plan, item, units, records)
    if item.kind != "final policies" and "raw" in scope.units:
        others = curves(scope.plan, item, "raw", records)
        parts += curves_section(default_curves(scope.plan, item, scope.study), others)
    return parts


def _curves_part(plan: Plan, item: Item, units: str, records: Records) -> list[str]:
    rows = curves(plan, item, units, records)
    checks = claims.curve_checks(published().claims[item.name], rows)
    return [
        f"**{units} units.** {claims.conclusion(checks)}",
        DIFFERENT_UNITS if units == "paper" else "",
        markdown.ends(rows) if rows else "",
        markdown.waits(rows, plan.steps(item)) if rows else "",
    ]


def _finals_part(plan: Plan, item: Item, units: str, records: Records) -> list[str]:
    found = final_policies(plan, item, units, records)
    before = final_policies(plan, ITEMS["fig9"], units, records) if item.normalised else {}
    checks = claims.finals_checks(published().claims[item.name], found, before)
    parts = [f"**{units} units.** {claims.conclusion(checks)}", DIFFERENT_UNITS if units == "paper" else ""]
    parts.append(_normalised(item, units))
    if found:
        weights = plan.user_weights(item, units)
        parts += [
            f"{claims.finals_told(found, weights)} {POOLED.format(runs=len(plan.seeds_of(item)))}",
            markdown.final_table(found, weights),
            markdown.final_waits(found, plan.steps(item)),
        ]
    return parts


def _table_section(table: PublishedTable, item: Item, rows: Mapping[str, Sequence[TargetRow]]) -> list[str]:
    """Write up a table of steps to targets: side by side, verdicts, and in each kind of units what is behind them."""
    parts = [markdown.side_by_side(table, rows), DEVIATIONS]
    parts.append(SWAPPED if any(row.std_printed for row in table.rows) else "")
    for units, each in rows.items():
        by_target = {
            name: [row for row in each if row.target == name] for name in dict.fromkeys(r.target for r in each)
        }
        parts.append(f"### In {units} units\n\n{table_verdict(table, by_target)}")
        parts.append(_listed(target_verdict(table, some) for some in by_target.values()))
        if units == "raw":
            parts.append(ACCEPTANCE_CRITERION)
            parts.append(_listed(acceptance_verdict(table, some) for some in by_target.values()))
            parts.append(f"The targets: {honest(item.env).targets_reason}")
        else:
            parts.append(_listed(drift_told(row) for row in each if row.times.successes))
            parts.append(_explained(table, by_target))
        parts += [tables.seed_by_seed(each), markdown.costs(each, table)]
        parts.append(markdown.honesty(each) if units == "paper" else "")
        parts += ["What the searches were doing:", tables.mechanisms(each)]
    return parts if rows else [*parts, MISSING]


def _explained(table: PublishedTable, rows: Mapping[str, Sequence[TargetRow]]) -> str:
    lines = [line for some in rows.values() for line in explanations(table, some)]
    return f"Where successes or order are not the published ones:\n\n{_listed(lines)}" if lines else ""


def _listed(lines: Iterable[str]) -> str:
    return "\n".join(f"- {line}" for line in lines)


def _normalised(item: Item, units: str) -> str:
    if not item.normalised:
        return ""
    if units == "paper":
        return "Dividing both objectives by the same constant changes no decision: the runs are those of Figure 9."
    return honest(item.env).span_reason

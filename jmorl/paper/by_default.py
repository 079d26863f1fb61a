"""The search by default beside the paper's rule, in raw units: from runs that a study has made."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from jmorl.config import resolve
from jmorl.experiments.record import RunRecord, read_record
from jmorl.experiments.tables import between, gain, share, table
from jmorl.experiments.targets import TargetRow, compared, target_row
from jmorl.paper.plan import Item, Plan
from jmorl.paper.results import Curves, advantage, curves_of

BY_DEFAULT = "by default"  # the name of the method
INTRODUCTION = (
    "### The search by default\n\nThe interactive method above follows the paper's rule. By default its bounds give "
    "way, and users are asked only where their answers so far leave a doubt; targets decide before every generation. "
    "The same seeds, from the runs of `jmorl study benchmarks/study/plan.toml`:"
)


@dataclass(frozen=True)
class StudyRuns:
    """The runs that a study has made, whatever its plan."""

    records: Sequence[RunRecord] = field(default_factory=list)

    def of(self, plan: Plan, item: Item, goal: str) -> dict[int, RunRecord]:
        """Return the runs there are by default for a user or target, by seed; of a quick plan there are none."""
        if plan.quick or not self.records:
            return {}
        found = {}
        for seed in plan.seeds_of(item):
            given = {"env": item.env, "user": plan.goals(item, "raw")[goal], "seed": seed, "steps": plan.steps(item)}
            config = resolve(overrides=given)
            there = [each for each in self.records if config.is_identified_by(each.digest) and each.generations]
            if there:
                found[seed] = there[0]
        return found


def study_runs(folder: Path) -> StudyRuns:
    """Read the records of a study; none where there is no such folder. Raises RecordError."""
    return StudyRuns([read_record(path) for path in sorted(folder.glob("*.json"))])


def default_targets(plan: Plan, item: Item, runs: StudyRuns) -> list[TargetRow]:
    """Return a row for each target that has a run."""
    rows = []
    for name, values in plan.targets(item.env, "raw").items():
        there = runs.of(plan, item, name)
        if there:
            rows.append(target_row(name, values, BY_DEFAULT, tuple(there), tuple(there.values()), plan.steps(item)))
    return rows


def default_curves(plan: Plan, item: Item, runs: StudyRuns) -> list[Curves]:
    """Return the curve of each user that has a run."""
    found = []
    for user, weights in plan.user_weights(item, "raw").items():
        there = runs.of(plan, item, user)
        if there:
            found.append(curves_of(user, BY_DEFAULT, there, weights, item, plan.steps(item)))
    return found


def targets_section(ours: Sequence[TargetRow], others: Sequence[TargetRow]) -> list[str]:
    """Lay out steps to targets by default beside all other rows, and what is saved against each."""
    head = ["target", "by default", "reached", "against", "steps", "reached", "million steps saved by default"]
    lines = []
    for row in ours:
        mine = [row.target, between(row.times.restricted_mean), share(row.times.successes, len(row.seeds))]
        for other in (each for each in others if each.target == row.target):
            found = compared(row, other)
            used = between(other.times.restricted_mean), share(other.times.successes, len(other.seeds))
            lines.append([*mine, other.method, *used, f"{between(found)}, {found.certainty}" if found else ""])
            mine = ["", "", ""]
    return [INTRODUCTION, table(head, lines)] if lines else []


def curves_section(ours: Sequence[Curves], others: Sequence[Curves]) -> list[str]:
    """Lay out the utilities at the end by default beside all other rows."""
    head = ["user", "by default", "questions", "against", "utility", "gained by default"]
    lines = []
    for row in ours:
        asked = ", ".join(str(len(record.asked)) for record in row.records)
        mine = [row.user, f"{row.last.mean():.4g}", asked]
        for other in (each for each in others if each.user == row.user):
            found = advantage(row, other)
            gained = gain(found) if found else ""
            lines.append([*mine, other.method, f"{other.last.mean():.4g}", gained])
            mine = ["", "", ""]
    return [INTRODUCTION, table(head, lines)] if lines else []

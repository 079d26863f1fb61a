"""REPORT.md of a study, made from the records there are."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from jmorl.experiments import tables
from jmorl.experiments.statistics import Times
from jmorl.experiments.study.figures import draw
from jmorl.experiments.study.plan import Study, StudyPart
from jmorl.experiments.study.results import (
    CLOSE,
    GOOD,
    VERY_CLOSE,
    Records,
    UserRow,
    calibration,
    gained,
    target_rows,
    user_rows,
)
from jmorl.experiments.tables import gain, million, number, share, table
from jmorl.storage.files import write_text


def write_report(study: Study, out: Path, records: Records, made_by: str) -> Path:
    """Write the report into the folder, with its figures. Returns its path."""
    sections = [_introduction(study, records, made_by)]
    for part in study.parts:
        sections += _section(study, part, out, records)
    path = out / "REPORT.md"
    write_text(path, "\n\n".join(sections) + "\n")
    return path


def _introduction(study: Study, records: Records, made_by: str) -> str:
    cells = {cell.key for part in study.parts for cell in study.cells(part)}
    seeds = ", ".join(map(str, study.seeds))
    devices = ", ".join(sorted({record.device for record in records.values()})) or "none"
    return (
        f"# What users get, and what they are asked\n\n"
        f"Made by `{made_by}` from {share(len(records), len(cells))} runs, with the seeds {seeds}. Devices: {devices}. "
        f"A row is about the runs there are. Intervals are 95 % ones over seeds."
    )


def _section(study: Study, part: StudyPart, out: Path, records: Records) -> Iterator[str]:
    """Yield the parts of a section."""
    yield f"## {part.name}: {part.env}, {million(part.steps)} steps"
    users, targets = user_rows(study, part, records), target_rows(study, part, records)
    if not users and not targets:
        yield "There are no runs yet."
        return
    yield "Users:\n\n" + "\n".join(f"- {user}: `--user {spec}`" for user, spec in part.users.items())
    figures = draw(out / "figures", part, users, targets)
    if users:
        best = "on the exact front" if part.best else "that any run found"
        yield (
            "Questions, the last one included: median, least and most. Policies shown: in all questions, on average. "
            f"Shortfall: how far the result's utility is below the best {best}, in percent: mean and worst. Of the "
            "front: the same for the best policy of the run's last front. What the result lacks beyond that was lost "
            "by the choice. "
            f"Good: runs within {GOOD:g} %. Steps until the archive has a policy within {CLOSE:g} and {VERY_CLOSE:g} % "
            "of the best: mean, a run that never has one counting as the budget, and how many have one."
        )
        yield _user_table(users)
        if len(study.contenders_of(part)) > 1:
            yield "Utility gained against the other methods, as paired differences (clearly: the interval excludes 0):"
            yield _gains(users, study.contenders_of(part))
    if targets:
        yield tables.steps_used(targets)
        yield tables.seed_by_seed(targets)
    yield from (f"![{path.stem}](figures/{path.name})" for path in figures)
    yield "Forecasts, and confirmed scores against 1,000 episodes or more that the run knows nothing of:"
    yield _calibrations(study, part, records)


def _user_table(rows: Sequence[UserRow]) -> str:
    head = ["user", "method", "runs", "questions", "policies shown", "utility", "shortfall %", "of the front %", "good"]
    head += [f"million steps to {each:g} %" for each in (CLOSE, VERY_CLOSE)]
    lines = [
        [
            *(row.user, row.method, str(len(row.seeds))),
            f"{np.median(row.asked):g} ({row.asked.min()} to {row.asked.max()})" if row.asks else "1, at the end",
            f"{row.shown.mean():.0f}",
            f"{row.utility.mean():.4g}",
            f"{row.shortfall.mean():.2f}, {row.shortfall.max():.2f}",
            f"{row.shortfall_of_front.mean():.2f}, {row.shortfall_of_front.max():.2f}",
            share(row.good, len(row.seeds)),
            *(_times(times) for times in (row.close, row.very_close)),
        ]
        for row in rows
    ]
    return table(head, lines)


def _times(times: Times) -> str:
    reached = share(times.successes, len(times.reached))
    return f"{'≥ ' * (not times.successes)}{np.mean(times.restricted) / 1e6:.2f}, {reached}"


def _gains(rows: Sequence[UserRow], methods: Sequence[str]) -> str:
    """Lay out what the first method gains against each of the others."""
    first = methods[0]
    lines = []
    for user in dict.fromkeys(row.user for row in rows):
        of_user = {row.method: row for row in rows if row.user == user}
        cells = [user]
        for other in methods[1:]:
            found = gained(of_user[first], of_user[other]) if {first, other} <= of_user.keys() else None
            cells.append(gain(found) if found else "")
        lines.append(cells)
    return table(["user", *(f"{first} against {other}" for other in methods[1:])], lines)


def _calibrations(study: Study, part: StudyPart, records: Records) -> str:
    head = [
        "method",
        "values forecast",
        "in their 80 % intervals",
        "results confirmed",
        "within the stated error (99 of 100)",
    ]
    lines = []
    for method in study.contenders_of(part):
        keys = dict.fromkeys(study.cell(part, method, user, seed).key for user in part.users for seed in study.seeds)
        found = calibration([records[key] for key in keys if key in records])
        right = share(found.within, found.confirmed) if found.confirmed else ""
        lines.append([method, str(found.intervals), number(found.held, ".1%"), str(found.confirmed), right])
    return table(head, lines)

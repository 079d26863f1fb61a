"""Sentences that say whether a conclusion of the paper holds, and why: all by rule, from the numbers."""

from collections.abc import Mapping, Sequence

import numpy as np

from jmorl.paper.analysis import Finals, Mechanism, mechanism
from jmorl.paper.data import PublishedTable
from jmorl.paper.results import Curves, TargetRow, advantage, compared
from jmorl.paper.statistics import Interval

NAMES = {"interactive": "the interactive method", "pgmorl": "PGMORL"}


def million(steps: float) -> str:
    return f"{steps / 1e6:.2f} M"


def ahead(difference: float, resolution: float) -> str:
    """Who is ahead, if `difference` is what the interactive method gains; neither within the resolution."""
    return "comparable" if abs(difference) < resolution else "interactive" if difference > 0 else "pgmorl"


def target_verdict(published: PublishedTable, rows: Sequence[TargetRow], units: str) -> str:
    """One target: who needs fewer steps in the paper, who does here, and what may explain a difference."""
    interactive, pgmorl = (next((row for row in rows if row.method == name), None) for name in NAMES)
    target = rows[0].target
    theirs = published.mean_steps(target, "pgmorl") - published.mean_steps(target, "interactive")
    before = ahead(theirs, 0.0)
    difference = compared(interactive, pgmorl) if interactive and pgmorl else None
    if difference is None or interactive is None or pgmorl is None:
        return f"Target {target}: not to be compared yet, as runs of one method are missing."
    now = ahead(difference.mean, _resolution(interactive))
    agreement = "as in the paper" if now == before else f"whereas in the paper {NAMES[before]} is"
    who = "neither method is ahead" if now == "comparable" else f"{NAMES[now]} is ahead"
    successes = f"{interactive.times.successes} and {pgmorl.times.successes} of {len(interactive.seeds)} runs reach it"
    published_successes = " and ".join(str(5 - published.row(target, name).timeouts) for name in NAMES)
    sentences = [
        f"Target {target}: {who}, {agreement}; the interactive method saves {_steps(difference)}, and "
        f"{successes} (published: {published_successes} of 5).",
        *(_against_published(published, row) for row in (interactive, pgmorl) if units == "paper" and now != before),
        *(_drift(row) for row in (interactive, pgmorl) if units == "paper" and row.times.successes),
        _shortfall(interactive, pgmorl, difference),
    ]
    return " ".join(filter(None, sentences))


def _resolution(row: TargetRow) -> float:
    """Half a generation: less cannot be told apart."""
    steps = row.records[0].steps
    return float(steps[1] - steps[0]) / 2 if len(steps) > 1 else float(steps[0]) / 2


def _steps(difference: Interval) -> str:
    sign = "" if difference.excludes_zero else ", too few or too scattered to be sure"
    return f"{million(difference.mean)} steps [{million(difference.low)}, {million(difference.high)}]{sign}"


def _drift(row: TargetRow) -> str:
    """Whether successes in paper units are of policies or of units."""
    if not row.drifted:
        return f"None of {NAMES[row.method]}'s successes is owed to units that moved."
    return (
        f"{row.drifted} of {NAMES[row.method]}'s {_successes(row)} would not be one in the "
        "units after the warm-up: sigma grew until the target was reached."
    )


def _successes(row: TargetRow) -> str:
    return "1 success" if row.times.successes == 1 else f"{row.times.successes} successes"


def _sentence(text: str) -> str:
    return text[0].upper() + text[1:]


def _against_published(published: PublishedTable, row: TargetRow) -> str:
    """Where the order differs: which method needs other steps than published."""
    difference = row.times.restricted_mean.mean - published.mean_steps(row.target, row.method)
    return f"{_sentence(NAMES[row.method])} uses {million(abs(difference))} steps " + (
        "more than published." if difference > 0 else "fewer than published."
    )


def _shortfall(interactive: TargetRow, pgmorl: TargetRow, difference: Interval) -> str:
    """Where the interactive method falls short: what its search was doing in the runs that never arrived."""
    late = difference.mean < 0 or interactive.times.successes < pgmorl.times.successes
    if not late or interactive.times.successes == len(interactive.seeds):
        return ""
    runs = zip(interactive.records, interactive.found, strict=True)
    found = mechanism([record for record, hit in runs if hit is None])
    return f"In its runs that time out, {stuck(found)}."


def stuck(found: Mechanism) -> str:
    """What a search does, as a clause."""
    return (
        f"{found.candidates:.0f} policies lie within the bounds (median), {found.alone:.0%} of the generations have "
        f"nothing but the choice itself to continue, {found.repeated:.0%} of the answers repeat the one before, and "
        f"offspring gain {found.realised_gain:+.1%} of the front's range where {found.predicted_gain:+.1%} was "
        "predicted"
    )


def table_verdict(published: PublishedTable, rows: Mapping[str, Sequence[TargetRow]]) -> str:
    """A whole table: for how many targets the order of the methods is the published one."""
    same, clear, total = 0, 0, 0
    everything = [row for pair in rows.values() for row in pair]
    for target, pair in rows.items():
        if len(pair) == 2 and (difference := compared(*pair)):
            theirs = published.mean_steps(target, "pgmorl") - published.mean_steps(target, "interactive")
            total += 1
            same += ahead(difference.mean, _resolution(pair[0])) == ahead(theirs, 0.0)
            clear += difference.excludes_zero
    if not total:
        return "Not to be judged yet: runs are missing."
    reach = " and ".join(
        f"{NAMES[name]} in {sum(row.times.successes for row in everything if row.method == name)} of "
        f"{sum(len(row.seeds) for row in everything if row.method == name)} runs"
        for name in NAMES
    )
    verdict = "holds" if same == total else "does not hold" if same == 0 else "holds in part"
    return (
        f"The paper's conclusion {verdict}: the methods are in the published order for {same} of {total} targets; "
        f"for {clear} the difference between them clearly is not 0. "
        f"Targets are reached by {reach}."
    )


def curve_verdict(claims: Mapping[str, str], rows: Sequence[Curves]) -> str:
    """A figure of utilities: who ends higher for each user, beside what the text says."""
    sentences = []
    for user in dict.fromkeys(row.user for row in rows):
        pair = [row for name in NAMES for row in rows if (row.user, row.method) == (user, name)]
        difference = advantage(*pair) if len(pair) == 2 else None
        if difference is None:
            sentences.append(f"User {user}: not to be compared yet, as runs of one method are missing.")
            continue
        now = "comparable" if not difference.excludes_zero else ahead(difference.mean, 0.0)
        who = "neither is clearly ahead" if now == "comparable" else f"{NAMES[now]} ends higher"
        before = "both are comparable" if claims[user] == "comparable" else f"{NAMES[claims[user]]} ends higher"
        agreement = "as the paper says" if now == claims[user] else f"the paper says that {before}"
        sentences.append(
            f"User {user}: {who} (difference {difference.mean:+.3g} [{difference.low:+.3g}, {difference.high:+.3g}]); "
            f"{agreement}."
        )
    return " ".join(sentences)


def finals_verdict(found: Mapping[str, Finals], weights: Mapping[str, Sequence[float]]) -> str:
    """Final policies: whose utility is greater, and who dominates whom."""
    sentences = []
    for user, finals in found.items():
        w = np.array(weights[user])
        ours, theirs = finals.interactive @ w, float(finals.enautilus @ w)
        better = int((ours > theirs).sum())
        dominated = int((~finals.kept).sum())
        fate = "not dominated" if finals.enautilus_kept else "dominated by one of them"
        sentences.append(
            f"User {user}: {better} of {len(ours)} interactive runs end on a greater utility than PGMORL with "
            f"E-NAUTILUS on the pooled archives (mean {ours.mean():.4g}, best {ours.max():.4g}, against {theirs:.4g}); "
            f"{dominated} of them are dominated, and E-NAUTILUS's policy is {fate}."
        )
    return " ".join(sentences) or "Not to be judged yet: runs are missing."

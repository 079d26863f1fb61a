"""Sentences that say whether a conclusion of the paper's tables holds, and why: all by rule, from the numbers."""

from collections.abc import Mapping, Sequence

from jmorl.config import Config
from jmorl.experiments.diagnostics import Mechanism, mechanism
from jmorl.experiments.statistics import Difference
from jmorl.experiments.tables import million, number, share
from jmorl.experiments.targets import TargetRow
from jmorl.paper.data import PublishedTable
from jmorl.paper.plan import named
from jmorl.paper.results import Pair, pair_of

MISSING = "Not to be judged yet: runs are missing."
METHODS = ("interactive", "pgmorl")  # those published


def ahead(difference: float, resolution: float) -> str:
    """Name who is ahead, if `difference` is what the interactive method gains; neither within the resolution."""
    return "comparable" if abs(difference) < resolution else "interactive" if difference > 0 else "pgmorl"


def published_order(published: PublishedTable, target: str) -> str:
    """Name the method that needs fewer steps in the paper."""
    return ahead(published.mean_steps(target, "pgmorl") - published.mean_steps(target, "interactive"), 0.0)


def order(pair: Pair) -> str:
    """Name the method that needs fewer steps here; half a generation cannot be told apart."""
    config = Config.model_validate(pair.interactive.records[0].config)
    return ahead(pair.difference.mean, config.population.iterations * config.steps_per_iteration / 2)


def target_verdict(published: PublishedTable, rows: Sequence[TargetRow]) -> str:
    """Judge one target: which method needs fewer steps in the paper, and which does here."""
    target, pair = rows[0].target, pair_of(rows)
    if pair is None:
        return f"Target {target}: not to be compared yet, as runs of one method are missing."
    now, before = order(pair), published_order(published, target)
    agreement = "as in the paper" if now == before else f"whereas in the paper {named(before)} is"
    baseline = named(pair.baseline.method)
    who = {"comparable": "neither method", "interactive": named("interactive"), "pgmorl": baseline}[now]
    successes = " and ".join(share(row.times.successes, len(row.seeds)) for row in pair.rows)
    theirs = " and ".join(str(published.row(target, method).successes) for method in METHODS)
    return (
        f"Target {target}: {who} is ahead, {agreement}; the interactive method saves {steps_saved(pair.difference)} "
        f"against {baseline}{_better_of(pair)}, and {successes} runs reach it (published: {theirs} of 5)."
        f"{_faults(pair)}"
    )


def _better_of(pair: Pair) -> str:
    if not pair.others:
        return ""
    others = " and ".join(
        f"{named(row.method)}: {million(row.times.restricted_mean.mean)}, "
        f"{share(row.times.successes, len(row.seeds))} reach it"
        for row in pair.others
    )
    return f", the better of PGMORL's two rows (the other, {others})"


def _faults(pair: Pair) -> str:
    told = [f"{row.faults} of {named(row.method)}'s" for row in pair.rows if row.faults]
    return f" Runs that broke down, {' and '.join(told)}, count as not reaching it unless they had before." * bool(told)


def steps_saved(difference: Difference) -> str:
    """Return the difference in words."""
    between = f"[{million(difference.low)}, {million(difference.high)}]"
    return f"{million(difference.mean)} steps {between} ({difference.certainty})"


def stuck(found: Mechanism) -> str:
    """Write how a search gets on, as a clause."""
    parts = [
        f"policies that can be continued number {number(found.candidates, '.0f', '0')} (median)",
        f"{number(found.alone, '.0%', 'none')} of the generations have nothing but the choice itself to continue",
        f"{number(found.repeated, '.0%', 'none')} of the answers repeat the one before",
    ]
    gains = (
        f", and offspring gain {found.realised_gain:+.1%} of the front's range where {found.predicted_gain:+.1%} was "
        "predicted"
    )
    return ", ".join(parts) + (gains if found.realised_gain == found.realised_gain else "")


def shown(rows: Sequence[TargetRow]) -> str:
    """Write the mechanism behind a row: of the runs that never arrived, or else of all."""
    late = [record for row in rows for record in row.late]
    which = "in its runs that never arrive" if late else "in its runs"
    return f"{which}, {stuck(mechanism(late or [record for row in rows for record in row.records]))}"


def table_verdict(published: PublishedTable, rows: Mapping[str, Sequence[TargetRow]]) -> str:
    """Judge a whole table: for how many targets the order of the methods is the published one, and clearly so."""
    pairs = {target: pair for target, some in rows.items() if (pair := pair_of(some))}
    if not pairs:
        return MISSING
    same = [name for name, pair in pairs.items() if order(pair) == published_order(published, name)]
    clear = [name for name, pair in pairs.items() if pair.difference.clear and order(pair) != "comparable"]
    sure, opposite = [n for n in same if n in clear], [n for n in clear if n not in same]
    total = len(pairs)
    verdict = "holds" if len(sure) == total else "does not hold" if not same else "holds in part"
    reach = " and ".join(_reach(method, rows) for method in METHODS)
    return (
        f"The paper's conclusion {verdict}, because the methods are in the published order for {_of(same, total)}, "
        f"clearly so for {_of(sure, total)}, and clearly in the other for {_of(opposite, total)}. "
        f"Targets are reached by {reach}."
    )


def _of(names: Sequence[str], total: int) -> str:
    return f"{len(names)} of {total} targets" + (f" ({', '.join(names)})" if names else "")


def _reach(method: str, rows: Mapping[str, Sequence[TargetRow]]) -> str:
    some = [row for each in rows.values() for row in each if row.method == method]
    runs = sum(len(row.seeds) for row in some)
    return f"{named(method)} in {share(sum(row.times.successes for row in some), runs)} runs"


def against_published(published: PublishedTable, row: TargetRow) -> str:
    """Write how many steps a method uses beside the published ones, as a clause."""
    difference = row.times.restricted_mean.mean - published.mean_steps(row.target, row.method)
    return f"it uses {million(abs(difference))} steps " + (
        "more than published" if difference > 0 else "fewer than published"
    )

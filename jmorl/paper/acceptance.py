"""Acceptance of the results: in raw units by a criterion, in paper units by explaining what is not as published.

The acceptance criterion, for each target: the interactive method succeeds as often as PGMORL and as the best published
row, and for targets B and C in fewer steps than PGMORL.
"""

from collections.abc import Sequence

from jmorl.experiments.statistics import Difference
from jmorl.experiments.tables import million, share
from jmorl.experiments.targets import TargetRow
from jmorl.paper.data import PublishedTable
from jmorl.paper.drift import at_the_start, by_untrained, drifted, prevented
from jmorl.paper.plan import named
from jmorl.paper.results import Pair, pair_of
from jmorl.paper.verdicts import METHODS, against_published, order, published_order, shown, steps_saved

ACCEPTANCE_CRITERION = (
    "The acceptance criterion: the interactive method succeeds as often as PGMORL and as the best published row, and "
    "for targets B and C in fewer steps."
)
FASTER = ("B", "C")  # targets for which the criterion asks for fewer steps, too

UNCOPIED = (
    "by elimination, of what their program does and this one does not: its bounds in place of the chosen policy's "
    "values, observation statistics shared by all policies, reward scales of each training environment, no question "
    "before the first generation"
)


def acceptance_verdict(published: PublishedTable, rows: Sequence[TargetRow]) -> str:
    """Say whether one target meets the acceptance criterion; with the mechanism of the search where it does not."""
    target, pair = rows[0].target, pair_of(rows)
    if pair is None:
        return f"Target {target}: not to be judged yet, as runs of one method are missing."
    ours, theirs = pair.rows
    best = max(published.row(target, method).successes for method in METHODS)
    misses = _misses(pair, best / 5)
    counts = (
        f"the interactive method succeeds in {share(ours.times.successes, len(ours.seeds))} runs, "
        f"{named(theirs.method)} in {share(theirs.times.successes, len(theirs.seeds))}, the best published row in "
        f"{best} of 5"
    )
    steps = (
        f"it uses {million(ours.times.restricted_mean.mean)} steps against "
        f"{million(theirs.times.restricted_mean.mean)} and saves {steps_saved(pair.difference)}"
        + ("" if target in FASTER else ", which is not asked for here")
    )
    if not misses:
        return f"Target {target}: met{_how_surely(target, pair.difference)}. {_sentence(counts)}; {steps}."
    return (
        f"Target {target}: not met: {' and '.join(misses)}. {_sentence(counts)}; {steps}. {_sentence(shown([ours]))}."
    )


def _misses(pair: Pair, best: float) -> list[str]:
    """Return the parts of the criterion that are not met. `best`: the successful share of the best published row."""
    ours, theirs = (row.times.successes / len(row.seeds) for row in pair.rows)
    return [
        *(["it succeeds less often than PGMORL"] if ours < theirs else []),
        *(["it succeeds less often than the best published row"] if ours < best else []),
        *(["it does not need fewer steps"] if pair.interactive.target in FASTER and pair.difference.mean <= 0 else []),
    ]


def _how_surely(target: str, difference: Difference) -> str:
    """Write how sure the steps saved are, where the criterion asks for them."""
    return f", in steps {difference.certainty}" if target in FASTER else ""


def explanations(published: PublishedTable, rows: Sequence[TargetRow]) -> list[str]:
    """Explain the differences on one target in paper units.

    There is a sentence for each method whose successes, or place, are not the published ones. The cause is moving
    units, a defect that is not copied, or our own shortfall.
    """
    pair = pair_of(rows)
    if pair is None:
        return []
    order_differs = order(pair) != published_order(published, pair.interactive.target)
    told = [row for row in pair.rows if _successes_differ(published, row) or order_differs and row.times.successes]
    return [_explanation(published, row) for row in told]


def _successes_differ(published: PublishedTable, row: TargetRow) -> bool:
    return row.times.successes / len(row.seeds) != published.row(row.target, row.method).successes / 5


def _explanation(published: PublishedTable, row: TargetRow) -> str:
    theirs = published.row(row.target, row.method).successes
    where = (
        f"Target {row.target}, {named(row.method)}: {share(row.times.successes, len(row.seeds))} succeed (published: "
        f"{theirs} of 5); {against_published(published, row)}"
    )
    ours, before = row.times.successes / len(row.seeds), theirs / 5
    fewer_steps = row.times.restricted_mean.mean < published.mean_steps(row.target, row.method)
    better = ours > before or ours == before and fewer_steps
    return f"{where}. {_cause_of_more(row) if better else _cause_of_less(row)}"


def _cause_of_more(row: TargetRow) -> str:
    if at_the_start(row):
        return (
            f"An uncopied defect: {at_the_start(row)} of the successes come with generation 0 ({by_untrained(row)} by "
            "untrained policies), where their program does not check."
        )
    if drifted(row):
        return (
            f"Drift: {drifted(row)} of the {row.times.successes} successes are of no trained policy that would do in "
            "the units after the warm-up."
        )
    return f"An uncopied defect, {UNCOPIED}; none of the successes is owed to moving units."


def _cause_of_less(row: TargetRow) -> str:
    if prevented(row):
        return (
            f"Drift: {prevented(row)} of the runs that never arrive have a trained policy that would do in the units "
            "after the warm-up."
        )
    return f"Our own shortfall: moving units hide no success. {_sentence(shown([row]))}."


def drift_told(row: TargetRow) -> str:
    """Say whether successes in paper units are owed to policies or to units."""
    of = "1 success" if row.times.successes == 1 else f"{row.times.successes} successes"
    owed = drifted(row)
    if not owed:
        return f"Target {row.target}: none of {named(row.method)}'s {of} is owed to moving units."
    start = f", {by_untrained(row)} of them of policies never trained" if by_untrained(row) else ""
    return (
        f"Target {row.target}: {owed} of {named(row.method)}'s {of} are owed to moving units{start}: no trained "
        "policy found by then would do in the units after the warm-up."
    )


def _sentence(text: str) -> str:
    """Begin a text with a capital letter."""
    return text[0].upper() + text[1:]

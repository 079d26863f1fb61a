"""Verdicts on the paper's figures: each statement of its text by a rule, then the figure by its statements."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from jmorl.experiments.statistics import Difference
from jmorl.experiments.tables import million
from jmorl.paper.analysis import Finals, non_dominated_or_equal
from jmorl.paper.data import Claims
from jmorl.paper.plan import named
from jmorl.paper.results import Curves, curve_pairs
from jmorl.paper.verdicts import MISSING, ahead

SETTLED = 0.05  # of a curve's range from its end: where it has settled
FLAT = 0.1  # of a curve's range: what it may change in its second half


@dataclass(frozen=True)
class Check:
    """One statement. `holds` is None where the runs do not tell, or only by their mean."""

    holds: bool | None
    text: str  # what is found


def conclusion(checks: Sequence[Check]) -> str:
    """Say whether a figure's conclusion holds, and because of which statements."""
    if not checks:
        return MISSING
    found, against, open_ = ([check.text for check in checks if check.holds is each] for each in (True, False, None))
    verdict = "holds" if len(found) == len(checks) else "does not hold" if not found + open_ else "holds in part"
    parts = [
        f"{label}: {'; '.join(texts)}"
        for label, texts in (("as it says", found), ("otherwise", against), ("not clear", open_))
        if texts
    ]
    return (
        f"The paper's conclusion {verdict}, because of {len(checks)} statements {len(found)} are found here, "
        f"{len(open_)} not clearly and {len(against)} not. "
        + " ".join(f"{part[0].upper()}{part[1:]}." for part in parts)
    )


def curve_checks(claims: Claims, rows: Sequence[Curves]) -> list[Check]:
    """Check the statements of a figure of utilities."""
    pairs = list(curve_pairs(rows))
    checks = [_ends(claims.ahead[ours.user], ours, theirs, found) for ours, theirs, found in pairs]
    return checks + [
        check
        for name in claims.also
        for ours, theirs, _ in pairs
        if (check := CURVE_STATEMENTS[name](ours, theirs)) is not None
    ]


def _ends(claimed: str, ours: Curves, theirs: Curves, difference: Difference) -> Check:
    now = ahead(difference.mean, 0.0) if difference.clear else "comparable"
    who = {"interactive": "the interactive method ends higher", "pgmorl": f"{named(theirs.method)} ends higher"}
    text = (
        f"user {ours.user}, {who.get(now, 'neither ends clearly higher')} ({difference.mean:+.3g} "
        f"[{difference.low:+.3g}, {difference.high:+.3g}] against {named(theirs.method)}, {difference.certainty})"
    )
    only_by_mean = now == "comparable" and ahead(difference.mean, 0.0) == claimed
    return Check(None if only_by_mean else now == claimed, text)


def _settles_earlier(ours: Curves, theirs: Curves) -> Check:
    one, other = (_settled(row) for row in (ours, theirs))
    return Check(
        other < one,
        f"user {ours.user}, {named(theirs.method)} settles after {million(other)} steps, the interactive method after "
        f"{million(one)}",
    )


def _settled(row: Curves) -> float:
    """Return the steps after which the mean over seeds stays near its end."""
    course = row.course
    away = np.flatnonzero(np.abs(course - course[-1]) > SETTLED * np.ptp(course))
    return float(row.steps[away[-1] + 1] if len(away) else row.steps[0])


def _stays_flat(ours: Curves, theirs: Curves) -> Check:
    course = theirs.course if theirs.buffer is None else theirs.buffer.mean(axis=0)
    extent = np.ptp(course)
    change = abs(course[-1] - course[len(course) // 2]) / extent if extent > 0 else 0.0
    return Check(
        bool(change <= FLAT),
        f"user {ours.user}, the mean of {named(theirs.method)}'s buffer changes by {change:.0%} of its whole range in "
        "the second half",
    )


def _varies_less(ours: Curves, theirs: Curves) -> Check | None:
    return _varies(ours, theirs, more=False)


def _varies_more(ours: Curves, theirs: Curves) -> Check | None:
    return _varies(ours, theirs, more=True)


def _varies(ours: Curves, theirs: Curves, more: bool) -> Check | None:
    """Compare the standard deviations over the seeds at the end; None for one seed."""
    if min(len(ours.seeds), len(theirs.seeds)) < 2:
        return None
    one, other = (float(row.last.std(ddof=1)) for row in (ours, theirs))
    text = f"user {ours.user}, ends of the interactive method vary by {one:.3g} over seeds, PGMORL's by {other:.3g}"
    return Check(one > other if more else one < other, text)


def _catches_up(ours: Curves, theirs: Curves) -> Check | None:
    """Check for user A that the interactive method is ahead after a quarter of the steps, and behind at the end."""
    if ours.user != "A":
        return None
    early = float(np.interp(ours.steps[-1] / 4, ours.steps, ours.course))
    early -= float(np.interp(ours.steps[-1] / 4, theirs.steps, theirs.course))
    late = float(ours.course[-1] - theirs.course[-1])
    return Check(
        early > 0 > late,
        f"user A, the interactive method is {early:+.3g} ahead after a quarter of the steps and {late:+.3g} at the end",
    )


CURVE_STATEMENTS: Mapping[str, Callable[[Curves, Curves], Check | None]] = {
    "PGMORL settles earlier": _settles_earlier,
    "PGMORL stays flat": _stays_flat,
    "interactive varies less": _varies_less,
    "interactive varies more": _varies_more,
    "PGMORL catches up for A": _catches_up,
}

Found = Mapping[str, Finals]  # by user


def finals_checks(claims: Claims, found: Found, before: Found) -> list[Check]:
    """Check the statements of a figure of final policies. `before`: those of Figure 9, to compare Figure 10 with."""
    if set(found) != {"A", "B", "C"}:
        return []
    return [FINALS_STATEMENTS[name](found, before) for name in claims.also]


def _placed(found: Found) -> tuple[np.ndarray, np.ndarray]:
    """Return the final policies, interactive [users * S, M] and by E-NAUTILUS [users, M], in the front's range."""
    pooled = next(iter(found.values())).pooled
    extent = np.ptp(pooled, axis=0)
    ours = np.vstack([finals.interactive for finals in found.values()])
    theirs = np.vstack([finals.enautilus for finals in found.values()])
    low, extent = pooled.min(axis=0), np.where(extent > 0, extent, 1.0)
    return (ours - low) / extent, (theirs - low) / extent


def _clustered(found: Found, _: Found) -> Check:
    ours, theirs = _placed(found)
    place, spread, other = float(np.median(ours[:, 0])), float(ours[:, 0].std()), float(theirs[:, 0].std())
    text = (
        f"in objective 1 the interactive method's final policies lie at {place:.0%} of the front's range (median), "
        f"spread over {spread:.0%} (standard deviation) where E-NAUTILUS's are over {other:.0%}"
    )
    return Check(place > 0.5 and spread < other, text)


def _nobody_dominated(found: Found, _: Found) -> Check:
    every = np.vstack([finals.everything for finals in found.values()])
    dominated = int((~non_dominated_or_equal(every)).sum())
    return Check(dominated == 0, f"{dominated} of all {len(every)} final policies are dominated by another one")


def _same_pick(found: Found, _: Found) -> Check:
    same = bool(np.array_equal(found["A"].enautilus, found["B"].enautilus))
    return Check(same, f"E-NAUTILUS leads users A and B to {'the same policy' if same else 'different policies'}")


def _less_concentrated(found: Found, before: Found) -> Check:
    if set(before) != set(found):
        return Check(None, "the runs of Figure 9 are missing")
    now, then = (float(_placed(each)[0].std(axis=0).mean()) for each in (found, before))
    text = f"the final policies spread over {now:.0%} of the front's range, where in Figure 9 they do over {then:.0%}"
    return Check(now > then, text)


def _shifted(found: Found, before: Found) -> Check:
    if set(before) != set(found):
        return Check(None, "how far they shift is not known without the runs of Figure 9")
    now, then = (float(_placed(each)[0][:, 1].mean()) for each in (found, before))
    text = f"in objective 2 they lie at {now:.0%} of the front's range (mean), where in Figure 9 they lie at {then:.0%}"
    return Check(now > then, text)


def _dominates(found: Found, _: Found) -> Check:
    counts = {user: int(_dominated_by(found[user]).sum()) for user in ("A", "B")}
    total = len(found["A"].interactive)
    told = " and ".join(f"{count} of {total} for {user}" for user, count in counts.items())
    return Check(
        all(2 * count > total for count in counts.values()),
        f"E-NAUTILUS's policy dominates the interactive method's in {told}",
    )


def _dominated_by(finals: Finals) -> np.ndarray:  # [S] bool
    better = (finals.enautilus > finals.interactive).any(axis=1)
    return np.asarray((finals.enautilus >= finals.interactive).all(axis=1) & better)


def _better_for_c(found: Found, _: Found) -> Check:
    finals = found["C"]
    better = int((finals.interactive[:, 1] > finals.enautilus[1]).sum())
    total = len(finals.interactive)
    return Check(
        2 * better > total,
        f"{better} of {total} interactive runs for C are better in objective 2 than E-NAUTILUS's policy",
    )


def _widely_spread(found: Found, _: Found) -> Check:
    ours, theirs = (float(each.std(axis=0).mean()) for each in _placed(found))
    text = f"the interactive method's final policies spread over {ours:.0%} of the front's range, E-NAUTILUS's over "
    text += f"{theirs:.0%}"
    return Check(ours > theirs, text)


FINALS_STATEMENTS: Mapping[str, Callable[[Found, Found], Check]] = {
    "clustered at objective 1": _clustered,
    "nobody is dominated": _nobody_dominated,
    "the same pick for A and B": _same_pick,
    "less concentrated": _less_concentrated,
    "shifted to objective 2": _shifted,
    "E-NAUTILUS dominates for A and B": _dominates,
    "interactive is better for C": _better_for_c,
    "widely spread": _widely_spread,
}


def finals_told(found: Found, weights: Mapping[str, Sequence[float]]) -> str:
    """Say whose utility is greater, and who dominates whom."""
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
    return " ".join(sentences)

"""The results of a study: what each user got from each method, and what it asked of them.

Letters: S runs, one a seed; M objectives.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from jmorl.decision.protocol import DecisionMaker
from jmorl.decision.target import TargetUser
from jmorl.experiments.record import RunRecord
from jmorl.experiments.statistics import Difference, Times, difference
from jmorl.experiments.study.plan import Study, StudyPart
from jmorl.experiments.targets import TargetRow, target_row

CLOSE, VERY_CLOSE = 5.0, 1.0  # percent of the best utility
GOOD = 2.0  # percent: what a person should get

Records = Mapping[str, RunRecord]  # by the cell's key


@dataclass(frozen=True)
class UserRow:
    """What one user got from one method."""

    user: str
    method: str
    asks: bool  # before the end
    seeds: tuple[int, ...]  # [S]
    records: tuple[RunRecord, ...]  # [S]
    asked: np.ndarray  # [S] questions
    shown: np.ndarray  # [S] policies, over all questions
    utility: np.ndarray  # [S] of the result
    found: np.ndarray  # [S] the greatest utility in the run's last front
    best: float  # utility
    close: Times  # until the archive has a policy within 5 % of the best
    very_close: Times  # 1 %

    @property
    def shortfall(self) -> np.ndarray:
        """How far below the best utility the results are, in percent of its size [S]."""
        return self._below_best(self.utility)

    @property
    def shortfall_of_front(self) -> np.ndarray:
        """How far below the best utility the best policies of the last fronts are, in percent of its size [S]."""
        return self._below_best(self.found)

    @property
    def good(self) -> int:
        """How many runs end within 2 % of the best."""
        return int((self.shortfall <= GOOD).sum())

    def _below_best(self, utility: np.ndarray) -> np.ndarray:
        return 100 * (self.best - utility) / abs(self.best)


def user_rows(study: Study, part: StudyPart, records: Records) -> list[UserRow]:
    """Return a row for each user with a utility, and each method with all or some of its runs."""
    rows = []
    for user in part.users:
        judge = study.user(part, user)
        if isinstance(judge, TargetUser):
            continue
        runs = {method: _runs(study, part, method, user, records) for method in study.contenders_of(part)}
        if any(runs.values()):
            best = _best(study, part, judge, records)
            made = ((method, there) for method, there in runs.items() if there)
            rows += [_user_row(study, part, user, method, judge, best, there) for method, there in made]
    return rows


def target_rows(study: Study, part: StudyPart, records: Records) -> list[TargetRow]:
    """Return a row for each user with a target, and each method with all or some of its runs."""
    rows = []
    for user in part.users:
        judge = study.user(part, user)
        for method in study.contenders_of(part):
            there = _runs(study, part, method, user, records)
            if isinstance(judge, TargetUser) and there:
                target = tuple(judge.target.tolist())
                rows.append(target_row(user, target, method, tuple(there), tuple(there.values()), part.steps))
    return rows


def gained(one: UserRow, other: UserRow) -> Difference | None:
    """Return how much more utility the first gave, on the seeds of both; None if they share no seed."""
    common = [seed for seed in one.seeds if seed in other.seeds]
    pairs = [one.utility[one.seeds.index(seed)] - other.utility[other.seeds.index(seed)] for seed in common]
    return difference(pairs) if pairs else None


@dataclass(frozen=True)
class Calibration:
    """Whether what runs say of the future, and of their result, is true."""

    intervals: int  # of predictions, one for each objective of a policy
    held: float  # share of them that what came lay in; NaN without any
    confirmed: int  # runs whose result was confirmed, and scored on fresh episodes
    within: int  # of them, where both scores agree within the stated error


def calibration(records: Sequence[RunRecord]) -> Calibration:
    """Return how true forecasts and confirmed scores of runs are."""
    inside = [
        low <= value <= high
        for record in records
        for policy in record.policies
        if policy.interval is not None
        for value, low, high in zip(policy.values, *policy.interval, strict=True)
    ]
    scored = [(record.confirmed, record.fresh) for record in records]
    agree = [
        all(abs(a - b) <= error for a, b, error in zip(said.values, found.values, said.error, strict=True))
        for said, found in scored
        if said and found
    ]
    return Calibration(len(inside), float(np.mean(inside)) if inside else np.nan, len(agree), sum(agree))


def _runs(study: Study, part: StudyPart, method: str, user: str, records: Records) -> dict[int, RunRecord]:
    """Return the runs there are, by seed. One that broke down before it had a generation is left out."""
    keys = {seed: study.cell(part, method, user, seed).key for seed in study.seeds}
    return {seed: records[key] for seed, key in keys.items() if key in records and records[key].generations}


def _best(study: Study, part: StudyPart, judge: DecisionMaker, records: Records) -> float:
    """Return the greatest utility there is: on the exact front, or of all that any run of the part found."""
    exact = study.exact(part)
    if exact is not None:
        return float(_utilities(judge, exact).max())
    of_part = [records[cell.key] for cell in study.cells(part) if cell.key in records]
    return max(float(_utilities(judge, record.values).max()) for record in of_part if record.policies)


def _user_row(
    study: Study,
    part: StudyPart,
    user: str,
    method: str,
    judge: DecisionMaker,
    best: float,
    there: Mapping[int, RunRecord],
) -> UserRow:
    records, asks = tuple(there.values()), study.asks(part, method)
    courses = [_course(record, judge) for record in records]
    # Who is asked once, at the end, about the whole front, finds the best there.
    utility = [
        _result(record, judge) if asks or record.chosen is None else course[-1]
        for record, course in zip(records, courses, strict=True)
    ]
    return UserRow(
        user,
        method,
        asks,
        tuple(there),
        records,
        np.array([len(record.asked) if asks else 1 for record in records]),
        np.array([_shown(record) if asks else len(record.generations[-1].front) for record in records]),
        np.array(utility),
        np.array([course[-1] for course in courses]),
        best,
        *(_until(records, courses, best - share / 100 * abs(best), part.steps) for share in (CLOSE, VERY_CLOSE)),
    )


def _course(record: RunRecord, judge: DecisionMaker) -> np.ndarray:
    """Return the greatest utility of the archive after each generation [G + 1]."""
    return np.array([_utilities(judge, record.values[list(each.front)]).max() for each in record.generations])


def _result(record: RunRecord, judge: DecisionMaker) -> float:
    """Return the utility of the result by its score in the search, as that of runs that confirm none is."""
    values = record.values[record.chosen if record.chosen is not None else record.generations[-1].front[0]]
    return float(_utilities(judge, values[None])[0])


def _shown(record: RunRecord) -> int:
    return sum(question.shown for question in record.asked)


def _until(records: Sequence[RunRecord], courses: Sequence[np.ndarray], least: float, budget: int) -> Times:
    """Return the steps until the archive's greatest utility is at least so much."""
    found = []
    for record, course in zip(records, courses, strict=True):
        there = np.flatnonzero(course >= least)
        found.append(float(record.steps[there[0]]) if len(there) else None)
    return Times(tuple(found), budget)


def _utilities(judge: DecisionMaker, values: np.ndarray) -> np.ndarray:
    utilities = judge.utility(values)
    assert utilities is not None, "the plan was checked"
    return utilities

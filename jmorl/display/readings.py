"""Returns as people say them: with the sign, the unit and the digits of an objective's reading."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from envs.core import Objective
from jmorl.display.text import number_format
from jmorl.search.policy import Policy


@dataclass(frozen=True)
class Writer:
    """Writes returns of one objective, all with the same digits, so that they can be compared."""

    objective: Objective
    format: str

    def value(self, value: float) -> str:
        """`66.1` for a return."""
        return f"{float(self.objective.read.of(value)):z{self.format}}"

    def size(self, difference: float) -> str:
        """`0.4` for a deviation, or a difference of either sign."""
        return f"{abs(float(self.objective.read.of(difference))):{self.format}}"

    def score(self, value: float, deviation: float) -> str:
        """`66.1 ±0.4` for a mean and its deviation."""
        return f"{self.value(value)} ±{self.size(deviation)}"

    def reaching(self, value: float) -> str:
        """`≤ 66.1` where less is better, `≥ 3.2` where more is: what reaches a return."""
        return f"{'≤' if self.objective.read.less_is_better else '≥'} {self.value(value)}"

    def span(self, worst: float, best: float) -> str:
        """`120.3 to 66.1`, or one number where both are the same."""
        return self.value(worst) if worst == best else f"{self.value(worst)} to {self.value(best)}"


def writers_for(values: np.ndarray, objectives: Sequence[Objective], digits: int = 3) -> list[Writer]:
    """Return a writer for each objective, with so many significant digits of the range of most of the values [N, M]."""
    return [
        Writer(objective, number_format(objective.read.of(column), digits))
        for objective, column in zip(objectives, np.asarray(values).T, strict=True)
    ]


def reading_label(objective: Objective) -> str:
    """Return the quantity and the unit that people say it in: `time (steps)`."""
    return f"{objective.label} ({objective.read.unit})"


def direction(objective: Objective) -> str:
    """Return which numbers are the good ones."""
    return "less is better" if objective.read.less_is_better else "more is better"


def values_in_words(values: Sequence[float] | np.ndarray, writers: Sequence[Writer]) -> str:
    """`time 66.1, fuel 57.3` for a vector [M]."""
    return ", ".join(
        f"{writer.objective.label} {writer.value(value)}" for writer, value in zip(writers, values, strict=True)
    )


def bounds_in_words(bounds: Sequence[float] | np.ndarray, writers: Sequence[Writer]) -> str:
    """`time ≤ 66.1, fuel ≤ 57.3` for a vector [M]; nothing of an objective without a bound."""
    return ", ".join(
        f"{writer.objective.label} {writer.reaching(bound)}"
        for writer, bound in zip(writers, bounds, strict=True)
        if np.isfinite(bound)
    )


def confirmed_in_words(policy: Policy, objectives: Sequence[Objective]) -> str:
    """`mean time 58.2 ±0.4, ... of 128 fresh episodes, 99 % sure with one odd episode more; ...`; or nothing."""
    found = policy.confirmation
    if found is None:
        return ""
    writers = writers_for(np.stack([np.zeros(len(found.error)), found.error]), objectives, digits=2)
    scores = ", ".join(
        f"{writer.objective.label} {writer.score(value, error)}"
        for writer, value, error in zip(writers, policy.values, found.error, strict=True)
    )
    claimed = values_in_words(found.claimed, writers)
    return (
        f"{scores}: the mean of {found.episodes} fresh episodes, 99 % sure, with room for one odd episode; "
        f"in the search it was {claimed}"
    )

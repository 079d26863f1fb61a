"""Means and intervals of few runs, some of which time out.

Letters: S runs, one a seed.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

CONFIDENCE = 0.95
RESAMPLES = 9999
FEWEST = 3  # values whose interval says anything


@dataclass(frozen=True)
class Interval:
    """A mean and its percentile bootstrap interval, which is rather too narrow for few values."""

    mean: float
    low: float
    high: float
    count: int  # values


@dataclass(frozen=True)
class Difference:
    """The mean of paired differences and its t interval: for few values a bootstrap's is too narrow."""

    mean: float
    low: float
    high: float
    count: int  # values
    agreeing: int  # values of the mean's sign

    @property
    def clear(self) -> bool:
        """Whether the interval excludes 0; it never does for one value or two."""
        return self.count >= FEWEST and (self.low > 0 or self.high < 0)

    @property
    def certainty(self) -> str:
        """How sure the sign of the mean is, in words."""
        if self.clear:
            return "clearly"
        agree = self.count >= FEWEST and self.agreeing == self.count
        return f"not clearly, though all {self.count} seeds agree" if agree else "not clearly"


def interval(values: Sequence[float]) -> Interval:
    """Return the mean of values [S], S >= 1, with its percentile bootstrap interval; for equal ones its width is 0.

    The percentile method, not BCa: with five values, several of them equal, the latter is often undefined.
    """
    from scipy.stats import bootstrap  # slow to import

    sample = np.asarray(values, float)
    mean = float(sample.mean())
    if len(sample) < 2 or np.ptp(sample) == 0:
        return Interval(mean, mean, mean, len(sample))
    found = bootstrap(
        (sample,),
        np.mean,
        confidence_level=CONFIDENCE,
        n_resamples=RESAMPLES,
        method="percentile",
        rng=np.random.default_rng(0),
    ).confidence_interval
    return Interval(mean, float(found.low), float(found.high), len(sample))


def difference(values: Sequence[float]) -> Difference:
    """Return the mean of paired differences [S], S >= 1, with its t interval; for equal ones its width is 0."""
    from scipy.stats import t  # slow to import

    sample = np.asarray(values, float)
    mean, count = float(sample.mean()), len(sample)
    half = 0.0
    if count > 1 and np.ptp(sample) > 0:
        half = float(t.ppf((1 + CONFIDENCE) / 2, count - 1) * sample.std(ddof=1) / np.sqrt(count))
    agreeing = int((np.sign(sample) == np.sign(mean)).sum()) if mean else 0
    return Difference(mean, mean - half, mean + half, count, agreeing)


@dataclass(frozen=True)
class Times:
    """Steps until a target was reached, of runs with one budget. A run that did not reach it is censored there."""

    reached: tuple[float | None, ...]  # [S] None: never
    budget: float

    @property
    def successes(self) -> int:
        """How many runs reached the target."""
        return sum(steps is not None for steps in self.reached)

    @property
    def restricted(self) -> tuple[float, ...]:  # [S]
        """Steps used, at most the budget."""
        return tuple(self.budget if steps is None else steps for steps in self.reached)

    @property
    def restricted_mean(self) -> Interval:
        """Mean steps used within the budget.

        With all censoring at the budget this is the area under the Kaplan-Meier curve up to there. It is a lower
        bound for the mean time to the target, not an estimate of it, unless all runs succeed.
        """
        return interval(self.restricted)


def saved(one: Times, other: Times) -> Difference:
    """Return the steps within the budget that `one` saves against `other`, both with the same seeds in one order."""
    pairs = zip(one.restricted, other.restricted, strict=True)
    return difference([theirs - ours for ours, theirs in pairs])

"""The part of objective space that a preferred policy leaves in play."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jmorl.search.policy import Policy, values_of

MOST_WIDENINGS = 7
LIMIT_WIDENINGS = 3


def lower_bounds(preferred: np.ndarray, delta: float, unit: np.ndarray) -> np.ndarray:
    """`z - delta sqrt(s |z|)`, element-wise, for the preferred policy's values z [M] and units s [M] >= 0.

    Equation 4 of the paper, whose s is 1; a unit of the objective's own makes the slack the same in every unit.
    """
    return preferred - delta * np.sqrt(unit * np.abs(preferred))


@dataclass(frozen=True)
class Bounds:
    """Lower bounds, and how far they gave way."""

    lower: np.ndarray  # [M]
    widenings: int  # how often their slack was doubled


def widened_bounds(
    preferred: np.ndarray,  # [M]
    delta: float,
    unit: np.ndarray,  # [M] >= 0
    least_slack: np.ndarray,  # [M] >= 0, whatever the preferred values
    values: np.ndarray,  # [N, M]
    least_within: int,
    limits: Sequence[float] | None = None,  # [M] -inf where there is none
) -> Bounds:
    """Return `lower_bounds`, their slack doubled until so many of the vectors reach them, 7 times at most.

    A limit says what of an objective may be given up: there the slack is doubled at once, `LIMIT_WIDENINGS` times, but
    the bound stays above the limit, or above the preferred value if that is less, but for the slack at first.
    """
    slack = np.maximum(delta * np.sqrt(unit * np.abs(preferred)), least_slack)
    least = np.full(len(preferred), -np.inf) if limits is None else np.minimum(limits, preferred) - slack
    at_once = np.where(np.isfinite(least), LIMIT_WIDENINGS, 0)
    for widenings in range(MOST_WIDENINGS + 1):
        lower = np.maximum(preferred - 2.0 ** np.maximum(widenings, at_once) * slack, least)
        if within(values, lower).sum() >= least_within:
            break
    return Bounds(lower, widenings)


def within(values: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    """Which of the vectors [N, M] reach the bounds [M] in every objective, [N]."""
    return np.all(values >= bounds, axis=1)


def members_within(policies: Sequence[Policy], bounds: np.ndarray) -> list[Policy]:
    """Return those of the policies, at least one, that reach the bounds [M]."""
    inside = within(values_of(policies), bounds)
    return [policy for policy, kept in zip(policies, inside, strict=True) if kept]

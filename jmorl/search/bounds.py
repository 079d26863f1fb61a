"""The part of objective space that a preferred policy leaves in play."""

from collections.abc import Sequence

import numpy as np

from jmorl.search.policy import Policy, values_of


def lower_bounds(preferred: np.ndarray, delta: float, unit: np.ndarray) -> np.ndarray:
    """`z - delta sqrt(s |z|)`, element-wise, for the preferred policy's values z [M] and units s [M] >= 0.

    Equation 4 of the paper, whose s is 1; a unit of the objective's own makes the slack the same in every unit.
    """
    return preferred - delta * np.sqrt(unit * np.abs(preferred))


def within(values: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    """Which of the vectors [N, M] reach the bounds [M] in every objective, [N]."""
    return np.all(values >= bounds, axis=1)


def members_within(policies: Sequence[Policy], bounds: np.ndarray) -> list[Policy]:
    """Return those of the policies, at least one, that reach the bounds [M]."""
    inside = within(values_of(policies), bounds)
    return [policy for policy, kept in zip(policies, inside, strict=True) if kept]

"""Policies that are nothing but their values."""

from collections.abc import Iterable, Sequence

import numpy as np

from jmorl.search.policy import Policy


def policy(policy_id: int, values: Sequence[float] | np.ndarray, objectives: int | None = None) -> Policy:
    """A policy with these values; the snapshot tells which policy it belongs to."""
    weights = np.full(objectives or len(values), 1.0)
    array = np.array(values, dtype=float)
    return Policy(policy_id, 0, None, weights, array, array, array, snapshot=("snapshot", policy_id))


def policies(rows: Iterable[Sequence[float] | np.ndarray], first_id: int = 0) -> list[Policy]:
    return [policy(first_id + index, values) for index, values in enumerate(rows)]

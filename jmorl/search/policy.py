"""One evaluated policy: where it came from, what it scores, and the learner's state behind it."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np


@dataclass(frozen=True, eq=False)
class Confirmation:
    """Where a score comes from that was found anew, on starts that had no part in picking the policy."""

    claimed: np.ndarray  # [M] the score that the search went by
    claimed_std: np.ndarray  # [M] its standard deviation over the evaluation episodes
    episodes: int  # fresh ones, of the score that is confirmed
    error: np.ndarray  # [M] of it: the mean over all starts is within in 99 of 100 cases; see jmorl/confirmation.py


@dataclass(frozen=True)
class Blend:
    """Of which policies the parameters of a blend are an affine combination."""

    parents: tuple[int, ...]  # ids, ascending
    coefficients: tuple[float, ...]  # of each; they add up to one, and a negative one leads away from its policy

    def __str__(self) -> str:
        """Return all of it in a line: `12:0.4 15:0.6`."""
        return " ".join(f"{parent}:{share}" for parent, share in zip(self.parents, self.coefficients, strict=True))


@dataclass(frozen=True, eq=False)
class Policy:
    """Everything known of one policy, in one record, so that policy and score cannot drift apart.

    Compared by identity; `id` is unique within a run. The search reads `values` and never
    looks into `snapshot`.
    """

    id: int
    generation: int  # 0: the warm-up
    parent: int | None  # id of the policy whose training was continued; None in the warm-up, and for a blend
    weights: np.ndarray  # [M] the weights it was trained with
    values: np.ndarray  # [M] z, its score: maximised
    std: np.ndarray  # [M] standard deviation of the score over the evaluation episodes
    discounted: np.ndarray  # [M] mean discounted return
    snapshot: Any = field(repr=False)  # parameters, optimiser state and statistics
    predicted: np.ndarray | None = None  # [M] the values the search expected; None in the warm-up
    interval: np.ndarray | None = None  # [2, M] ends between which the search expected them in 80 of 100 cases
    raw: np.ndarray | None = None  # [M] mean undiscounted return, where `values` are in other units; else None
    confirmation: Confirmation | None = None  # of `values` and `std`, where they are confirmed
    blend: Blend | None = None  # for a policy that was not trained, but mixed


def rescored(policies: Iterable[Policy], scored: Iterable[Policy]) -> tuple[Policy, ...]:
    """Return the policies, those among them that were scored anew with these scores."""
    by_id = {policy.id: policy for policy in scored}
    return tuple(by_id.get(policy.id, policy) for policy in policies)


def values_of(policies: Sequence[Policy]) -> np.ndarray:  # [N, M]
    """Return the objective vectors of at least one policy, stacked."""
    return np.stack([policy.values for policy in policies])

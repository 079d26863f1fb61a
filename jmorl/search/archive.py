"""All non-dominated policies seen so far."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jmorl.search.pareto import non_dominated
from jmorl.search.policy import Policy, values_of


@dataclass(frozen=True)
class Archive:
    """Policies that do not dominate each other, in the order they came. Policy and score are one record."""

    members: tuple[Policy, ...] = ()

    @property
    def values(self) -> np.ndarray:  # [N, M]
        """The objective vectors of the members; the archive must not be empty."""
        return values_of(self.members)

    def offer(self, policies: Sequence[Policy]) -> "Archive":
        """Return the archive with those of the policies that are not dominated, without those that now are.

        Of policies with equal values the first one stays. Raises ValueError if a policy's values are not
        one finite number per objective.
        """
        union = (*self.members, *policies)
        if not union:
            return self
        refuse_unusable(union)
        kept = non_dominated(values_of(union))
        return Archive(tuple(policy for policy, stays in zip(union, kept, strict=True) if stays))


def refuse_unusable(policies: Sequence[Policy]) -> None:
    """Raise ValueError, naming the policy, if its values are not one finite number per objective.

    The number of objectives is that of the first policy's weights.
    """
    objectives = len(policies[0].weights)
    for policy in policies:
        if policy.values.shape != (objectives,):
            raise ValueError(
                f"policy {policy.id} has values of shape {policy.values.shape}, expected one for each of the "
                f"{objectives} objectives"
            )
        if not np.isfinite(policy.values).all():
            raise ValueError(f"policy {policy.id} has values {policy.values}; NaN and infinity cannot be compared")

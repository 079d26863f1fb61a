"""The policies that are laid out to be compared: the same in every tab, so that a reload loses nothing."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from jmorl.methods.base import Prospect
from jmorl.studio.view import View

LETTERS = "ABC"  # of the places


@dataclass(frozen=True, eq=False)
class Selection:
    """The policies laid out, the one in focus, and the objective that somebody wants more of."""

    places: Mapping[str, int] = field(default_factory=dict)  # letter -> policy; the one looked at longest first
    focus: int | None = None  # one of the policies
    more_of: int | None = None  # index of the objective asked for; None: all policies are shown
    than: int | None = None  # the policy that the others are to be better than; None: all are, in order
    prospects: Mapping[int, Prospect] = field(default_factory=dict)  # policy -> what choosing it would mean, if known

    @property
    def letters(self) -> dict[int, str]:
        """Return the letter of each policy, in the order of the letters."""
        return {policy: letter for letter, policy in sorted(self.places.items())}

    @property
    def prospect(self) -> Prospect | None:
        """Return what choosing the policy in focus would mean, if that is known."""
        return None if self.focus is None else self.prospects.get(self.focus)

    def with_policy(self, policy: int) -> "Selection":
        """Put a policy in focus; a new one comes to a free place, or to that of the one looked at longest."""
        if policy in self.places.values():
            return replace(self, focus=policy)
        free = [letter for letter in LETTERS if letter not in self.places]
        letter = free[0] if free else next(iter(self.places))
        others = {each: there for each, there in self.places.items() if each != letter}
        return replace(self, places={**others, letter: policy}, focus=policy)

    def without(self, policy: int) -> "Selection":
        """Put a policy away; of those left the last one comes into focus."""
        left = {letter: there for letter, there in self.places.items() if there != policy}
        focus = next(reversed(left.values()), None) if self.focus == policy else self.focus
        return replace(self, places=left, focus=focus)


def wanted(view: View, selection: Selection) -> list[int] | None:
    """Return the policies better in the objective asked for, the least change first; None if none is asked for."""
    if selection.more_of is None:
        return None
    reference = view.policy(selection.than) if selection.than is not None else None
    least = reference.values[selection.more_of] if reference else -np.inf
    members = sorted(view.front, key=lambda policy: float(policy.values[selection.more_of]))
    return [policy.id for policy in members if policy.values[selection.more_of] > least]

"""The policies that somebody at a tab has laid out to compare, and those that a question begins with."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from jmorl.methods.base import Prospect
from jmorl.search.bounds import within
from jmorl.search.policy import Policy, values_of
from jmorl.search.scaling import core, core_scale
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
    limits: tuple[float, ...] | None = None  # [M] what each objective must reach, -inf: anything; None: never said
    favourites: bool = False  # only favourites are listed, those that are no longer in the front, too

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

    def known_in(self, view: View) -> "Selection":
        """Return the selection without the policies that are no longer there."""
        selection = self
        for policy in self.letters:
            if not view.policy(policy):
                selection = selection.without(policy)
        return selection


def wanted(view: View, selection: Selection) -> list[int] | None:
    """Return the policies better in the objective asked for, the least change first; None if none is asked for."""
    if selection.more_of is None:
        return None
    reference = view.policy(selection.than) if selection.than is not None else None
    least = reference.values[selection.more_of] if reference else -np.inf
    members = sorted(view.front, key=lambda policy: float(policy.values[selection.more_of]))
    return [policy.id for policy in members if policy.values[selection.more_of] > least]


def reaching(view: View, selection: Selection) -> np.ndarray:
    """Return which policies of the front reach the limits that somebody has set, [N] bool."""
    return within(view.values, _least(view, selection))


def listed(view: View, selection: Selection) -> list[int] | None:
    """Return the policies to look along: with more of what is asked for, within the limits; None: all of the front.

    Where only favourites are listed, those that are no longer in the front are among them, as long as no more of an
    objective is asked for.
    """
    policies = view.favourites if selection.favourites else view.front
    values = np.array([policy.values for policy in policies]).reshape(-1, len(view.objectives))
    more, reach = wanted(view, selection), within(values, _least(view, selection))
    if more is None and reach.all() and not selection.favourites:
        return None
    kept = [policy.id for policy, reaches in zip(policies, reach, strict=True) if reaches]
    return kept if more is None else [policy for policy in more if policy in kept]


def to_begin_with(view: View, axes: tuple[int, int]) -> Selection:
    """Lay out what the open question, or a look at early agents, is best begun with: A, in focus, with two beside it.

    A is the last choice, or what has replaced it. B is better in the objective to the right in the chart, C in the one
    upwards: the nearest of the new policies, or else of all. Before the first choice A is a compromise, and B and C
    are the ends of the front. A question about a pair lays out the pair.
    """
    question = view.question
    shown = question.front if question else view.front
    if question and (question.form == "pair" or question.again):
        anchor, sides = shown[0], list(shown[1:2])
    elif view.previous is None:
        anchor, sides = _compromise(shown), _ends(shown, axes)
    else:
        anchor = last_choice(view) or _compromise(shown)
        sides = _beside(view, shown, anchor, axes)
    selection = Selection(limits=question.limits if question else None)
    for policy in (anchor, *sides):
        selection = selection.with_policy(policy.id)
    return replace(selection, places={**selection.places, LETTERS[0]: selection.places[LETTERS[0]]}, focus=anchor.id)


def last_choice(view: View) -> Policy | None:
    """Return the policy chosen last, or the one that has replaced it: nearest of those that are better in everything.

    None before the first choice.
    """
    previous = view.previous
    if previous is None or not view.front or previous.id in {policy.id for policy in view.front}:
        return previous
    better = (view.values >= previous.values).all(axis=1)
    scale = core_scale(view.values)
    distance = np.linalg.norm(scale.apply(view.values) - scale.apply(previous.values), axis=1)
    return view.front[int(np.where(better | ~better.any(), distance, np.inf).argmin())]


def _least(view: View, selection: Selection) -> np.ndarray:
    """Return what each objective must reach, [M]."""
    return np.full(len(view.objectives), -np.inf) if selection.limits is None else np.array(selection.limits)


def _compromise(policies: Sequence[Policy]) -> Policy:
    """Return the policy whose worst objective is best, in shares of the front's range."""
    values = values_of(policies)
    return policies[int(core_scale(values).apply(values).min(axis=1).argmax())]


def _ends(policies: Sequence[Policy], axes: tuple[int, int]) -> list[Policy]:
    """Return the best policy in each of two objectives, of those that are not far out."""
    values = values_of(policies)
    near = np.flatnonzero(core(values))
    return [policies[near[values[near, axis].argmax()]] for axis in axes]


def _beside(view: View, policies: Sequence[Policy], anchor: Policy, axes: tuple[int, int]) -> list[Policy]:
    """Return the policy nearest to another one that is better in an objective, for each of two objectives.

    Where none is better, the nearest of the others.
    """
    values = values_of(policies)
    scale = core_scale(values)
    distances = np.linalg.norm(scale.apply(values) - scale.apply(anchor.values), axis=1)
    order = sorted(range(len(policies)), key=lambda row: (not view.is_new(policies[row]), distances[row]))
    found: list[Policy] = []
    for axis in axes:
        taken = {anchor.id, *(policy.id for policy in found)}
        rows = [row for row in order if policies[row].id not in taken]
        better = [row for row in rows if values[row, axis] > anchor.values[axis]]
        found += [policies[row] for row in (better or rows)[:1]]
    return found

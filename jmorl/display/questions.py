"""What people read about a question, on the page and at the terminal alike."""

from collections.abc import Sequence
from itertools import accumulate

import numpy as np

from envs.core import Objective
from jmorl.display.readings import Writer, values_in_words
from jmorl.display.text import minus, plural
from jmorl.search.bounds import within
from jmorl.search.prospect import Prospect

INTRODUCTION = (
    "Policies are trained that trade {objectives} against each other. After a round of training you say which one you "
    "like best; the next round searches around it. What your answers leave no doubt about is chosen for you. Nothing is"
    " final: you can go back to any earlier question."
)
MOST_POINTS, LONGEST_POINTS = 3, 150  # that the prediction model is quoted with, and their characters


def introduction(objectives: Sequence[Objective]) -> str:
    """Say to somebody new what happens."""
    return INTRODUCTION.format(objectives=joined([objective.label for objective in objectives]))


def front_question(purpose: str, generation: int, policies: int, form: str = "best", again: bool = False) -> str:
    """Return the question about a front of so many policies; the other parameters are a Question's."""
    when = "The run is over." if purpose == "final" else f"Round {generation}."
    if again:
        return f"{when} Your earlier answers speak for the other one of these two. Which one do you prefer?"
    if form == "pair":
        return f"{when} Which one of these two policies do you prefer?"
    if form == "rank":
        return f"{when} In which order do you prefer these {policies} policies?"
    if purpose == "final":
        return f"{when} " + (
            f"Which of these {policies} policies is its result?" if policies > 1 else "Is this policy its result?"
        )
    which = f"which of these {policies} policies do you prefer?" if policies > 1 else "do you go on with this policy?"
    return f"Round {generation}: {which}"


def outlook(name: str, area: str, prospect: Prospect | None, values: np.ndarray, writers: Sequence[Writer]) -> str:
    """Say what choosing the policy with this name would mean for the search, beside a front with these values [N, M].

    `area` says where the search would then go on.
    """
    if prospect is None:
        return f"If you choose {name}, the search goes on as before."
    kept, total = int(prospect.kept.sum()), len(prospect.kept)
    narrows = f"If you choose {name}: the search narrows to {area}, with {kept} of {plural(total, 'policy')}."
    if kept == total:
        narrows = f"If you choose {name}: the search goes on around all {plural(total, 'policy')}."
    expected = prospect.expected[[not within(values, point).any() for point in prospect.expected]]
    if not len(expected):
        return f"{narrows} Nothing better than what is there is expected."
    best = dict.fromkeys(expected.argmax(axis=0).tolist())  # in an objective, each a point of its own
    points = [minus(values_in_words(expected[row], writers)) for row in best]
    count = max(1, sum(length <= LONGEST_POINTS for length in accumulate(len(point) for point in points[:MOST_POINTS])))
    odds = f"{10 * prospect.odds:.0f} of 10 such forecasts come true."
    return f"{narrows} It may find {'; or '.join(points[:count])}. {odds}"


def joined(labels: Sequence[str]) -> str:
    """Return `time, fuel and noise`."""
    *others, last = labels
    return f"{', '.join(others)} and {last}"

"""What the home page says of runs, and the form of environments."""

from collections.abc import Sequence
from functools import lru_cache

import envs
from envs.core import Objective
from jmorl.display import questions
from jmorl.display.text import minus, number, plural, short_count
from jmorl.studio import texts
from jmorl.studio.home import Facts, Origin, printable
from jmorl.studio.view import PERSON, View


def objectives(labels: Sequence[str]) -> str:
    """Say what an environment has for objectives."""
    return f"Its objectives are {questions.joined(labels)}."


def open_run(view: View | None, opening: str, now: float) -> str:
    """Say which run is open and what is going on, or which one is about to be opened, and what that waits for."""
    if opening:
        waits = view is not None and view.timeline is not None and view.question is None
        after = f", as soon as this round of {printable(view.path.name)} is over" if view and waits else ""
        return f"Opening {opening}{after} …"
    return f"Open: {printable(view.path.name)}. {texts.phase(view, now)}." if view else ""


def decider(facts: Facts) -> str:
    """Say how a run searches, and who decides."""
    return f"{facts.method}, {'you decide' if facts.user == PERSON else f'user {facts.user}'}"


def progress(facts: Facts) -> str:
    """Say how many rounds of a run are over."""
    return "in the warm-up" if facts.rounds is None else plural(facts.rounds, "round")


def budget(facts: Facts) -> str:
    """Say how much of its budget a run has used."""
    return f"{short_count(facts.steps)} of {short_count(facts.budget)} steps"


def branch_of(origin: Origin | None) -> str:
    """Say where a branch leaves another run; nothing of a run that is no branch."""
    if origin is None:
        return ""
    return f"branch of {origin.name} after {f'round {origin.generation}' if origin.generation else 'its warm-up'}"


def result(facts: Facts) -> str:
    """Return the scores of a run's result, as people say them; nothing before the end."""
    read = {objective.name: objective for objective in _known_objectives(facts.env)}
    told = [
        f"{read[name].label} {number(float(read[name].read.of(value)))}" if name in read else f"{name} {number(value)}"
        for name, value in facts.scores
    ]
    return minus(", ".join(told))


@lru_cache
def _known_objectives(env: str) -> tuple[Objective, ...]:
    """Return the objectives of an environment of jmorl's own; nothing of any other, which a list does not import."""
    return envs.make(env).objectives if envs.plain_id(env) == env and env in envs.ids() else ()

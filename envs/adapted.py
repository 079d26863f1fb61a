"""Environments of Brax's kind as multi-objective ones: the terms of their reward, grouped into objectives.

`envs.brax` and `envs.playground` find them. What they keep in `state.metrics` are the terms that can be grouped, and
two more that every environment has: `reward`, which is theirs, and `control`, minus the sum of the squared actions.
"""

import io
import math
import re
import warnings
from ast import literal_eval
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, redirect_stdout
from functools import cache
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from envs.core import Environment, Objective, Transition
from envs.mujoco_model import quiet_mujoco
from envs.names import did_you_mean, nearest

STARTS = 256  # states that episodes start from: a reset of theirs costs more than many steps
TERM_PREFIX = "reward/"  # of a term's name in `state.metrics`, which is not written
REWARD, CONTROL = "reward", "control"
# Groups for environments of which nothing else is known: terms, the unit of the return, and the highest return.
REWARD_AND_CONTROL = (
    (f"task:{REWARD}", "reward", math.inf),
    (f"energy:{CONTROL}", "(-control²)·steps", 0.0),
)
WHOLE = re.compile(r"[1-9][0-9]{0,8}")  # a whole number above zero
KEY = "rng"  # in `state.info`: what they draw noise and commands with
FORM = "write objectives=TERM+TERM/TERM, at least two objectives between slashes; NAME:TERM names one, 0.5*TERM scales"


class Group(NamedTuple):
    """Terms of a reward that make an objective."""

    objective: Objective
    terms: tuple[tuple[float, str], ...]  # factor and name


class Adapted(Environment[Any]):
    """An environment of theirs. Episodes start from the states that `starts` has."""

    action_low = -1.0
    action_high = 1.0

    def __init__(self, theirs: Any, groups: Sequence[Group]):
        self.theirs = theirs
        self._groups = tuple(groups)

    def initial_state(self, key: jax.Array) -> Any:
        """Return one of the states that episodes start from, with a key of the episode's own where they keep one."""
        place_key, own_key = jax.random.split(key)
        index = jax.random.randint(place_key, (), 0, STARTS)
        state = jax.tree.map(lambda array: array[index], starts(self.theirs))
        if KEY not in state.info:
            return state
        return state.replace(info=state.info | {KEY: jax.random.key_data(own_key).astype(state.info[KEY].dtype)})

    def observe(self, state: Any) -> jax.Array:
        """Return what the agent sees of a state."""
        return observation(state)

    def transition(self, state: Any, action: jax.Array) -> Transition:
        """Apply their dynamics to a state and an action [A]."""
        kept = jax.tree.map(lambda leaf: leaf, state)  # they write into the dictionaries of the state they are given
        with their_way():
            found = self.theirs.step(kept, action)
        values = terms_of(found) | {REWARD: found.reward, CONTROL: -jnp.sum(action**2)}
        reward = [
            sum(factor * jnp.asarray(values[term], jnp.float32) for factor, term in group.terms)
            for group in self._groups
        ]
        after = jax.tree.map(lambda new, old: jnp.asarray(new).astype(old.dtype), found, state)
        return Transition(after, jnp.stack(reward), jnp.asarray(found.done) > 0)


@cache
def starts(theirs: Any) -> Any:
    """Return states that episodes start from, drawn with the same seed always: arrays whose first axis is `STARTS`."""
    with jax.ensure_compile_time_eval(), their_way():  # the first use may be under a trace
        keys = jax.random.key_data(jax.random.split(jax.random.key(0), STARTS))  # they keep keys as numbers
        return jax.jit(jax.vmap(theirs.reset))(keys)


def adapt(
    id: str,
    family: str,
    theirs: Any,
    written: str | None,
    default: Sequence[tuple[str, str, float]],
    time_limit: str | int,
    wrong: Sequence[str],
) -> Environment[Any]:
    """Return their environment as one of ours, a class of its own.

    `written` groups terms as in `FORM`; without it, `default` does: for each objective its group as it would be
    written, the unit of its return, and the highest one. Raises ValueError with all that is wrong: what is in `wrong`
    already, and what this finds.
    """
    step_seconds = float(theirs.dt)
    wrong = list(wrong)
    if step_seconds <= 0:
        wrong.append(f"a step must take some time, and takes {step_seconds:g} seconds")
    if not WHOLE.fullmatch(str(time_limit)):
        wrong.append(f"time_limit must be a whole number above zero, not {str(time_limit)!r}")
    with their_way():
        state = jax.eval_shape(theirs.reset, jax.eval_shape(lambda: jax.random.key_data(jax.random.key(0))))
    groups = default if written is None else [(group, "reward", math.inf) for group in str(written).split("/")]
    parsed, wrong_groups = _parsed(groups, (*sorted(terms_of(state)), REWARD, CONTROL))
    wrong += wrong_groups
    if wrong:
        raise ValueError("; ".join(wrong))
    declared = {
        "__doc__": f"{family}'s {id}.",
        "id": id,
        "family": family,
        "objectives": tuple(group.objective for group in parsed),
        "observation_size": int(observation(state).shape[-1]),
        "action_size": int(theirs.action_size),
        "time_limit": int(time_limit),
        "step_seconds": step_seconds,
    }
    return type(id, (Adapted,), declared)(theirs, parsed)


def terms_of(state: Any) -> dict[str, Any]:
    """Return what their state tells of its reward, by the names that are written."""
    named = {name.removeprefix(TERM_PREFIX).replace("/", "_"): value for name, value in state.metrics.items()}
    return {name: value for name, value in named.items() if name not in (REWARD, CONTROL)}


def observation(state: Any) -> Any:
    """Return what the agent sees of their state; of what they also give to a teacher, nothing."""
    return state.obs if hasattr(state.obs, "shape") else state.obs["state"]


def _parsed(groups: Sequence[tuple[str, str, float]], known: Sequence[str]) -> tuple[list[Group], list[str]]:
    """Return groups as written, with the unit and the highest return of each, and what is wrong with them."""
    found, wrong = [], []
    for written, unit, highest in groups:
        before, colon, after = written.partition(":")
        terms = [_term(term) for term in (after if colon else before).split("+")]
        name = before.strip() if colon else "+".join(term.removeprefix("reward_") for _, term in terms)
        found.append(Group(Objective(name, name, unit, highest), tuple(terms)))
        wrong += [f"{written!r} has a term without a name or a factor; {FORM}"] * (
            not name or any(not term or not math.isfinite(factor) or not factor for factor, term in terms)
        )
        wrong += [
            f"there is no term {term!r}{did_you_mean(nearest(term, known))}"
            for _, term in terms
            if term and term not in known
        ]
    names = [group.objective.name for group in found]
    wrong += [f"two objectives are called {name!r}" for name in dict.fromkeys(names) if names.count(name) > 1]
    if len(found) < 2:
        wrong.append(f"there is one objective; {FORM}")
    return found, [f"objectives: {'; '.join(wrong)}; the terms there are: {', '.join(known)}"] if wrong else []


def _term(written: str) -> tuple[float, str]:
    """Return factor and name of a term; NaN for a factor that is no number."""
    factor, star, name = written.rpartition("*")
    try:
        return float(factor) if star else 1.0, name.strip()
    except ValueError:
        return math.nan, name.strip()


def split_options(options: Mapping[str, Any], theirs: Iterable[str]) -> tuple[dict[str, Any], list[str]]:
    """Return the options that are theirs, and what is wrong with others. One of ours is none of theirs."""
    allowed = dict.fromkeys(theirs)
    known = ", ".join(("objectives", "time_limit", *allowed))
    wrong = [
        f"there is no option {name!r}{did_you_mean(nearest(name, allowed))}" for name in options if name not in allowed
    ]
    kept = {name: value for name, value in options.items() if name in allowed}
    return kept, [f"{'; '.join(wrong)}; the options there are: {known}"] if wrong else []


def literal(value: Any) -> Any:
    """Return the number, or the other value, that a text is in Python; else the text."""
    try:
        return literal_eval(value)
    except (ValueError, SyntaxError):
        return value


@contextmanager
def unseen() -> Iterator[None]:
    """Let their code print, too: while one of them is imported or made."""
    with redirect_stdout(io.StringIO()), their_way():
        yield


@contextmanager
def their_way() -> Iterator[None]:
    """Let their code warn, and mix shapes and types, as it likes."""
    with ExitStack() as stack:
        stack.enter_context(quiet_mujoco())
        stack.enter_context(warnings.catch_warnings())
        warnings.simplefilter("ignore")
        stack.enter_context(jax.numpy_rank_promotion("allow"))
        stack.enter_context(jax.numpy_dtype_promotion("standard"))
        yield

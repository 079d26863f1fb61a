"""Brax's environments: `brax:NAME`, with options `objectives`, `time_limit` and any of theirs, such as `backend`.

    brax:ant
    brax:ant,objectives=forward_reward+reward_survive/reward_ctrl
    brax:hopper,backend=spring,time_limit=500

The terms of their rewards, and the names of these, are Brax's.
"""

import inspect
import math
from functools import cache
from typing import Any

from envs.adapted import REWARD_AND_CONTROL, adapt, literal, split_options, unseen
from envs.core import Environment
from envs.failures import failure
from envs.names import did_you_mean, nearest

OF_THEIR_TESTS = {"fast"}  # which have no physics
TIME_LIMIT = 1000  # steps, as theirs is unless somebody says otherwise
# For each objective: its terms, the unit of its return, and the highest return.
GROUPS: dict[str, tuple[tuple[str, str, float], ...]] = {
    "ant": (
        ("speed:reward_forward+reward_survive", "(m/s + 1)·steps", math.inf),
        ("energy:reward_ctrl+reward_contact", "(-0.5 control²)·steps", 0.0),
    ),
    "halfcheetah": (
        ("speed:reward_run", "m/s·steps", math.inf),
        ("energy:reward_ctrl", "(-0.1 control²)·steps", 0.0),
    ),
    "hopper": (
        ("speed:reward_forward+reward_healthy", "(m/s + 1)·steps", math.inf),
        ("energy:reward_ctrl", "(-0.001 control²)·steps", 0.0),
    ),
    "humanoid": (
        ("speed:reward_linvel+reward_alive", "(1.25 m/s + 5)·steps", math.inf),
        ("energy:reward_quadctrl", "(-0.1 control²)·steps", 0.0),
    ),
    "pusher": (
        ("distance:reward_dist+0.5*reward_near", "-m·steps", 0.0),
        ("energy:0.1*reward_ctrl", "(-0.1 control²)·steps", 0.0),
    ),
    "reacher": (
        ("distance:reward_dist", "-m·steps", 0.0),
        ("energy:reward_ctrl", "(-control²)·steps", 0.0),
    ),
    "walker2d": (
        ("speed:reward_forward+reward_healthy", "(m/s + 1)·steps", math.inf),
        ("energy:reward_ctrl", "(-0.001 control²)·steps", 0.0),
    ),
}


def make(
    name: str, /, objectives: str | None = None, time_limit: str | int = TIME_LIMIT, **options: Any
) -> Environment[Any]:
    """Return Brax's environment of this name. Options that are not ours go to it.

    Raises ValueError for a name, a group of terms or an option that is wrong, and for what of theirs breaks down.
    """
    with unseen():
        from brax import envs as theirs

        known = sorted(theirs._envs.keys() - OF_THEIR_TESTS)  # there is no other list
        if name not in known:
            raise ValueError(f"Brax has no {name!r}; it has {', '.join(known)}{did_you_mean(nearest(name, known))}")
        own = [each for each in inspect.signature(theirs._envs[name]).parameters if each != "kwargs"]
        kept, wrong = split_options(options, ("backend", "n_frames", *own))
        try:
            environment = _loaded(name, **kept)
        except Exception as error:
            raise ValueError("; ".join([*wrong, f"Brax refuses it: {failure(error)}"])) from error
    default = GROUPS.get(name, REWARD_AND_CONTROL)
    return adapt(f"brax:{name}", "Brax", environment, objectives, default, time_limit, wrong)


@cache  # so that the states that episodes start from are computed once
def _loaded(name: str, **options: Any) -> Any:
    from brax import envs as theirs

    return theirs.get_environment(name, **{option: literal(value) for option, value in options.items()})

"""MuJoCo Playground's environments: `playground:NAME`, with options `objectives`, `time_limit` and those of its config.

    playground:CheetahRun
    playground:WalkerWalk,objectives=move:move/energy:control
    playground:Go1JoystickFlatTerrain

Needs the `playground` extra. Its robots (locomotion and manipulation) come from MuJoCo Menagerie, which it downloads
when the first of them is made: that needs a network, once.
"""

import math
from collections.abc import Sequence
from functools import cache
from typing import Any

from envs.adapted import REWARD_AND_CONTROL, adapt, literal, split_options, unseen
from envs.core import Environment
from envs.failures import failure
from envs.names import did_you_mean, nearest

OURS = ("episode_length", "action_repeat")  # of a config: for their own training; `time_limit` is in place of the first
EFFORT = ("torques", "energy", "action_rate", "dof_acc", "dof_vel")  # terms that are about how the motors work


def make(
    name: str, /, objectives: str | None = None, time_limit: str | int | None = None, **options: Any
) -> Environment[Any]:
    """Return MuJoCo Playground's environment of this name. Options that are not ours change its config.

    Raises ValueError for a name, a group of terms or an option that is wrong, and for what of theirs breaks down.
    """
    with unseen():
        from mujoco_playground import dm_control_suite, registry

        if name not in registry.ALL_ENVS:
            near = did_you_mean(nearest(name, registry.ALL_ENVS))
            raise ValueError(f"MuJoCo Playground has no {name!r}; it has {', '.join(sorted(registry.ALL_ENVS))}{near}")
        config = registry.get_default_config(name)
        kept, wrong = split_options(options, [option for option in config if option not in OURS])
        try:
            environment = _loaded(name, **kept)
        except Exception as error:
            robots = name not in dm_control_suite.ALL_ENVS
            advice = "; its robots are downloaded when one is made first, which needs a network, once" if robots else ""
            refusal = f"MuJoCo Playground refuses it: {failure(error)}{advice}"
            raise ValueError("; ".join([*wrong, refusal])) from error
    limit = config.episode_length if time_limit is None else time_limit
    return adapt(
        f"playground:{name}", "MuJoCo Playground", environment, objectives, _groups(name, config), limit, wrong
    )


@cache  # so that the states that episodes start from are computed once
def _loaded(name: str, **options: Any) -> Any:
    from mujoco_playground import registry

    changes = {option: literal(value) for option, value in options.items()}
    return registry.load(name, config_overrides={"impl": "jax", **changes})


def _groups(name: str, config: Any) -> Sequence[tuple[str, str, float]]:
    """Return the default groups: for robots that walk the terms about motors and all others, else reward and control.

    Those of robots that walk add up to their reward, before they multiply it by a step's seconds and cut it off at 0.
    Terms of others are factors, or parts of what is no sum.
    """
    from mujoco_playground import locomotion

    scales = list(config.get("reward_config", {}).get("scales", {})) if name in locomotion.ALL_ENVS else []
    effort = [term for term in scales if term in EFFORT]
    task = [term for term in scales if term not in EFFORT]
    if not effort or not task:
        return REWARD_AND_CONTROL
    return (f"task:{'+'.join(task)}", "reward", math.inf), (f"effort:{'+'.join(effort)}", "reward", math.inf)

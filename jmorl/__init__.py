"""Interactive multi-objective reinforcement learning: a population trained in one JAX call, steered by a person.

The names here are all that a program needs; see the README. Settings are in `jmorl.config`, events in `jmorl.events`.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jmorl.config import Config, ConfigError, resolve
    from jmorl.decision.navigation import navigate
    from jmorl.decision.protocol import Answer, DecisionMaker, Question
    from jmorl.learning.devices import use_all_cpu_cores
    from jmorl.learning.population import TrainingFault
    from jmorl.loop import run
    from jmorl.storage.policy_file import load_policy, save_policy
    from jmorl.storage.resume import branch, resume
    from jmorl.storage.run_folder import RunFolder
    from jmorl.storage.stored_run import read_run

__all__ = [
    "Answer",
    "Config",
    "ConfigError",
    "DecisionMaker",
    "Question",
    "RunFolder",
    "TrainingFault",
    "branch",
    "load_policy",
    "navigate",
    "read_run",
    "resolve",
    "resume",
    "run",
    "save_policy",
    "use_all_cpu_cores",
]

# Imported when they are first used: JAX refuses to be imported where a variable of its own has a value that it cannot
# read, and the command line is to say so.
_HOMES = {
    "config": "Config ConfigError resolve",
    "decision.navigation": "navigate",
    "decision.protocol": "Answer DecisionMaker Question",
    "learning.devices": "use_all_cpu_cores",
    "learning.population": "TrainingFault",
    "loop": "run",
    "storage.policy_file": "load_policy save_policy",
    "storage.resume": "branch resume",
    "storage.run_folder": "RunFolder",
    "storage.stored_run": "read_run",
}


def __getattr__(name: str) -> Any:
    """The public name, from its module; or a module, such as `jmorl.events`."""
    for home, names in _HOMES.items():
        if name in names.split():
            return getattr(importlib.import_module(f"jmorl.{home}"), name)
    try:
        return importlib.import_module(f"jmorl.{name}")
    except ModuleNotFoundError as error:
        if error.name != f"jmorl.{name}":
            raise
        raise AttributeError(f"module 'jmorl' has no attribute {name!r}") from None

"""Interactive multi-objective reinforcement learning: a population trained in one JAX call, steered by a person.

The names here and in `envs` are all that a program needs; see the README.
"""

from jmorl.module_path import BESIDE  # noqa: F401  imported first: it decides which modules all others find

# isort: split
import importlib
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from envs import Objective
    from jmorl.config import Config, ConfigError, resolve
    from jmorl.decision.answers import Adjust, Answer, AnswerError, AskPair, Back, Choose, PointAnswer, Skip
    from jmorl.decision.navigation import NavigationFinished, PointDecided, navigate
    from jmorl.decision.protocol import (
        AnyQuestion,
        DecisionMaker,
        PairQuestion,
        PointQuestion,
        Question,
        WeightQuestion,
    )
    from jmorl.evaluation import export_blend
    from jmorl.events import Blended, Compiled, Decided, Event, GenerationFinished, Resumed, RunFinished, Seconds
    from jmorl.experiments.comparison import Comparison, Contender, compare
    from jmorl.learning.devices import use_all_cpu_cores
    from jmorl.learning.population import TrainingFault
    from jmorl.loop import run
    from jmorl.methods.base import Method, MethodError, PackedSearch, Problem, Tasks
    from jmorl.methods.registry import register_method
    from jmorl.search.families import Blending, Link
    from jmorl.search.policy import Blend, Policy
    from jmorl.search.prospect import Prospect
    from jmorl.state import RunState
    from jmorl.storage.policy_file import load_policy, save_policy
    from jmorl.storage.resume import blend, branch, resume
    from jmorl.storage.run_folder import RunFolder
    from jmorl.storage.stored_run import read_run

__version__ = version("jmorl")

__all__ = [
    "Adjust",
    "Answer",
    "AnswerError",
    "AnyQuestion",
    "AskPair",
    "Back",
    "Blend",
    "Blended",
    "Blending",
    "Choose",
    "Comparison",
    "Compiled",
    "Config",
    "ConfigError",
    "Contender",
    "Decided",
    "DecisionMaker",
    "Event",
    "GenerationFinished",
    "Link",
    "Method",
    "MethodError",
    "NavigationFinished",
    "Objective",
    "PackedSearch",
    "PairQuestion",
    "PointAnswer",
    "PointDecided",
    "PointQuestion",
    "Policy",
    "Problem",
    "Prospect",
    "Question",
    "Resumed",
    "RunFinished",
    "RunFolder",
    "RunState",
    "Seconds",
    "Skip",
    "Tasks",
    "TrainingFault",
    "WeightQuestion",
    "blend",
    "branch",
    "compare",
    "export_blend",
    "load_policy",
    "navigate",
    "read_run",
    "register_method",
    "resolve",
    "resume",
    "run",
    "save_policy",
    "use_all_cpu_cores",
]

# Imported when they are first used: JAX refuses to be imported where a variable of its own has a value that it cannot
# read, and the command line is to say so.
_HOMES = {
    "jmorl.config": "Config ConfigError resolve",
    "jmorl.decision.answers": "Adjust Answer AnswerError AskPair Back Choose PointAnswer Skip",
    "jmorl.decision.navigation": "NavigationFinished PointDecided navigate",
    "jmorl.decision.protocol": "AnyQuestion DecisionMaker PairQuestion PointQuestion Question WeightQuestion",
    "jmorl.evaluation": "export_blend",
    "jmorl.events": "Blended Compiled Decided Event GenerationFinished Resumed RunFinished Seconds",
    "jmorl.experiments.comparison": "Comparison Contender compare",
    "jmorl.learning.devices": "use_all_cpu_cores",
    "jmorl.learning.population": "TrainingFault",
    "jmorl.loop": "run",
    "jmorl.methods.registry": "register_method",
    "jmorl.methods.base": "Method MethodError PackedSearch Problem Tasks",
    "jmorl.search.families": "Blending Link",
    "jmorl.search.policy": "Blend Policy",
    "jmorl.search.prospect": "Prospect",
    "jmorl.state": "RunState",
    "jmorl.storage.policy_file": "load_policy save_policy",
    "jmorl.storage.resume": "blend branch resume",
    "jmorl.storage.run_folder": "RunFolder",
    "jmorl.storage.stored_run": "read_run",
    "envs": "Objective",
}


def __getattr__(name: str) -> Any:
    """Return a public name, from its module; or a module, such as `jmorl.events`."""
    for home, names in _HOMES.items():
        if name in names.split():
            return getattr(importlib.import_module(home), name)
    try:
        return importlib.import_module(f"jmorl.{name}")
    except ModuleNotFoundError as error:
        if error.name != f"jmorl.{name}":
            raise
        raise AttributeError(f"module 'jmorl' has no attribute {name!r}") from None


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})

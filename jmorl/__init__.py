"""Interactive multi-objective reinforcement learning: a population trained in one JAX call, steered by a person.

The names here and in `envs` are all that a program needs; see the README.
"""

from jmorl.module_path import BESIDE  # noqa: F401  imported first: it decides which modules all others find

# isort: split
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from envs import Objective
from jmorl.config import Config, ConfigError, resolve
from jmorl.decision.navigation import NavigationFinished, PointDecided, navigate
from jmorl.decision.protocol import (
    Adjust,
    Answer,
    AnswerError,
    AnyQuestion,
    Back,
    Choose,
    DecisionMaker,
    PairQuestion,
    PointAnswer,
    PointQuestion,
    Question,
    WeightQuestion,
)
from jmorl.events import Compiled, Decided, Event, GenerationFinished, Resumed, RunFinished, Seconds
from jmorl.learning.devices import use_all_cpu_cores
from jmorl.learning.population import TrainingFault
from jmorl.loop import run
from jmorl.methods.base import Method, PackedSearch, Problem, Prospect, Tasks
from jmorl.methods.registry import register as register_method
from jmorl.search.policy import Policy
from jmorl.state import RunState
from jmorl.storage.policy_file import load_policy, save_policy
from jmorl.storage.resume import branch, resume
from jmorl.storage.run_folder import RunFolder
from jmorl.storage.stored_run import read_run

__version__ = version("jmorl")
if TYPE_CHECKING:
    from jmorl.experiments import Comparison, Contender, compare
else:

    def __getattr__(name: str) -> Any:
        """Import what comparisons need when one of its names is used: a program that only trains does without."""
        if name not in ("Comparison", "Contender", "compare"):
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        from jmorl.experiments import comparison

        return getattr(comparison, name)

    def __dir__() -> list[str]:
        return sorted({*globals(), *__all__})


__all__ = [
    "Adjust",
    "Answer",
    "AnswerError",
    "AnyQuestion",
    "Back",
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
    "Method",
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
    "Tasks",
    "TrainingFault",
    "WeightQuestion",
    "branch",
    "compare",
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

"""Interactive multi-objective reinforcement learning: a population trained in one JAX call, steered by a person.

The names here are all that a program needs; see the README. Settings are in `jmorl.config`, events in `jmorl.events`.
"""

from typing import TYPE_CHECKING, Any

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
    "Answer",
    "Comparison",
    "Config",
    "ConfigError",
    "Contender",
    "DecisionMaker",
    "Question",
    "RunFolder",
    "TrainingFault",
    "branch",
    "compare",
    "load_policy",
    "navigate",
    "read_run",
    "resolve",
    "resume",
    "run",
    "save_policy",
    "use_all_cpu_cores",
]

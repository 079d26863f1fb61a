"""Interactive multi-objective reinforcement learning: a population trained in one JAX call, steered by a person.

The names here are all that a program needs; see the README. Settings are in `jmorl.config`, events in `jmorl.events`.
"""

import jmorl.module_path  # noqa: F401  it decides which modules the others find
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

"""What is found out about a run before anything is made or compiled for it."""

from typing import Any

from envs.checks import check_environment
from envs.core import Environment
from jmorl.config import Config
from jmorl.learning.execution import own_settings
from jmorl.learning.memory import check_memory


def check_run(environment: Environment[Any], config: Config, runs: int = 1) -> None:
    """Raise NotAsDeclared for an environment that is not what it says, DoesNotFit for a config that is too large.

    `runs` is how many of them share a program.
    """
    with own_settings():
        check_environment(environment)
        check_memory(environment, config, runs)

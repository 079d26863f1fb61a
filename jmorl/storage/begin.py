"""Beginning a new run: from what somebody has set to a folder that is ready to be trained in."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import envs
from jmorl.config import Config, ConfigError, resolve
from jmorl.storage.lock import FolderInUse
from jmorl.storage.resume import Continued, decision_maker
from jmorl.storage.run_folder import RUNS, RunFolder, check_free

Problems = Sequence[str]


def no_problems(config: Config | None) -> Problems:
    """Return no problems."""
    return ()


def begin(
    preset: str = "default",
    file: Path | None = None,
    overrides: Mapping[str, Any] | None = None,
    out: Path | None = None,
    force: bool = False,
    runs: Path = RUNS,
    problems_of: Callable[[Config | None], Problems] = no_problems,
) -> Continued:
    """Begin a run in the folder `out`, or in a new one in `runs` that is named after the time.

    Its settings are those of `resolve`; `force` is as in `RunFolder.create`. `problems_of` says what else is wrong with
    the run; it is given the config, or None if that could not be resolved. Raises ConfigError with every problem, those
    of the folder among them, and FolderInUse and NotAsDeclared as `RunFolder.create` does; nothing is made then.
    """
    problems: list[str] = []
    config = user = None
    try:
        config = resolve(preset, file, overrides)
        user = decision_maker(config.user, envs.make(config.env).objectives)
    except ConfigError as error:
        problems += error.problems
    problems += problems_of(config)
    try:
        if out:
            check_free(out, force)
    except FolderInUse as error:
        problems.append(f"out: {error}")
    if problems or config is None:
        raise ConfigError(problems)
    return Continued(RunFolder.create(out, config, envs.make(config.env), force, runs=runs), None, user=user)

"""The form of a new run: what is filled in, what is wrong with it, and the run that it begins.

Whoever fills it in may sit anywhere, so it names no file and no module: a folder name stays in the folder of runs, and
nothing is imported that this process has not imported.
"""

import os
import sys
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import envs
from jmorl.config import Config, ConfigError, resolve
from jmorl.display.commands import command
from jmorl.storage.begin import begin
from jmorl.storage.resume import Continued
from jmorl.studio.view import PERSON

FIELDS = ("env", "steps", "seed", "ask", "question")  # that are settings


@dataclass(frozen=True)
class Form:
    """What somebody has filled in. Numbers are texts, as on the command line; an empty one is as the preset has it."""

    env: str = Config.model_fields["env"].default
    preset: str = "default"
    steps: str = ""
    seed: str = ""
    ask: str = ""
    question: str = ""
    name: str = ""  # of the run's folder; empty: the time
    more: str = ""  # settings as TOML, which count more than the fields above

    def begin(self, runs: Path) -> Continued:
        """Begin the run, in the folder `runs`. Raises as `jmorl.storage.begin` does, and then nothing is made."""
        more, unreadable = self._more()
        fields = {name: getattr(self, name).strip() for name in FIELDS}
        given = {**{name: value for name, value in fields.items() if value}, **more}
        outside, name = _outside(given), self.name.strip()
        problems = [*unreadable, *outside.values(), *_problems_of_name(name, runs)]
        if "env" in outside:  # nothing else can be judged without it
            raise ConfigError(problems)
        overrides = {"user": PERSON, **{name: value for name, value in given.items() if name not in outside}}
        out = runs / name if name and not problems else None
        return begin(self.preset, overrides=overrides, out=out, runs=runs, problems_of=lambda config: problems)

    def usual(self) -> Config | None:
        """Return what the preset has for the environment; None if it has nothing."""
        try:
            return resolve(self.preset, overrides={"env": self.env, "user": PERSON})
        except ConfigError:
            return None

    def _more(self) -> tuple[dict[str, Any], list[str]]:
        """Return the settings that are written as TOML, and why they cannot be read, if they cannot."""
        try:
            return tomllib.loads(self.more), []
        except (ValueError, RecursionError) as error:
            return {}, [f"more settings: {error}"]


def environments(also: str | None = None) -> dict[str, tuple[str, ...]]:
    """Return the environments that any process knows, and one more: the labels of their objectives, by id."""
    known = [id for id in envs.ids() if _package(envs.registry[id]) == envs.__name__]
    also_known = [] if also is None or also in known else [also]
    return {id: tuple(each.label for each in envs.make(id).objectives) for id in (*known, *also_known)}


def _package(factory: object) -> str:
    """Return the package that an environment comes from."""
    return getattr(factory, "__module__", "").partition(".")[0]


def _outside(settings: Mapping[str, Any]) -> dict[str, str]:
    """Return which settings name a file, or a module that is not imported yet, and what to do about it."""
    user, env, method = (str(settings.get(name, "")).strip() for name in ("user", "env", "method"))
    problems = {}
    if user.startswith("script"):
        problems["user"] = f"user: this page opens no files; begin the run with {command('studio', '--user', user)}"
    modules = {"env": (env, envs.module_of(env)), "method": (method, method.rpartition(":")[0])}
    for name, (written, module) in modules.items():
        if module and module not in sys.modules:
            begun = command("studio", f"--{name}", written)
            problems[name] = f"{name}: this page imports no modules; begin the run with {begun}"
    return problems


def _problems_of_name(name: str, runs: Path) -> list[str]:
    """Return what is wrong with the name of a new folder in `runs`; an empty one stands for the time."""
    if not name:
        return []
    if name.startswith(".") or set(name) & set("/\\") or not name.isprintable():
        return [f"folder: {name!r} must be the name of one folder, without / and \\, and not begin with a dot"]
    if os.path.lexists(runs / name):
        return [f"folder: there already is {name!r}; take another name"]
    return []

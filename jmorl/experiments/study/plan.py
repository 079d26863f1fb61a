"""The plan of a study, a TOML file: users, contenders and seeds, and the runs that they make.

    seeds = [1, 2, 3]

    [contenders]                   # their settings
    interactive = {}
    PGMORL = { method = "pgmorl" }

    [[parts]]                      # all of one environment and budget; `contenders` are all, or those named
    name = "mountaincar"
    env = "mo-mountaincarcontinuous-v0"
    steps = 2_500_000
    best = "../exact_front.json"   # optional: a file of the best there is; else it is the best of all runs
    users = { A = "A", "almost A" = "A,random=0.2", "a target" = "target=-60,-50" }

A contender that asks nobody before its end makes one run for all users of a part.
"""

import json
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ConfigDict, TypeAdapter, ValidationError

import envs
from jmorl.config import Config, ConfigError, resolve
from jmorl.decision.protocol import DecisionMaker
from jmorl.decision.target import TargetUser
from jmorl.decision.users import make_user
from jmorl.experiments.cells import Cell
from jmorl.experiments.naming import is_name
from jmorl.experiments.record import RunRecord, read_record
from jmorl.loop import make_method

OF_A_PART = ("env", "steps", "user", "seed")  # settings that no contender has
EVERYBODY = "everybody"  # whose run it is that serves all users


@dataclass(frozen=True)
class StudyPart:
    """The runs in one environment, with one budget."""

    __pydantic_config__ = ConfigDict(extra="forbid")

    name: str
    env: str
    steps: int
    users: dict[str, str]  # name -> as `--user` takes it
    contenders: tuple[str, ...] = ()  # of the study's; empty: all
    best: str | None = None  # a file with vectors that are the best there is


@dataclass(frozen=True)
class Study:
    """Users, contenders and seeds."""

    __pydantic_config__ = ConfigDict(extra="forbid")

    seeds: tuple[int, ...]
    contenders: dict[str, dict[str, Any]]  # name -> settings
    parts: tuple[StudyPart, ...]
    records: tuple[str, ...] = ()  # folders with records of other comparisons that are taken where they fit
    folder: Path = Path()  # of the plan, to which all paths in it are relative

    def contenders_of(self, part: StudyPart) -> tuple[str, ...]:
        """Return the names of a part's contenders, in the order of the study."""
        return tuple(name for name in self.contenders if not part.contenders or name in part.contenders)

    def config(self, part: StudyPart, contender: str, user: str | None, seed: int) -> Config:
        """Return the settings of a run; without a user, of one whom any result will do. Raises ConfigError."""
        objectives = len(envs.make(part.env).objectives)
        nobody = "A" if objectives == 2 else f"weights={','.join('1' * objectives)}"
        given = {"env": part.env, "user": part.users[user] if user else nobody, "seed": seed, "steps": part.steps}
        return resolve(overrides={**self.contenders[contender], **given, "checkpoints": {"keep": 2}})

    def cell(self, part: StudyPart, contender: str, user: str, seed: int) -> Cell:
        """Return the run of a contender for a user; for one that asks nobody, the run for everybody."""
        if not self.asks(part, contender):
            return Cell(
                file_name(part.name, contender, EVERYBODY, f"seed {seed}"), self.config(part, contender, None, seed)
            )
        return Cell(file_name(part.name, contender, user, f"seed {seed}"), self.config(part, contender, user, seed))

    def cells(self, part: StudyPart) -> list[Cell]:
        """Return the runs of a part: seed by seed, so that what there is of a study is about all of it."""
        return [
            self.cell(part, contender, user, seed)
            for seed, user, contender in product(self.seeds, part.users, self.contenders_of(part))
        ]

    def asks(self, part: StudyPart, contender: str) -> bool:
        """Return whether a contender asks anybody before its end."""
        config = self.config(part, contender, None, self.seeds[0])
        found = make_method(config, envs.make(part.env))
        return found.generations_to_question(found.initial_state()) is not None

    def user(self, part: StudyPart, user: str) -> DecisionMaker:
        """Return a user, to judge what came out."""
        return make_user(part.users[user], envs.make(part.env).objectives)

    def made_elsewhere(self, cells: Sequence[Cell]) -> dict[str, RunRecord]:
        """Return the records of other comparisons that are of these runs, by the cell's key. Raises RecordError."""
        paths = [path for folder in self.records for path in sorted((self.folder / folder).glob("*.json"))]
        there = [read_record(path) for path in paths]
        return {cell.key: record for cell in cells for record in there if cell.config.is_identified_by(record.digest)}

    def exact(self, part: StudyPart) -> np.ndarray | None:
        """Return the vectors [N, M] that are the best there is, if the plan has a file of them. Raises ConfigError."""
        if part.best is None:
            return None
        names = [objective.name for objective in envs.make(part.env).objectives]
        path = self.folder / part.best
        try:
            front = json.loads(path.read_text(encoding="utf-8"))["front"]
            vectors = np.array([[float(point[name]) for name in names] for point in front])
        except FileNotFoundError:
            raise ConfigError([f"best: there is no file {path}"]) from None
        except (OSError, ValueError, KeyError, TypeError, IndexError) as error:
            raise ConfigError([f"best: {path} has no front of {', '.join(names)}: {error!r}"]) from None
        if not len(vectors) or not np.isfinite(vectors).all():
            raise ConfigError([f"best: {path} must have at least one point, and finite numbers"])
        return vectors


_STUDY: TypeAdapter[Study] = TypeAdapter(Study)


def read_plan(path: Path) -> Study:
    """Read a plan. Raises ConfigError with all that is wrong, before any run is made."""
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise ConfigError([f"{path} cannot be read: {error}"]) from None
    try:
        study = _STUDY.validate_python({**content, "folder": path.parent})
    except ValidationError as error:
        wrong = [f"{'.'.join(map(str, each['loc']))}: {each['msg']}" for each in error.errors()]
        raise ConfigError([f"{path}: {each}" for each in wrong]) from None
    problems = list(dict.fromkeys(_problems(study)))
    if problems:
        raise ConfigError([f"{path}: {problem}" for problem in problems])
    return study


def _problems(study: Study) -> Iterator[str]:
    for what, given in (("seed", study.seeds), ("contender", study.contenders), ("part", study.parts)):
        if not given:
            yield f"there is no {what}"
    if len(set(study.seeds)) < len(study.seeds):
        yield "a seed is given twice"
    for name, settings in study.contenders.items():
        for key in (key for key in OF_A_PART if key in settings):
            yield f"contender {name}: {key} belongs to the part, or to the study"
    for folder in (folder for folder in study.records if not (study.folder / folder).is_dir()):
        yield f"records: there is no folder {study.folder / folder}"
    users = [user for part in study.parts for user in part.users]
    for what, names in (
        ("parts", [part.name for part in study.parts]),
        ("contenders", list(study.contenders)),
        *((f"users of part {part.name}", list(part.users)) for part in study.parts),
    ):
        files = [file_name(name) for name in names]
        for file in sorted({file for file in files if files.count(file) > 1}):
            same = " and ".join(repr(name) for name in names if file_name(name) == file)
            yield f"two {what} have one name for files: {same}"
    for name in (*study.contenders, *(part.name for part in study.parts), *users):
        if not is_name(name):
            yield f"{name!r}: files are named after it; write it with letters, digits and spaces"
    for part in study.parts:
        if not part.users:
            yield f"part {part.name} has no users"
        for contender in (each for each in part.contenders if each not in study.contenders):
            yield f"part {part.name}: there is no contender {contender!r}; there are {', '.join(study.contenders)}"
        try:
            objectives = len(envs.make(part.env).objectives)
        except (ConfigError, ValueError) as error:
            yield f"part {part.name}: {error}"
            continue
        for contender, seed in product(study.contenders_of(part), study.seeds):
            try:
                study.config(part, contender, None, seed)
            except (ConfigError, ValueError) as error:
                yield f"part {part.name}, {contender}, seed {seed}: {error}"
        for user in part.users:
            try:
                judge = study.user(part, user)
            except ValueError as error:
                yield f"part {part.name}, user {user}: {error}"
                continue
            if not isinstance(judge, TargetUser) and judge.utility(np.zeros((1, objectives))) is None:
                yield f"part {part.name}: {user} has no utility by which runs could be compared: {part.users[user]}"
        try:
            study.exact(part)
        except ConfigError as error:
            yield f"part {part.name}: {error}"


def file_name(*parts: str) -> str:
    """Return a name for files, without spaces."""
    return "-".join(parts).replace(" ", "_")

"""A comparison of contenders, one's own methods and users among them: the steps that each needs to targets."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np

from jmorl.config import Config, ConfigError, resolve
from jmorl.decision.answers import Answer
from jmorl.decision.protocol import DecisionMaker, Question
from jmorl.decision.target import TargetUser
from jmorl.experiments import tables
from jmorl.experiments.cells import Cell, Places, distinct, known, missing
from jmorl.experiments.naming import is_name
from jmorl.experiments.runner import make
from jmorl.experiments.targets import TargetRow, target_row
from jmorl.storage.files import write_text


@dataclass(frozen=True)
class Contender:
    """A method to compare: its settings, and who decides in it, given the target [M].

    Environment, user and seed of the config are filled in. Runs are known by their settings and the contender's name:
    when the code of a decision maker changes, its name should, too.
    """

    config: Config
    decision_maker: Callable[[np.ndarray], DecisionMaker] = TargetUser


@dataclass(frozen=True)
class Comparison:
    """The steps that contenders need to targets: a row for each target and contender."""

    rows: tuple[TargetRow, ...]

    def markdown(self) -> str:
        """Lay out the tables: restricted mean steps and what each contender saves, every seed, and the searches."""
        parts = [tables.steps_used(self.rows), tables.seed_by_seed(self.rows), tables.mechanisms(self.rows)]
        return "\n\n".join(parts) + "\n"


def compare(
    environment: str,
    contenders: Mapping[str, Contender],
    targets: Mapping[str, Sequence[float]],
    seeds: Sequence[int],
    out: Path,
) -> Comparison:
    """Train every contender to every target [M] with every seed, and say how many steps each needs.

    A run ends when a policy is at least as good as the target in every objective, or with the budget of its config. The
    folder `out` keeps the runs, so that a second call only makes what is missing, and gets `REPORT.md` with the tables.
    Contenders with other numbers of agents or steps per generation may be compared; intervals are over seeds. A run
    that breaks down counts as not reaching what it had not reached.

    Raises ConfigError with all that is wrong before anything is made (unequal budgets, say), and RecordError for a file
    in `out` that is not the record of a run.
    """
    cells = _cells(environment, contenders, targets, seeds)
    places = Places(out / "records", out / "work")
    rows = []
    for (target, name), some in cells.items():
        contender, values = contenders[name], targets[target]
        for cell in missing(some, places):
            make([cell], places, lambda *_: None, partial(_user, contender, values))
        records = tuple(known(some, places).values())
        rows.append(target_row(target, values, name, seeds, records, contender.config.steps))
    comparison = Comparison(tuple(rows))
    write_text(out / "REPORT.md", comparison.markdown())
    return comparison


def _cells(
    environment: str, contenders: Mapping[str, Contender], targets: Mapping[str, Sequence[float]], seeds: Sequence[int]
) -> dict[tuple[str, str], list[Cell]]:
    """Return the runs of each target and contender. Raises ConfigError with all that is wrong."""
    problems = {problem: problem for problem in _problems(contenders, targets, seeds)}
    cells: dict[tuple[str, str], list[Cell]] = {}
    for target, name, seed in product(targets, contenders, seeds):
        try:
            cell = _cell(environment, name, contenders[name], target, targets[target], seed)
            cells.setdefault((target, name), []).append(cell)
        except ConfigError as error:  # the same problem of many runs is told of the first
            problems |= {each: f"{name}, target {target}: {each}" for each in error.problems if each not in problems}
    if problems:
        raise ConfigError(list(problems.values()))
    every = [cell for some in cells.values() for cell in some]
    if len(distinct(every)) < len(every):
        raise ConfigError(["two runs would have the same name: rename a contender or a target"])
    return cells


def _problems(
    contenders: Mapping[str, Contender], targets: Mapping[str, Sequence[float]], seeds: Sequence[int]
) -> Iterator[str]:
    """Yield what is wrong before any run is looked at."""
    for what, given in (("contender", contenders), ("target", targets), ("seed", seeds)):
        if not len(given):
            yield f"there is no {what} to compare with"
    for what, names in (("contender", contenders), ("target", targets)):
        for name in names:
            if not is_name(name):
                yield f"{what} {name!r}: files are named after it; write it with letters, digits, spaces and . _ + = -"
    for seed, count in Counter(seeds).items():
        if count > 1:
            yield f"seed {seed} is given {count} times"
    budgets = {name: contender.config.steps for name, contender in contenders.items()}
    if len(set(budgets.values())) > 1:  # steps used would be censored at different places
        told = ", ".join(f"{name} {steps}" for name, steps in budgets.items())
        yield f"contenders are compared within one budget of steps; theirs are: {told}"


def _cell(environment: str, name: str, contender: Contender, target: str, values: Sequence[float], seed: int) -> Cell:
    """Return one run. Raises ConfigError for settings that do not fit the environment."""
    user = f"target={','.join(map(_exactly, values))}"
    config = resolve(overrides=contender.config.model_dump() | {"env": environment, "user": user, "seed": seed})
    return Cell(f"{name}-target-{target}-seed-{seed}", config)


def _exactly(value: float) -> str:
    """Write a number shortly, but so that reading it gives the same number: a run is known by its settings."""
    short = f"{value:g}"
    return short if float(short) == value else repr(float(value))


class _Until(DecisionMaker):
    """Somebody who decides as they like, in a run that ends when the target is reached."""

    def __init__(self, user: DecisionMaker, target: TargetUser):
        self.user, self.target = user, target
        self.patient = user.patient

    def answer(self, question: Question) -> Answer:
        return self.user.answer(question)

    def satisfied(self, values: np.ndarray) -> bool:
        return self.target.satisfied(values)


def _user(contender: Contender, target: Sequence[float]) -> DecisionMaker:
    """Return who decides in a run of the contender to the target [M]."""
    goal = np.array(target, float)
    return _Until(contender.decision_maker(goal), TargetUser(goal))

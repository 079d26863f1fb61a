"""A comparison of contenders, one's own methods and users among them: the steps that each needs to targets."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from jmorl.config import Config, resolve
from jmorl.decision.protocol import Answer, DecisionMaker, Question
from jmorl.decision.target import TargetUser
from jmorl.experiments import tables
from jmorl.experiments.cells import Cell, Places, known, missing
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
    that breaks down counts as not reaching what it had not reached. Raises ValueError if the budgets are not equal.
    """
    budget = _budget(contenders)
    places = Places(out / "records", out / "work")
    rows = []
    for target, values in targets.items():
        for name, contender in contenders.items():
            cells = [_cell(environment, name, contender, target, values, seed) for seed in seeds]
            for cell in missing(cells, places):
                make([cell], places, lambda *_: None, partial(_user, contender, values))
            records = tuple(known(cells, places).values())
            rows.append(target_row(target, values, name, seeds, records, budget))
    comparison = Comparison(tuple(rows))
    write_text(out / "REPORT.md", comparison.markdown())
    return comparison


def _budget(contenders: Mapping[str, Contender]) -> int:
    """Return the one budget of all contenders: with others, steps used would be censored at different places."""
    budgets = {name: contender.config.steps for name, contender in contenders.items()}
    if len(set(budgets.values())) != 1:
        told = ", ".join(f"{name} {steps}" for name, steps in budgets.items()) or "none"
        raise ValueError(f"contenders are compared within one budget of steps; theirs are: {told}")
    return next(iter(budgets.values()))


def _cell(environment: str, name: str, contender: Contender, target: str, values: Sequence[float], seed: int) -> Cell:
    """Return one run. Raises ConfigError for settings that do not fit the environment."""
    user = f"target={','.join(f'{value:g}' for value in values)}"
    config = resolve(overrides=contender.config.model_dump() | {"env": environment, "user": user, "seed": seed})
    return Cell(f"{name}-target-{target}-seed-{seed}", config)


class _Until(DecisionMaker):
    """Somebody who decides as they like, in a run that ends when the target is reached."""

    def __init__(self, user: DecisionMaker, target: TargetUser):
        self.user, self.target = user, target

    def answer(self, question: Question) -> Answer:
        return self.user.answer(question)

    def satisfied(self, values: np.ndarray) -> bool:
        return self.target.satisfied(values)


def _user(contender: Contender, target: Sequence[float]) -> DecisionMaker:
    """Return who decides in a run of the contender to the target [M]."""
    goal = np.array(target, float)
    return _Until(contender.decision_maker(goal), TargetUser(goal))

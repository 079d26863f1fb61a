"""The paper's comparison as a tool: the same tables for somebody's own interactive method."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from jmorl.config import Config, resolve
from jmorl.decision.protocol import Answer, DecisionMaker, Question
from jmorl.decision.target import TargetUser
from jmorl.paper import markdown
from jmorl.paper.plan import Cell
from jmorl.paper.record import read_record
from jmorl.paper.results import TargetRow, compared, target_row
from jmorl.paper.runner import Places, make, missing
from jmorl.storage.files import write_text

MakeUser = Callable[[np.ndarray], DecisionMaker]  # target [M] -> who decides


@dataclass(frozen=True)
class Method:
    """A method to compare: its settings, and who decides in it, given the target.

    Environment, user and seed of the config are filled in. Runs are known by their settings and the method's name: when
    the code of a decision maker changes, its name should, too.
    """

    config: Config
    decision_maker: MakeUser = TargetUser


@dataclass(frozen=True)
class Comparison:
    """Steps that methods need to targets."""

    rows: tuple[TargetRow, ...]

    def markdown(self) -> str:
        """The tables: restricted mean steps, every seed, and what each method saves against the last one."""
        lines = [
            [row.target, row.method, markdown.between(row.times.restricted_mean), _successes(row), self._saved(row)]
            for row in self.rows
        ]
        last = self.rows[-1].method
        head = ["target", "method", "million steps used", "reached", f"million steps saved against {last}"]
        parts = [markdown.table(head, lines), markdown.seed_by_seed(self.rows), markdown.mechanisms(self.rows)]
        return "\n\n".join(parts) + "\n"

    def _saved(self, row: TargetRow) -> str:
        """Against the last method, on the same target."""
        baseline = [other for other in self.rows if other.target == row.target][-1]
        difference = None if row is baseline else compared(row, baseline)
        return markdown.between(difference) if difference else ""


def compare(
    environment: str,
    methods: Mapping[str, Method],
    targets: Mapping[str, Sequence[float]],
    seeds: Sequence[int],
    out: Path,
) -> Comparison:
    """Train every method to every target with every seed, and say how many steps each needs.

    A run ends when a policy is at least as good as the target in every objective, or with the budget of its config. The
    folder `out` keeps the runs, so that a second call only makes what is missing, and gets `REPORT.md` with the tables.
    Methods with other numbers of agents or steps per generation may be compared; intervals are over seeds. A run that
    breaks down counts as not reaching what it had not reached. Raises ValueError if the budgets are not equal.
    """
    budget = _budget(methods)
    places = Places(out / "records", out / "work")
    rows = []
    for target, values in targets.items():
        for name, method in methods.items():
            cells = [_cell(environment, name, method, target, values, seed) for seed in seeds]
            for cell in missing(cells, places):
                make([cell], places, lambda *_: None, partial(_user, method, values))
            records = [read_record(places.record(cell)) for cell in cells]
            rows.append(target_row(target, values, name, seeds, records, budget))
    comparison = Comparison(tuple(rows))
    write_text(out / "REPORT.md", comparison.markdown())
    return comparison


def _budget(methods: Mapping[str, Method]) -> int:
    """The one budget of all methods: with others, steps used would be censored at different places."""
    budgets = {name: method.config.steps for name, method in methods.items()}
    if len(set(budgets.values())) != 1:
        told = ", ".join(f"{name} {steps}" for name, steps in budgets.items()) or "none"
        raise ValueError(f"methods are compared within one budget of steps; theirs are: {told}")
    return next(iter(budgets.values()))


def _cell(environment: str, name: str, method: Method, target: str, values: Sequence[float], seed: int) -> Cell:
    user = f"target={','.join(f'{value:g}' for value in values)}"
    config = resolve(overrides=method.config.model_dump() | {"env": environment, "user": user, "seed": seed})
    return Cell(f"{name}-target-{target}-seed-{seed}", config)


class _Until(DecisionMaker):
    """Somebody who decides as they like, in a run that ends when the target is reached."""

    def __init__(self, user: DecisionMaker, target: TargetUser):
        self.user, self.target = user, target

    def answer(self, question: Question) -> Answer:
        return self.user.answer(question)

    def satisfied(self, values: np.ndarray) -> bool:
        return self.target.satisfied(values)


def _user(method: Method, target: Sequence[float]) -> DecisionMaker:
    goal = np.array(target, float)
    return _Until(method.decision_maker(goal), TargetUser(goal))


def _successes(row: TargetRow) -> str:
    return f"{row.times.successes} of {len(row.seeds)}"

"""What is known beforehand: the published numbers, and what the experiment in raw units fixed."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

from pydantic import TypeAdapter

Targets = Mapping[str, tuple[float, ...]]  # name -> [M]


@dataclass(frozen=True)
class PublishedRow:
    """One line of Table 1 or 2. A mean counts a run that timed out at the cap; None: no run succeeded."""

    target: str
    method: str
    mean_steps: float | None
    std_steps: float | None
    seconds: float
    timeouts: int


@dataclass(frozen=True)
class PublishedTable:
    """Table 1 or 2."""

    env: str
    cap_steps: int
    targets: Targets
    rows: tuple[PublishedRow, ...]

    def row(self, target: str, method: str) -> PublishedRow:
        return next(row for row in self.rows if (row.target, row.method) == (target, method))

    def mean_steps(self, target: str, method: str) -> float:
        """The restricted mean: without a success, the cap."""
        return self.row(target, method).mean_steps or self.cap_steps


@dataclass(frozen=True)
class Published:
    """The paper's numbers, and what its text says of its figures: which method is better for which user."""

    source: str
    tables: Mapping[str, PublishedTable]
    claims: Mapping[str, Mapping[str, str]]


@dataclass(frozen=True)
class Honest:
    """What was fixed for an environment in raw units, before the comparison, and why."""

    targets: Targets | None  # None: not fixed yet
    targets_reason: str
    span: tuple[float, ...] | None  # [M] what normalised utilities divide by
    span_reason: str


@cache
def published() -> Published:
    return TypeAdapter(Published).validate_json(_text("published.json"))


@cache
def honest(env: str) -> Honest:
    """For an environment id of the experiment."""
    fixed = TypeAdapter(dict[str, str | Honest]).validate_json(_text("honest.json"))[env]
    assert isinstance(fixed, Honest)
    return fixed


def _text(name: str) -> str:
    return files(__package__).joinpath(name).read_text(encoding="utf-8")

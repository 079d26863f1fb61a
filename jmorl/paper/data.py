"""Data known before the runs: the published numbers, and what the experiment in raw units fixed."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from typing import ClassVar

from pydantic import TypeAdapter

Targets = Mapping[str, tuple[float, ...]]  # name -> [M]


@dataclass(frozen=True)
class PublishedRow:
    """One line of Table 1 or 2. A mean counts a run that timed out at the cap; None: no run succeeded."""

    RUNS: ClassVar[int] = 5

    target: str
    method: str
    mean_steps: float | None
    std_steps: float | None
    seconds: float
    timeouts: int
    std_printed: float | None = None  # where `std_steps` is not what the paper prints

    @property
    def successes(self) -> int:
        """How many runs reached the target."""
        return self.RUNS - self.timeouts


@dataclass(frozen=True)
class PublishedTable:
    """Table 1 or 2."""

    env: str
    cap_steps: int
    targets: Targets
    rows: tuple[PublishedRow, ...]

    def row(self, target: str, method: str) -> PublishedRow:
        """Return the row of a target and a method."""
        return next(row for row in self.rows if (row.target, row.method) == (target, method))

    def mean_steps(self, target: str, method: str) -> float:
        """Return the restricted mean: without a success, the cap."""
        return self.row(target, method).mean_steps or self.cap_steps

    @property
    def seconds(self) -> float:
        """Of all runs."""
        return sum(row.seconds * row.RUNS for row in self.rows)


@dataclass(frozen=True)
class Claims:
    """What the text says of a figure."""

    text: str
    ahead: Mapping[str, str] = field(default_factory=dict)  # user -> the method that ends higher, or "comparable"
    also: tuple[str, ...] = ()  # names of other statements, see `jmorl.paper.claims`


@dataclass(frozen=True)
class Published:
    """The paper's numbers, and what its text says of its figures: which method is better for which user."""

    source: str
    tables: Mapping[str, PublishedTable]
    claims: Mapping[str, Claims]


@dataclass(frozen=True)
class Honest:
    """What was fixed for an environment in raw units, before the comparison, and why."""

    targets: Targets
    targets_reason: str
    span: tuple[float, ...] | None  # [M] what normalised utilities divide by
    span_reason: str


@cache
def published() -> Published:
    """Return the paper's published numbers."""
    return TypeAdapter(Published).validate_json(_text("published.json"))


@cache
def honest(env: str) -> Honest:
    """Return the settings of the experiment for an environment id."""
    fixed = TypeAdapter(dict[str, str | Honest]).validate_json(_text("honest.json"))[env]
    assert isinstance(fixed, Honest)
    return fixed


def _text(name: str) -> str:
    return files(__package__).joinpath(name).read_text(encoding="utf-8")

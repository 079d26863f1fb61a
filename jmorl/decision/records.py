"""The decision log: one JSON object per line for every question answered, with what was shown.

A steering or final decision:

    {"format": 1, "purpose": "steer", "generation": 3, "policy": 17, "values": [-66.0, -57.3],
     "stop": false, "generations": 1, "shown": [{"policy": 17, "values": [-66.0, -57.3]}, ...]}

An answer of E-NAUTILUS, where `shown` has the policies that the points head for:

    {"format": 1, "purpose": "enautilus", "generation": 9, "number": 0, "answer": {"point": 1}, "shown": [...]}

with the answers {"point": index}, {"steps": back} and {"iterations_left": h, "points": n}. `stop`, `generations` and
the `shown` of a decision may be left out of a log written by hand.

A decision that a stand-in took has `"stand_in": true`, and format 3. One with more than a preferred policy has format
4, and what there is of `"ranking": [17, 4, 9]`, those shown from the best down; `"equal": true`, no difference between
those shown; `"limits": [null, -45.0]`, what each objective must reach from then on, null where anything will do; and
`"again": true` for the second question about one choice. The run went on with `policy`.

An answer to a question of any other kind, where `answer` is as that kind writes it:

    {"format": 2, "purpose": "pair", "generation": 3, "answer": {"preferred": 17}, "shown": [...]}
"""

import json
import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Discriminator, Field, Tag, TypeAdapter, ValidationError

from jmorl.decision.answers import Answer, Choose, PointAnswer
from jmorl.decision.protocol import AnyQuestion, PointQuestion, Question
from jmorl.search.policy import Policy

FORMAT = 4  # the newest of any record
OTHER_KIND_FORMAT = 2

Finite = Annotated[float, Field(allow_inf_nan=False)]
Values = Annotated[tuple[Finite, ...], Field(min_length=1)]  # [M], raw units


class ScriptError(ValueError):
    """A decision log that cannot be read, or does not fit the run it is replayed in."""


@dataclass(frozen=True)
class Shown:
    """A policy among which was chosen."""

    __pydantic_config__ = ConfigDict(extra="forbid")

    policy: int
    values: Values


@dataclass(frozen=True)
class DecisionRecord:
    """An answered `Question`."""

    __pydantic_config__ = ConfigDict(extra="forbid")

    purpose: Literal["steer", "final"]
    generation: Annotated[int, Field(ge=1)]
    policy: int
    values: Values
    stop: bool = False
    generations: Annotated[int, Field(ge=1)] = 1
    shown: tuple[Shown, ...] = ()
    stand_in: bool = False
    ranking: tuple[Annotated[int, Field(ge=0)], ...] = ()
    equal: bool = False
    limits: tuple[Finite | None, ...] | None = None  # [M]
    again: bool = False
    format: Literal[1, 3, 4] = 1

    @property
    def answer(self) -> Answer:
        """The answer that was given."""
        return Answer(
            self.policy,
            self.stop,
            self.generations,
            self.stand_in,
            ranking=self.ranking,
            equal=self.equal,
            limits=tuple(-math.inf if limit is None else limit for limit in self.limits) if self.limits else None,
        )


@dataclass(frozen=True)
class PointRecord:
    """An answered `PointQuestion`."""

    __pydantic_config__ = ConfigDict(extra="forbid")

    generation: Annotated[int, Field(ge=0)]
    number: Annotated[int, Field(ge=0)]
    answer: PointAnswer
    shown: tuple[Shown, ...]
    purpose: Literal["enautilus"] = "enautilus"
    format: Literal[1] = 1

    def __post_init__(self) -> None:
        if isinstance(self.answer, Choose) and not 0 <= self.answer.point < len(self.shown):
            raise ValueError(f"answer: point {self.answer.point} is none of the {len(self.shown)} shown, from 0")


@dataclass(frozen=True)
class AnswerRecord:
    """An answered question of any other kind."""

    __pydantic_config__ = ConfigDict(extra="forbid")

    purpose: Annotated[str, Field(min_length=1)]
    generation: Annotated[int, Field(ge=0)]
    answer: dict[str, Any]
    shown: tuple[Shown, ...] = ()
    format: Literal[2] = 2


Record = DecisionRecord | PointRecord | AnswerRecord


def _kind(record: Any) -> str:
    """Return which kind of record the fields are of."""
    fields = record if isinstance(record, dict) else vars(record)
    known = {"steer": "decision", "final": "decision", "enautilus": "point"}
    return known.get(str(fields.get("purpose")), "answer" if fields.get("format") == OTHER_KIND_FORMAT else "")


_RECORD: TypeAdapter[Record] = TypeAdapter(
    Annotated[
        Annotated[DecisionRecord, Tag("decision")]
        | Annotated[PointRecord, Tag("point")]
        | Annotated[AnswerRecord, Tag("answer")],
        Discriminator(_kind),
    ]
)


def record_of(question: AnyQuestion, answer: Any) -> DecisionRecord | AnswerRecord:
    """Return the record of a question in a run and of its checked answer."""
    if isinstance(question, Question):
        return decision_record(question, answer)
    return AnswerRecord(question.purpose, question.generation, question.to_json(answer), _shown(question.shown))


def decision_record(question: Question, answer: Answer) -> DecisionRecord:
    """Return the record of a choice. Raise ValueError for a purpose that is never logged."""
    if question.purpose == "enautilus" or question.purpose == "pair":
        raise ValueError(f"a choice with the purpose {question.purpose!r} is logged as the question it belongs to")
    chosen = question.policy(answer.policy)
    return DecisionRecord(
        question.purpose,
        question.generation,
        chosen.id,
        _values(chosen),
        answer.stop,
        answer.generations,
        _shown(question.front),
        answer.stand_in,
        answer.ranking,
        answer.equal,
        answer.limits and tuple(limit if math.isfinite(limit) else None for limit in answer.limits),
        question.again,
        4 if answer.ranking or answer.equal or answer.limits or question.again else 3 if answer.stand_in else 1,
    )


def point_record(question: PointQuestion, answer: PointAnswer) -> PointRecord:
    """Return the record of a question of E-NAUTILUS and its answer."""
    return PointRecord(question.generation, question.number, answer, _shown(question.representatives))


def to_json(record: Record) -> str:
    """Return the record as one line, without a line break."""
    fields = {"format": record.format, **asdict(record)}
    later = {"stand_in": False, "ranking": (), "equal": False, "limits": None, "again": False}  # than format 1
    fields = {name: value for name, value in fields.items() if name not in later or value != later[name]}
    return json.dumps(fields, allow_nan=False)


def from_json(line: str, name: str = "the record") -> Record:
    """Return the record of a line. Raises ScriptError saying what is wrong with the record, called `name`."""
    try:
        fields = json.loads(line)
    except json.JSONDecodeError as error:
        raise ScriptError(f"{name} is not valid JSON: {error.msg} at column {error.colno}") from None
    if not isinstance(fields, dict):
        raise ScriptError(f"{name} is not a JSON object")
    version = fields.get("format")
    if isinstance(version, int) and version > FORMAT:
        raise ScriptError(f"{name} has format {version}, newer than the format {FORMAT} known here; use a newer jmorl")
    try:
        return _RECORD.validate_json(line, strict=True)
    except ValidationError as error:
        problems = dict.fromkeys(map(_problem, error.errors()))
        raise ScriptError(f"{name} is not a decision: {'; '.join(problems)}") from None


def read_log(path: Path) -> list[Record]:
    """All records of a log, in order; empty lines are skipped. Raises ScriptError naming file and line."""
    try:
        lines = path.read_text(encoding="utf-8").split("\n")
    except (OSError, UnicodeDecodeError) as error:
        raise ScriptError(f"cannot read the decision log {path}: {error}") from None
    return [from_json(line, f"{path}, line {number}") for number, line in enumerate(lines, start=1) if line.strip()]


def _values(policy: Policy) -> tuple[float, ...]:
    return tuple(policy.values.tolist())


def _shown(policies: Iterable[Policy]) -> tuple[Shown, ...]:
    return tuple(Shown(policy.id, _values(policy)) for policy in policies)


def _problem(error: Any) -> str:
    """One of pydantic's errors as `field: what is wrong`."""
    if not error["loc"]:
        return 'purpose: should be "steer", "final" or "enautilus"'
    if error["type"] == "value_error":
        return str(error["ctx"]["error"])
    _, *where = error["loc"]
    if where[0] == "answer":
        return 'answer: should be {"point": i}, {"steps": n} or {"iterations_left": h, "points": n}'
    return f"{'.'.join(map(str, where))}: {error['msg'][0].lower()}{error['msg'][1:]}"

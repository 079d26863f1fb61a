"""The record of a run: one small JSON file, from which every number of a comparison is made.

Letters: N policies, M objectives, G generations.
"""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import TypeAdapter, ValidationError

import envs
from jmorl.config import Config
from jmorl.decision.records import DecisionRecord
from jmorl.loop import REFERENCE_MARGIN
from jmorl.search.archive import Archive
from jmorl.search.buffer import PerformanceBuffer
from jmorl.search.policy import values_of
from jmorl.search.scaling import range_scale, search_scale
from jmorl.storage.files import write_text
from jmorl.storage.manifest import read_manifest
from jmorl.storage.stored_run import StoredRun, StoredRunError, read_run

FORMAT = 1
BROKEN = "broke down"
DIGITS = 7  # significant ones; scores are float32 sums


class RecordError(ValueError):
    """A file that is not the record of a run, or has another format."""


@dataclass(frozen=True)
class GenerationRecord:
    """A generation as it ended; 0 is the warm-up."""

    steps: int  # environment steps used for learning so far
    select_seconds: float
    train_seconds: float
    evaluate_seconds: float
    candidates: int  # policies that could have been continued; 0 in the warm-up
    bounds: tuple[float | None, ...]  # [M] None: unbounded
    sigma: tuple[float | None, ...]  # [M] of the paper's units; None in raw ones
    front: tuple[int, ...]  # ids of the archive's members
    buffer: tuple[int, ...]  # ids of the performance buffer's

    @property
    def seconds(self) -> float:
        """The time that the generation took, compilation not counted."""
        return self.select_seconds + self.train_seconds + self.evaluate_seconds


@dataclass(frozen=True)
class PolicyRecord:
    """One evaluated policy; its id is its place in the list."""

    generation: int
    parent: int | None
    weights: tuple[float, ...]  # [M]
    values: tuple[float, ...]  # [M] in the run's units
    predicted: tuple[float, ...] | None  # [M]
    raw: tuple[float, ...]  # [M] mean undiscounted return, whatever the run's units
    discounted: tuple[float, ...] | None = None  # [M] mean discounted raw return; in paper units only
    interval: tuple[tuple[float, ...], tuple[float, ...]] | None = None  # [2, M] of the prediction


@dataclass(frozen=True)
class QuestionRecord:
    """A question before a generation, or the final one, after the last."""

    generation: int  # the one about to start
    shown: int  # how many policies
    chosen: int  # id
    stand_in: bool = False  # a stand-in answered, and nobody was asked


@dataclass(frozen=True)
class ConfirmedScore:
    """The score of the result on fresh starts, as the run reported it."""

    episodes: int
    values: tuple[float, ...]  # [M]
    error: tuple[float, ...]  # [M] as stated


@dataclass(frozen=True)
class FreshScore:
    """The score of the result on many more episodes, found after the run."""

    episodes: int
    values: tuple[float, ...]  # [M]
    error: tuple[float, ...]  # [M]


@dataclass(frozen=True)
class RunRecord:
    """A run that has ended, or broke down; then with what it had until then, perhaps no generation at all."""

    digest: str  # of its config
    config: dict[str, Any]
    objectives: tuple[str, ...]
    commit: str | None
    device: str
    reason: str  # why it ended
    chosen: int | None  # id of its result; None if it broke down
    generations: tuple[GenerationRecord, ...]  # [G + 1]
    questions: tuple[QuestionRecord, ...]
    policies: tuple[PolicyRecord, ...]
    format: int = FORMAT
    fault: str | None = None  # why it broke down
    confirmed: ConfirmedScore | None = None
    fresh: FreshScore | None = None
    together: tuple[str, ...] = ()  # keys of the cells made in one program, if with others; its times are theirs, too

    @cached_property
    def values(self) -> np.ndarray:  # [N, M]
        """The scores of all policies, by id."""
        return np.array([policy.values for policy in self.policies])

    @cached_property
    def raw(self) -> np.ndarray:  # [N, M]
        """The mean undiscounted returns of all policies, by id."""
        return np.array([policy.raw for policy in self.policies])

    @cached_property
    def born(self) -> np.ndarray:  # [N]
        """The generations of all policies, by id."""
        return np.array([policy.generation for policy in self.policies])

    @property
    def steps(self) -> np.ndarray:  # [G + 1]
        """Environment steps used for learning, after each generation."""
        return np.array([generation.steps for generation in self.generations])

    @property
    def seconds(self) -> np.ndarray:  # [G + 1]
        """How long a person had waited since the start, after each generation; compilation not counted.

        NaN if the run was made together with others: nobody waits for those.
        """
        taken = np.cumsum([generation.seconds for generation in self.generations])
        return np.full_like(taken, np.nan) if self.together else taken

    @property
    def asked(self) -> list[QuestionRecord]:
        """The questions that somebody was asked: not those that a stand-in answered."""
        return [question for question in self.questions if not question.stand_in]

    @property
    def total_steps(self) -> int:
        """Environment steps used for learning."""
        return self.generations[-1].steps if self.generations else 0

    @property
    def total_seconds(self) -> float:
        """What the whole run took, in seconds."""
        return float(self.seconds[-1]) if self.generations else 0.0

    @property
    def machine_seconds(self) -> float:
        """How long the machine was busy with the run and those made together with it."""
        return sum(generation.seconds for generation in self.generations)

    def bounds(self, generation: int) -> np.ndarray:  # [M]
        """Return the bounds in force in a generation, -inf where there were none."""
        return np.array([-np.inf if bound is None else bound for bound in self.generations[generation].bounds])


_RECORD: TypeAdapter[RunRecord] = TypeAdapter(RunRecord)


def record_of(run: StoredRun) -> RunRecord:
    """Return the record of a run folder. Raises RecordError for a run that has not ended."""
    if run.result is None or run.chosen is None:
        raise RecordError(f"the run in {run.path} has not ended")
    return _record(run, run.result["reason"], run.chosen.id)


def broken_record(path: Path, config: Config, fault: str) -> RunRecord:
    """Return the record of a run folder whose run broke down, with the reason as its `fault`."""
    try:
        return _record(read_run(path), BROKEN, None, fault)
    except StoredRunError:  # it broke down in the warm-up
        manifest = read_manifest(path)
        names = tuple(objective.name for objective in envs.make(config.env).objectives)
        return RunRecord(
            digest=config.identity(),
            config=config.model_dump(mode="json"),
            objectives=names,
            commit=manifest["commit"],
            device=_device(manifest),
            reason=BROKEN,
            chosen=None,
            generations=(),
            questions=(),
            policies=(),
            fault=fault,
        )


def _record(run: StoredRun, reason: str, chosen: int | None, fault: str | None = None) -> RunRecord:
    names = [objective.name for objective in run.objectives]
    metrics = run.metrics
    generations = tuple(
        GenerationRecord(
            steps=int(metrics["steps"][g]),
            select_seconds=_rounded(metrics["select_seconds"][g]),
            train_seconds=_rounded(metrics["train_seconds"][g]),
            evaluate_seconds=_rounded(metrics["evaluate_seconds"][g]),
            candidates=int(metrics["candidates"][g]),
            bounds=tuple(_or_none(metrics[f"bound_{name}"][g]) for name in names),
            sigma=tuple(_or_none(metrics[f"sigma_{name}"][g]) for name in names),
            front=front,
            buffer=buffer,
        )
        for g, (front, buffer) in enumerate(memberships(run))
    )
    policies = tuple(
        PolicyRecord(
            policy.generation,
            policy.parent,
            _vector(policy.weights),
            _vector(policy.values),
            None if policy.predicted is None else _vector(policy.predicted),
            _vector(policy.values if policy.raw is None else policy.raw),
            None if policy.raw is None else _vector(policy.discounted),
            None if policy.interval is None else (_vector(policy.interval[0]), _vector(policy.interval[1])),
        )
        for policy in run.policies
    )
    questions = tuple(
        QuestionRecord(record.generation, len(record.shown), record.policy, record.stand_in)
        for record in run.decisions
        if isinstance(record, DecisionRecord)
    )
    return RunRecord(
        digest=run.config.identity(),
        config=run.config.model_dump(mode="json"),
        objectives=tuple(names),
        commit=run.manifest["commit"],
        device=_device(run.manifest),
        reason=reason,
        chosen=chosen,
        generations=generations,
        questions=questions,
        policies=policies,
        fault=fault,
        confirmed=_confirmed(run),
    )


def _confirmed(run: StoredRun) -> ConfirmedScore | None:
    found = run.chosen.confirmation if run.chosen else None
    if run.chosen is None or found is None:
        return None
    return ConfirmedScore(found.episodes, _vector(run.chosen.values), _vector(found.error))


def memberships(run: StoredRun) -> Iterator[tuple[tuple[int, ...], tuple[int, ...]]]:
    """Yield the ids of the archive's members and of the buffer's after each generation.

    The folder has the last ones only; those before follow from the policies in the order in which they came, P at a
    time, and from the bounds.
    """
    search, size = run.config.search, run.config.population.agents
    archive, buffer = Archive(), PerformanceBuffer(search.buffer_bins, search.buffer_size)
    first = values_of(run.policies[:size])
    reference = np.array(run.config.reference_point or range_scale(first).invert(np.array(-REFERENCE_MARGIN)))
    for generation, bounds in enumerate(run.bounds):
        born = [policy for policy in run.policies if policy.generation == generation]
        for start in range(0, len(born), size):  # in paper units the untrained agents come before the warm-up's
            offspring = born[start : start + size]
            archive = archive.offer(offspring)
            buffer = buffer.offer(offspring, search_scale(archive.values, bounds, reference, search.value_scale))
        yield tuple(policy.id for policy in archive.members), tuple(policy.id for policy in buffer.members)


def write_record(path: Path, record: RunRecord) -> None:
    """Write or replace a record, whole or not at all; a line for each generation, question and policy."""
    fields = _RECORD.dump_python(record, mode="json")
    lines = []
    for name, value in fields.items():
        if isinstance(value, list) and value and isinstance(value[0], dict):
            entries = ",\n".join(json.dumps(entry, allow_nan=False) for entry in value)
            lines.append(f'"{name}": [\n{entries}\n]')
        else:
            lines.append(f'"{name}": {json.dumps(value, allow_nan=False)}')
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, "{\n" + ",\n".join(lines) + "\n}\n")


def read_record(path: Path) -> RunRecord:
    """Read a record. Raises RecordError, naming the file."""
    try:
        record = _RECORD.validate_json(path.read_bytes())
    except (OSError, ValidationError) as error:
        raise RecordError(f"{path} is not the record of a run: {error}") from error
    if record.format != FORMAT:
        raise RecordError(f"{path} has format {record.format}, not {FORMAT}; delete it, and its run is made again")
    return record


def is_record_of(path: Path, config: Config) -> bool:
    """Say whether the file is there, and of a run with these settings. Raises RecordError if it cannot be read."""
    return path.exists() and config.is_identified_by(read_record(path).digest)


def _device(manifest: Mapping[str, Any]) -> str:
    return f"{manifest['device']['count']} x {manifest['device']['kind']}"


def _vector(values: np.ndarray) -> tuple[float, ...]:
    return tuple(_rounded(value) for value in values)


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


def _or_none(value: float) -> float | None:
    return _rounded(value) if np.isfinite(value) else None

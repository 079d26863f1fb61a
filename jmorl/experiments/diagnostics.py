"""Diagnostics of runs: how a search got on, and what it asked of a person."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jmorl.experiments.record import RunRecord


@dataclass(frozen=True)
class Mechanism:
    """How searches got on: medians and means over the generations of runs, the warm-up left out."""

    candidates: float  # median number of policies that could be continued
    alone: float  # share of generations with nothing but the choice to continue
    repeated: float  # share of questions answered with the choice before; NaN without questions
    predicted_gain: float  # mean over offspring and objectives, in units of the archive's final range
    realised_gain: float


def mechanism(records: Sequence[RunRecord]) -> Mechanism:
    """Sum up how the searches of these runs got on."""
    candidates = [generation.candidates for record in records for generation in record.generations[1:]]
    repeated: list[bool] = []
    predicted: list[float] = []
    realised: list[float] = []
    for record in records:
        chosen = [question.chosen for question in record.questions]
        repeated += [one == other for one, other in zip(chosen, chosen[1:], strict=False)]
        if not record.generations:
            continue
        front = record.values[list(record.generations[-1].front)]
        span = np.where(np.ptp(front, axis=0) > 0, np.ptp(front, axis=0), 1.0)
        for policy in record.policies:
            if policy.predicted is not None and policy.parent is not None:
                before = record.values[policy.parent]
                predicted.append(float(((np.array(policy.predicted) - before) / span).mean()))
                realised.append(float(((np.array(policy.values) - before) / span).mean()))
    return Mechanism(
        float(np.median(candidates)) if candidates else np.nan,
        float(np.mean(np.array(candidates) <= 1)) if candidates else np.nan,
        float(np.mean(repeated)) if repeated else np.nan,
        float(np.mean(predicted)) if predicted else np.nan,
        float(np.mean(realised)) if realised else np.nan,
    )


@dataclass(frozen=True)
class Waiting:
    """The questions and waiting times of a person, over runs; compilation not counted."""

    questions: float  # mean, the final one included
    before_first: float  # mean seconds: the warm-up, or the whole run if it asks only at its end
    between: float  # median seconds from an answer to the next question, one generation; NaN without a second question


def waiting(records: Sequence[RunRecord]) -> Waiting:
    """Sum up what at least one run asked of a person."""
    return Waiting(
        float(np.mean([len(record.asked) for record in records])),
        float(np.mean([_before_first(record) for record in records])),
        float(np.median([wait for record in records for wait in _between(record)] or [np.nan])),
    )


def _before_first(record: RunRecord) -> float:
    """Return the seconds before the first question: one before generation g comes when the generation before ends."""
    if not record.asked:
        return record.total_seconds
    return float(record.seconds[record.asked[0].generation - 1])


def _between(record: RunRecord) -> list[float]:
    """Return the seconds between each question and the next."""
    asked = [question.generation for question in record.asked]
    ends = record.seconds
    return [float(ends[after - 1] - ends[before - 1]) for before, after in zip(asked, asked[1:], strict=False)]

"""How long the host takes to choose the tasks of a generation, by the number of objectives; printed.

    python -m benchmarks.selection      (a minute)

400 candidates that hardly dominate each other, all of them in the front, 600 records and the default grid of weights:
about what a run of a hundred generations has. The preference model knows six choices among all 400. The seconds of the
metrics are those of the front's row in metrics.csv.
"""

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from rich.table import Table

from jmorl.config import SearchConfig
from jmorl.decision.preferences import Comparison, PreferenceModel
from jmorl.display.console import PlainConsole
from jmorl.search.metrics import front_metrics
from jmorl.search.prediction import Records, predict
from jmorl.search.selection import select_tasks
from jmorl.search.weights import candidate_grid

CANDIDATES, RECORDS, TASKS, CHOICES = 400, 600, 6, 6
OBJECTIVES = range(2, 9)


def main() -> None:
    """Measure and print."""
    columns = "objectives", "weights", "prefer", "predict", "select", "together", "metrics"
    shown = Table(*columns, title="seconds of a generation")
    for objectives in OBJECTIVES:
        weights, seconds = measured(objectives)
        shown.add_row(str(objectives), str(weights), *(f"{each:.2f}" for each in seconds))
    PlainConsole().print(shown)


def measured(objectives: int) -> tuple[int, tuple[float, ...]]:
    """How many candidate weights there are, and the seconds of each step and of the first three together."""
    generator = np.random.default_rng(objectives)
    weights = candidate_grid(objectives, SearchConfig().weight_divisions)
    candidates, reference = front(generator, objectives), np.full(objectives, -0.1)
    predicting, prediction = timed(predict, candidates, weights, records(generator, candidates, weights))
    selecting, _ = timed(select_tasks, prediction.expected, candidates, reference, TASKS, 1.0, generator)
    measuring, _ = timed(front_metrics, candidates, reference, weights)
    preferred = candidates @ generator.dirichlet(np.ones(objectives))
    choices = [Comparison(candidates, (int(preferred.argmax()),))] * CHOICES
    preferring, _ = timed(lambda: PreferenceModel(candidates, choices, 0).verdict())
    return len(weights), (preferring, predicting, selecting, preferring + predicting + selecting, measuring)


def front(generator: np.random.Generator, objectives: int) -> np.ndarray:
    """Points near the unit sphere, [CANDIDATES, M]."""
    directions = np.abs(generator.normal(size=(CANDIDATES, objectives)))
    lengths = generator.normal(1.0, 0.02, size=(CANDIDATES, 1))
    return lengths * directions / np.linalg.norm(directions, axis=1, keepdims=True)


def records(generator: np.random.Generator, candidates: np.ndarray, weights: np.ndarray) -> Records:
    """Tasks whose parents were somewhat worse than the candidates, and that led towards their weights."""
    parents = 0.9 * candidates[generator.integers(len(candidates), size=RECORDS)]
    used = weights[generator.integers(len(weights), size=RECORDS)]
    changes = 0.1 * (used - 1 / weights.shape[1]) + generator.normal(0.02, 0.02, size=parents.shape)
    return Records.empty(weights.shape[1]).add(parents, used, parents + changes)


def timed(function: Callable[..., Any], *arguments: Any) -> tuple[float, Any]:
    """Seconds and result of a call."""
    started = time.perf_counter()
    result = function(*arguments)
    return time.perf_counter() - started, result


if __name__ == "__main__":
    main()

"""Small made-up runs, as events and as what their folder tells."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from envs.core import Objective
from jmorl.config import resolve
from jmorl.decision.answers import Answer
from jmorl.decision.protocol import Question
from jmorl.decision.records import decision_record
from jmorl.events import Compiled, Decided, Event, GenerationFinished, RunFinished, Seconds
from jmorl.methods.pgmorl import PGMORLState
from jmorl.search.bounds import lower_bounds
from jmorl.search.buffer import PerformanceBuffer
from jmorl.search.metrics import front_metrics
from jmorl.search.policy import Policy, values_of
from jmorl.search.prediction import Records
from jmorl.search.weights import simplex_grid
from jmorl.state import RunState
from jmorl.storage.stored_run import StoredRun

OBJECTIVES = (
    Objective("time", "time", "-steps"),
    Objective("fuel", "fuel", "-force²·steps"),
    Objective("comfort", "ride comfort", "-jerk"),
)
SCALES = np.array([100.0, 40.0, 3.0])
AGENTS = 6
STEPS = 240_000  # of a generation
HOPELESS = -999.0


@pytest.fixture(scope="session")
def make_events() -> Callable[..., list[Event]]:
    return events_of


@pytest.fixture(scope="session")
def make_run() -> Callable[..., StoredRun]:
    return run_of


def events_of(
    objectives: int = 2, generations: int = 10, has_utility: bool = True, interactive: bool = True, outliers: int = 2
) -> list[Event]:
    """A whole run, whose policies approach a concave front; the first `outliers` are hopeless in one objective."""
    generator = np.random.default_rng(7)
    described = OBJECTIVES[:objectives]
    unbounded = np.full(objectives, -np.inf)
    state = RunState(PGMORLState(PerformanceBuffer(100, 4), Records.empty(objectives), unbounded))
    events: list[Event] = [Compiled(3.21, 2, 40_000.0)]
    policies: list[Policy] = []
    for generation in range(generations + 1):
        bounds, choice = state.search.bounds, state.choice
        if generation and interactive:
            decided = _decided("steer", generation, state, described)
            events.append(decided)
            bounds, choice = decided.bounds, decided.chosen
        offspring = tuple(
            _policy(generator, AGENTS * generation + index, generation, objectives, outliers) for index in range(AGENTS)
        )
        policies += offspring
        state = RunState(
            replace(state.search, bounds=bounds),
            state.archive.offer(offspring),
            choice=choice,
            generation=generation,
            iterations=10 * (generation + 1),
            evaluation_steps=9_000 * (generation + 1),
            policies=len(policies),
        )
        events.append(_finished(state, offspring, has_utility, interactive))
    decided = _decided("final", generations + 1, state, described)
    return [*events, decided, RunFinished(state, decided.chosen, "budget")]


def run_of(finished: bool = True, **kinds: object) -> StoredRun:
    """What the folder of `events_of(**kinds)` tells; unfinished: before the last choice."""
    events = events_of(**kinds)
    generations = [event for event in events if isinstance(event, GenerationFinished)]
    decisions = tuple(decision_record(event.question, event.answer) for event in events if isinstance(event, Decided))
    chosen = events[-1].chosen.id
    rows = [_row(event) for event in generations]
    method = "interactive" if kinds.get("interactive", True) else "pgmorl"
    return StoredRun(
        path=Path("runs/made-up"),
        config=resolve(overrides={"method": method, "user": "A" if kinds.get("has_utility", True) else "terminal"}),
        manifest={"device": {"kind": "cpu", "platform": "cpu", "count": 2}},
        objectives=OBJECTIVES[: len(generations[0].bounds)],
        metrics={name: np.array([row[name] for row in rows], float) for name in rows[0]},
        policies=tuple(policy for event in generations for policy in event.offspring),
        front=generations[-1].state.archive.members,
        decisions=decisions if finished else decisions[:-1],
        result={"reason": "budget", "chosen": {"policy": chosen}} if finished else None,
    )


def _policy(generator: np.random.Generator, number: int, generation: int, objectives: int, outliers: int) -> Policy:
    weights = generator.dirichlet(np.ones(objectives))
    direction = np.sqrt(weights / (weights**2).sum()) + generator.normal(0, 0.02, objectives)
    scales = SCALES[:objectives]
    values = scales * (0.9 * direction - 1.8 - 1.2 * np.exp(-generation / 3))
    if number < outliers:
        values[0] = HOPELESS
    return Policy(
        id=number,
        generation=generation,
        parent=max(number - AGENTS, 0) if generation else None,
        weights=weights,
        values=values,
        std=0.01 * np.abs(values),
        discounted=0.5 * values,
        snapshot=None,
        predicted=values + generator.normal(0, 0.05, objectives) * scales if generation else None,
        interval=values + 0.05 * np.outer([-1, 1.5], scales) if generation > 1 else None,
    )


def _finished(
    state: RunState, offspring: tuple[Policy, ...], has_utility: bool, interactive: bool
) -> GenerationFinished:
    utility = state.archive.values.mean(axis=1)
    within_bounds = None if state.generation == 4 else float(utility.mean() - 1)
    mean = float(utility.mean() - 3)
    objectives = len(state.search.bounds)
    return GenerationFinished(
        state,
        offspring,
        candidates=3 * state.generation,
        steps=STEPS * (state.generation + 1),
        seconds=Seconds(0.1 * bool(state.generation), 9.1, 0.9),
        training={"policy_loss": -0.01, "value_loss": 0.2, "entropy": 0.5, "approximate_kl": 0.01},
        steps_per_second=23_456.7 + 100 * state.generation,
        front=front_metrics(state.archive.values, -2 * SCALES[:objectives], simplex_grid(objectives, 10)),
        utility_max=float(utility.max()) if has_utility else None,
        search={
            "utility_mean": mean if has_utility else None,
            "utility_mean_within_bounds": within_bounds if has_utility else None,
            "prediction_error": 0.02 if state.generation else None,
            "realized_change": 0.08 if state.generation else None,
            "interval_coverage": 1.0 if state.generation > 1 else None,
        },
        bounds=state.search.bounds,
        generations_to_question=0 if interactive else None,
    )


def _decided(purpose: str, generation: int, state: RunState, objectives: tuple[Objective, ...]) -> Decided:
    front = state.archive.members
    chosen = front[int(np.argmax(values_of(front).mean(axis=1)))]
    previous = state.choice.id if state.choice else None
    question = Question(purpose, generation, objectives, front, state.search.bounds, previous)
    bounds = lower_bounds(chosen.values, 0.1, np.ptp(state.archive.values, axis=0))
    return Decided(question, Answer(chosen.id), chosen, bounds if purpose == "steer" else state.search.bounds, 1, 0.01)


def _row(event: GenerationFinished) -> dict[str, float | None]:
    """A row of the metrics file, None where a cell is empty."""
    names = [objective.name for objective in OBJECTIVES]
    bounds = [value if np.isfinite(value) else None for value in event.bounds]
    return {
        "generation": event.state.generation,
        "steps": event.steps,
        "evaluation_steps": event.state.evaluation_steps,
        "steps_per_second": event.steps_per_second,
        **{f"{name}_seconds": seconds for name, seconds in vars(event.seconds).items()},
        "candidates": event.candidates,
        **{f"bound_{name}": value for name, value in zip(names, bounds, strict=False)},
        **vars(event.front),
        "utility_max": event.utility_max,
        **event.search,
    }

"""One run: warm-up, generations, final choice, as a generator of events.

The only place that orders learning, search and decision (the paper's Algorithm 1). Everybody who watches a run,
the command line, the run folder, a page, reads the same events.
"""

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import jax
import numpy as np

import envs
from envs.core import Environment
from jmorl.config import Config
from jmorl.decision.protocol import DecisionMaker, Purpose, Question
from jmorl.decision.users import make_user
from jmorl.events import Compiled, Decided, Event, GenerationFinished, Resumed, RunFinished, Seconds
from jmorl.learning.moppo import TrainState
from jmorl.learning.population import Population
from jmorl.scoring import Scores, paper_scores, raw_scores
from jmorl.search.buffer import PerformanceBuffer
from jmorl.search.metrics import (
    front_metrics,
    prediction_metrics,
    utility_metrics,
)
from jmorl.search.policy import Policy, values_of
from jmorl.search.prediction import Records
from jmorl.search.scaling import range_scale
from jmorl.search.selection import Task, select_tasks
from jmorl.search.weights import evenly_spaced_weights
from jmorl.state import (
    RunState,
    bounds_after,
    candidate_weights,
    candidates,
    members_within,
    predictions,
    reference_point,
    scale_of_gains,
)
from jmorl.units import initial_units, measured_in

REFERENCE_MARGIN = 0.1  # of the range, below the worst: neither extremes nor the middle dominate a gain


@dataclass(frozen=True)
class Lineage:
    """Where the offspring of a generation come from."""

    parents: Sequence[Policy]  # [P]
    predicted: np.ndarray  # [P, M] raw units
    candidates: int  # policies that could have been continued
    select_seconds: float


def run(
    config: Config,
    decision_maker: DecisionMaker | None = None,
    environment: Environment[Any] | None = None,
    state: RunState | None = None,
    population: Population | None = None,
) -> Iterator[Event]:
    """Train and choose as `config` says, yielding an event for everything that happens.

    `decision_maker` and `environment` default to those the config names. With the `state` that a generation of an
    earlier run ended with, the run goes on from there; on the same machine it finds the same as the earlier one did.
    A `population` of the same environment and sections of the config, left by another run, need not be compiled anew.
    Raises TrainingFault in the generation in which a number stops being finite; the events before it stand.
    """
    environment = environment or envs.make(config.env)
    decision_maker = decision_maker or make_user(config.user, environment.objectives)
    return _Run(config, environment, decision_maker, population or Population(environment, config)).events(state)


def evaluation_keys(config: Config, evaluated: int = 0) -> jax.Array:
    """The keys [episodes] from which a run evaluates its policies, all agents from the same.

    For deterministic actions they are the same for every policy of the run; for sampled ones, which are not to be
    selected for their luck, others in each evaluation: after so many `evaluated` policies.
    """
    key = _keys(config)[2]
    if config.evaluation.actions == "sampled":
        key = jax.random.fold_in(key, evaluated)
    return jax.random.split(key, config.evaluation.episodes)


def _keys(config: Config) -> jax.Array:
    """For initialisation, training and evaluation, [3]."""
    return jax.random.split(jax.random.key(config.seed), 3)


class _Run:
    """What stays the same during a run, and the steps it is made of."""

    def __init__(
        self, config: Config, environment: Environment[Any], decision_maker: DecisionMaker, population: Population
    ):
        self.config = config
        self.environment = environment
        self.decision_maker = decision_maker
        self.population = population
        self.candidate_weights = candidate_weights(config, len(environment.objectives))
        self.objectives = measured_in(config.evaluation.units, environment.objectives)
        self.initial_key, self.training_key, _ = _keys(config)

    def events(self, state: RunState | None) -> Iterator[Event]:
        yield Compiled(self.population.compile(), self.population.devices)
        if state is None:
            finished = self.warm_up()
            yield finished
            state = finished.state
        else:
            yield Resumed(state, self._steps(state))
        while self._budget_left(state) and not self._satisfied(state):
            if self.config.method == "interactive" and not state.silent_generations:
                decided = self.ask(state, "steer", state.archive.members)
                yield decided
                state = replace(
                    _asked(state, decided), bounds=decided.bounds, silent_generations=decided.answer.generations
                )
                if decided.answer.stop:
                    yield RunFinished(state, decided.chosen, "stopped")
                    return
            finished = self.generation(state)
            yield finished
            state = finished.state
        satisfied = self._satisfied(state)
        # What satisfies may lie outside the bounds: the search is not the only one that finds things.
        front = state.archive.members if satisfied else members_within(state.archive.members, state.bounds)
        decided = self.ask(state, "final", front)
        yield decided
        yield RunFinished(_asked(state, decided), decided.chosen, "satisfied" if satisfied else "budget")

    def warm_up(self) -> GenerationFinished:
        """Generation 0: P new agents, with weights evenly spread."""
        objectives = len(self.environment.objectives)
        in_paper_units = self.config.evaluation.units == "paper"
        state = RunState(
            PerformanceBuffer(self.config.search.buffer_bins, self.config.search.buffer_size),
            Records.empty(objectives),
            bounds=np.full(objectives, -np.inf),
            units=initial_units(objectives) if in_paper_units else None,
        )
        weights = evenly_spaced_weights(objectives, self.config.population.agents)
        train_states = self.population.initialize(self.initial_key)
        # The authors score untrained agents, too: they enter archive and buffer, and set the units.
        untrained: tuple[Policy, ...] = ()
        if in_paper_units:
            state, untrained = self._evaluated(state, train_states, weights, None)
        finished = self._trained(state, train_states, weights, self.config.population.warmup_iterations)
        return replace(finished, offspring=(*untrained, *finished.offspring))

    def generation(self, state: RunState) -> GenerationFinished:
        """Select P tasks, train them, and take their offspring in."""
        state = replace(state, generation=state.generation + 1, silent_generations=max(state.silent_generations - 1, 0))
        started = time.perf_counter()
        continued = candidates(state)
        tasks, predicted = self._select(state, continued)
        lineage = Lineage(
            [continued[task.candidate] for task in tasks],
            predicted,
            len(continued),
            time.perf_counter() - started,
        )
        train_states = jax.tree.map(lambda *leaves: np.stack(leaves), *(parent.snapshot for parent in lineage.parents))
        weights = self.candidate_weights[[task.weight for task in tasks]]
        return self._trained(state, train_states, weights, self.config.population.iterations, lineage)

    def ask(self, state: RunState, purpose: Purpose, front: Sequence[Policy]) -> Decided:
        """Put a question to the decision maker."""
        previous = state.choice.id if state.choice else None
        generation = state.generation + 1
        question = Question(purpose, generation, self.objectives, tuple(front), state.bounds, previous)
        started = time.perf_counter()
        answer = self.decision_maker.answer(question)
        seconds = time.perf_counter() - started
        chosen = question.policy(answer.policy)
        bounds = bounds_after(self.config, state, chosen) if purpose == "steer" else state.bounds
        return Decided(question, answer, chosen, bounds, seconds)

    def _steps(self, state: RunState) -> int:
        """Environment steps used for learning so far."""
        return state.iterations * self.config.steps_per_iteration

    def _budget_left(self, state: RunState) -> bool:
        return state.iterations < self.config.iteration_budget

    def _satisfied(self, state: RunState) -> bool:
        return self.decision_maker.satisfied(state.archive.values)

    def _select(self, state: RunState, continued: list[Policy]) -> tuple[list[Task], np.ndarray]:
        """The tasks whose predicted offspring improve the front most, and the predictions [P, M] in raw units.

        In the interactive search only what lies within the bounds counts as an improvement.
        """
        search = self.config.search
        scale = scale_of_gains(self.config, state)
        bounded = state.choice is not None and search.gain_within == "bounds"
        front = members_within(state.archive.members, state.bounds) if bounded else state.archive.members
        if bounded:
            reference = scale.apply(state.bounds)
        elif search.value_scale == "range":
            reference = np.full_like(state.bounds, -REFERENCE_MARGIN)
        else:
            reference = np.zeros_like(state.bounds)  # the scale's origin is the reference point
        tasks = select_tasks(
            scale.apply(predictions(self.config, state, continued)),
            scale.apply(values_of(front)),
            reference,
            self.config.population.agents,
            search.sparsity_weight,
            np.random.default_rng([self.config.seed, state.generation]),
        )
        return tasks, scale.invert(np.stack([task.predicted for task in tasks]))

    def _trained(
        self,
        state: RunState,
        train_states: TrainState,
        weights: np.ndarray,
        iterations: int,
        lineage: Lineage | None = None,
    ) -> GenerationFinished:
        """Train agents [P] with weights [P, M], evaluate them, and take them in."""
        started = time.perf_counter()
        key = jax.random.fold_in(self.training_key, state.generation)
        train_states, diagnostics = self.population.train(
            train_states, weights, key, iterations, self.config.learning_rate(state.iterations)
        )
        trained = time.perf_counter()
        state, offspring = self._evaluated(state, train_states, weights, lineage)
        evaluated = time.perf_counter()
        state = replace(state, iterations=state.iterations + iterations)
        seconds = Seconds(lineage.select_seconds if lineage else 0.0, trained - started, evaluated - trained)
        return GenerationFinished(
            state,
            offspring,
            lineage.candidates if lineage else 0,
            self._steps(state),
            seconds,
            iterations * self.config.steps_per_iteration / seconds.total,
            diagnostics.means(),
            front_metrics(state.archive.values, reference_point(state), self.candidate_weights),
            utility_metrics(self.decision_maker.utility, state.archive.members, state.buffer.members, state.bounds),
            prediction_metrics(lineage.parents if lineage else (), offspring, range_scale(state.archive.values)),
        )

    def _evaluated(
        self, state: RunState, train_states: TrainState, weights: np.ndarray, lineage: Lineage | None
    ) -> tuple[RunState, tuple[Policy, ...]]:
        """The state with agents [P], trained with weights [P, M], scored and taken in; and their policies."""
        returns = self.population.evaluate(train_states, evaluation_keys(self.config, state.policies))
        scores, units = raw_scores(returns), None
        if state.units:
            discounts = self.config.ppo.discount, self.config.evaluation.scale_discount
            scores, units = paper_scores(returns, state.units, *discounts)
        offspring = _policies(state, train_states, weights, scores, lineage)
        state = self._taken_in(state, offspring, lineage)
        evaluation_steps, policies = state.evaluation_steps + scores.steps, state.policies + len(offspring)
        return replace(state, units=units, evaluation_steps=evaluation_steps, policies=policies), offspring

    def _taken_in(self, state: RunState, offspring: tuple[Policy, ...], lineage: Lineage | None) -> RunState:
        """The state with the offspring in archive, buffer and records."""
        state = replace(state, archive=state.archive.offer(offspring))
        if state.reference_point is None:
            state = replace(state, reference_point=self._first_reference_point(offspring))
        if lineage:
            weights = np.stack([child.weights for child in offspring])
            records = state.records.add(values_of(lineage.parents), weights, values_of(offspring))
            state = replace(state, records=records)
        return replace(state, buffer=state.buffer.offer(offspring, scale_of_gains(self.config, state)))

    def _first_reference_point(self, warmed_up: tuple[Policy, ...]) -> np.ndarray:
        if self.config.reference_point:
            return np.array(self.config.reference_point)
        return range_scale(values_of(warmed_up)).invert(np.array(-REFERENCE_MARGIN))


def _policies(
    state: RunState, train_states: TrainState, weights: np.ndarray, scores: Scores, lineage: Lineage | None
) -> tuple[Policy, ...]:
    """Learners [P] and their scores as records."""
    return tuple(
        Policy(
            id=state.policies + index,
            generation=state.generation,
            parent=lineage.parents[index].id if lineage else None,
            weights=weights[index],
            values=scores.values[index],
            std=scores.std[index],
            discounted=scores.discounted[index],
            # Copied, or each policy would keep those of its whole generation in memory.
            snapshot=jax.tree.map(lambda leaf, index=index: leaf[index].copy(), train_states),
            predicted=lineage.predicted[index] if lineage else None,
            raw=None if scores.raw is None else scores.raw[index],
        )
        for index in range(len(weights))
    )


def _asked(state: RunState, decided: Decided) -> RunState:
    """The state with a question counted and its choice noted."""
    return replace(
        state,
        choice=decided.chosen,
        questions=state.questions + 1,
        policies_shown=state.policies_shown + len(decided.question.front),
    )

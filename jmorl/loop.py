"""One run: warm-up, generations, final choice, as a generator of events.

The only place that orders learning, search and decision (the paper's Algorithm 1). Everybody who watches a run,
the command line, the run folder, a page, reads the same events. What is particular to a search is its method's.
"""

import time
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from functools import partial
from typing import Any

import jax
import numpy as np

import envs
from envs.checks import check_same
from envs.core import Environment
from jmorl.blending import blend_front
from jmorl.config import Config
from jmorl.confirmation import confirmed, finalists
from jmorl.decision.protocol import AnyQuestion, DecisionMaker, Question
from jmorl.decision.remembered import RunRecord
from jmorl.decision.stand_in import StandIn
from jmorl.decision.users import make_user
from jmorl.events import Blended, Compiled, Decided, Event, GenerationFinished, Resumed, RunFinished, Seconds
from jmorl.learning.execution import own_settings
from jmorl.learning.moppo import Diagnostics, TrainState
from jmorl.learning.population import Population
from jmorl.methods import registry
from jmorl.methods.base import Method, Problem, Tasks, checked_tasks
from jmorl.scoring import Scores, paper_scores, raw_scores
from jmorl.search.bounds import members_within
from jmorl.search.metrics import front_metrics
from jmorl.search.policy import Policy, rescored, values_of
from jmorl.search.scaling import REFERENCE_MARGIN, range_scale
from jmorl.search.weights import candidate_grid
from jmorl.state import RunState, reference_point
from jmorl.units import initial_units, measured_in

EARLY = 1 / 8  # of the warm-up, after which its agents are something to look at
CONFIRMATION = 2**32 - 1  # the stream of random numbers of confirmations; evaluations count from 0


def run(
    config: Config,
    decision_maker: DecisionMaker | None = None,
    environment: Environment[Any] | None = None,
    state: RunState | None = None,
    population: Population | None = None,
    history: Sequence[RunRecord] = (),
    selecting: Callable[[], AbstractContextManager[object]] = nullcontext,
    ask_now: bool = False,
    early: Callable[[tuple[Policy, ...]], None] | None = None,
) -> Iterator[Event]:
    """Train and choose as `config` says, yielding an event for everything that happens.

    `decision_maker` and `environment` default to those the config names. With the `state` that a generation of an
    earlier run ended with, the run goes on from there; on the same machine it finds the same as the earlier one did.
    An `environment` that is not the config's is refused with NotAsDeclared.
    The `history` of its decisions is what a stand-in needs to know then (`ask` and `question` in the config); with
    `ask_now` it leaves the next question to the decision maker. The tasks of a generation are selected within
    `selecting()`, where nothing is lost if it is broken off. For somebody who wants to look at something meanwhile,
    `early` is called with the agents after an eighth of the warm-up, which is then made once more from its start; only
    in raw units.
    A `population` that shares its programs with others is for `jmorl.learning.stack`. Raises TrainingFault in the
    generation in which a number stops being finite, AnswerError for an answer that its question does not allow, and
    MethodError for tasks that cannot be trained; the events before it stand.
    """
    _check_kind("config", config, Config, "as `jmorl.resolve` returns it")
    environment = environment or envs.make(config.env)
    _check_kind("environment", environment, Environment, "as `envs.make` returns it")
    decision_maker = decision_maker or make_user(config.user, environment.objectives)
    _check_kind("decision_maker", decision_maker, DecisionMaker, "an instance of a subclass")
    decision_maker = StandIn(decision_maker, config.seed, history, config.ask, config.question, ask_now)
    population = population or Population(environment, config.learning)
    check_same(environment, envs.make(config.env), config.env)
    return _Run(config, environment, decision_maker, population, selecting).events(state, early)


def _check_kind(name: str, value: object, kind: type, how: str) -> None:
    """Raise TypeError for a value of another kind."""
    if not isinstance(value, kind):
        given = f"the class {value.__name__}" if isinstance(value, type) else repr(value)
        article = "an" if kind.__name__[0] in "AEIOU" else "a"
        raise TypeError(f"{name} must be {article} {kind.__name__}, {how}, not {given}")


def make_method(config: Config, environment: Environment[Any]) -> Method[Any]:
    """Return the search method of a run with these settings."""
    objectives = measured_in(config.evaluation.units, environment.objectives)
    return registry.make(config.method, Problem(objectives, config.first_weights(), config.seed, config.search))


@own_settings()
def evaluation_keys(config: Config, evaluated: int = 0) -> jax.Array:
    """Return the keys [episodes] from which a run evaluates its policies, all agents from the same.

    For deterministic actions they are the same for every policy of the run; for sampled ones, which are not to be
    selected for their luck, others in each evaluation: after so many `evaluated` policies.
    """
    key = _keys(config)[2]
    if config.evaluation.actions == "sampled":
        key = jax.random.fold_in(key, evaluated)
    return jax.random.split(key, config.evaluation.episodes)


@own_settings()
def _keys(config: Config) -> jax.Array:
    """Return those for initialisation, training and evaluation, [3]."""
    return jax.random.split(jax.random.key(config.seed), 3)


@own_settings()
def _confirmation_key(config: Config) -> jax.Array:
    """Return the key of the starts that confirm scores, which no evaluation uses."""
    return jax.random.fold_in(_keys(config)[2], CONFIRMATION)


@own_settings()
def _training_key(config: Config, generation: int) -> jax.Array:
    return jax.random.fold_in(_keys(config)[1], generation)


class _Run:
    """What stays the same during a run, and the steps it is made of."""

    def __init__(
        self,
        config: Config,
        environment: Environment[Any],
        decision_maker: DecisionMaker,
        population: Population,
        selecting: Callable[[], AbstractContextManager[object]],
    ):
        self.config = config
        self.environment = environment
        self.decision_maker = decision_maker
        self.population = population
        self.selecting = selecting
        self.method = make_method(config, environment)
        self.metric_weights = candidate_grid(len(environment.objectives), config.search.weight_divisions)

    def events(
        self, state: RunState | None, early: Callable[[tuple[Policy, ...]], None] | None = None
    ) -> Iterator[Event]:
        """Make the run, from a state or from the beginning."""
        seconds = self.population.compile()
        rate = self.config.steps_per_iteration / self.population.iteration_seconds()
        yield Compiled(seconds, self.population.devices, rate, self._steps(state) if state else 0)
        if state is None:
            if early and self.config.evaluation.units == "raw":
                early(self.early_agents())
            finished = self.warm_up()
            yield finished
            state = finished.state
        else:
            bounds, silent = self.method.bounds(state.search), self.method.generations_to_question(state.search)
            yield Resumed(state, self._steps(state), bounds, silent)
        while self._budget_left(state) and not self._satisfied(state):
            if self.decision_maker.wants_question(state.generation + 1):
                state = replace(state, search=self.method.asking_at_once(state.search))
            while question := self.method.question(state):
                state, decided = yield from self._decided(state, question)
                if decided.chosen and question.stops(decided.answer):
                    state, [chosen] = self._confirmed(state, [decided.chosen])
                    yield RunFinished(state, chosen, "stopped")
                    return
            finished = self.generation(state)
            yield finished
            state = finished.state
        satisfied = self._satisfied(state)
        if not satisfied and self._blends_at_the_end(state):
            finished = self.blended(state, self._to_be_blended(state), self.config.search.final_blends)
            yield finished
            state = finished.state
            satisfied = self._satisfied(state)
        # What satisfies may lie outside the bounds: the search is not the only one that finds things.
        front = state.archive.members if satisfied else self.method.final_front(state)
        best = finalists(front, None if satisfied else state.choice, self.population.size)
        state, best = self._confirmed(state, best)
        state, decided = yield from self._decided(state, self._final_question(state, best or front))
        assert decided.chosen is not None
        state, [chosen] = self._confirmed(state, [decided.chosen])
        yield RunFinished(state, chosen, "satisfied" if satisfied else "budget")

    def early_agents(self) -> tuple[Policy, ...]:
        """Return the P agents as they are after the first part of the warm-up."""
        config, weights = self.config, self.method.problem.weights
        iterations = max(round(EARLY * config.population.warmup_iterations), 1)
        train_states, _ = self.population.train(
            self.population.initialize(_keys(config)[0]), weights, _training_key(config, 0), iterations,
            config.learning_rate(0),
        )  # fmt: skip
        state = RunState(self.method.initial_state())
        return self._evaluated(state, train_states, weights, None)[1]

    def warm_up(self) -> GenerationFinished:
        """Train and evaluate P new agents: generation 0."""
        objectives = len(self.environment.objectives)
        in_paper_units = self.config.evaluation.units == "paper"
        units = initial_units(objectives) if in_paper_units else None
        state = RunState(self.method.initial_state(), units=units)
        weights = self.method.problem.weights
        train_states = self.population.initialize(_keys(self.config)[0])
        # The authors score untrained agents, too: they enter archive and buffer, and set the units.
        untrained: tuple[Policy, ...] = ()
        if in_paper_units:
            state, untrained = self._evaluated(state, train_states, weights, None)
        finished = self._trained(state, train_states, weights, self.config.population.warmup_iterations)
        return replace(finished, offspring=(*untrained, *finished.offspring))

    def generation(self, state: RunState) -> GenerationFinished:
        """Train what the method asks for, and take the offspring in."""
        state = replace(state, generation=state.generation + 1)
        started = time.perf_counter()
        with self.selecting():
            tasks = checked_tasks(self.method.tasks(state), self.method.problem)
        select_seconds = time.perf_counter() - started
        train_states = jax.tree.map(lambda *leaves: np.stack(leaves), *(parent.snapshot for parent in tasks.parents))
        iterations = self.config.population.iterations
        return self._trained(state, train_states, tasks.weights, iterations, tasks, select_seconds)

    def blended(self, state: RunState, front: Sequence[Policy], most: int) -> Blended:
        """Make a front denser by at most so many blends: a generation of its own."""
        started = time.perf_counter()
        before = front_metrics(state.archive.values, reference_point(state), self.metric_weights)
        state = replace(state, generation=state.generation + 1, blendings=state.blendings + 1)
        blending = blend_front(
            front,
            state.archive.members,
            self.population,
            evaluation_keys(self.config, state.policies),
            _confirmation_key(self.config),
            self.config.evaluation.confirmation_episodes,
            most,
            state.generation,
            state.policies,
        )
        blends, in_force = blending.blends, self.method.bounds(state.search)
        state = replace(state, archive=state.archive.offer(blends), policies=state.policies + len(blends))
        state = replace(state, evaluation_steps=state.evaluation_steps + blending.evaluation_steps)
        seconds = Seconds(evaluate=time.perf_counter() - started)
        nothing = dict.fromkeys(Diagnostics.names())
        finished = self._finished(state, blends, None, seconds, 0, nothing, in_force)
        return Blended(**vars(finished), blending=blending, before=before)

    def _blends_at_the_end(self, state: RunState) -> bool:
        return self.config.search.final_blends > 0 and state.blendings == 0 and len(state.archive.members) > 1

    def _to_be_blended(self, state: RunState) -> Sequence[Policy]:
        """Return the front within the bounds, where it is more than one policy; else the whole front."""
        inside = members_within(state.archive.members, self.method.bounds(state.search))
        return inside if len(inside) > 1 else state.archive.members

    def _decided(self, state: RunState, question: AnyQuestion) -> Generator[Decided, None, tuple[RunState, Decided]]:
        """Put a question to the decision maker, and what may follow from the answer. Yields an event for each."""
        earlier = state.search
        state, decided = self.ask(state, question)
        yield decided
        further = self.decision_maker.follow_up(decided.question, decided.answer)
        if further:
            state, decided = self.ask(replace(state, search=earlier), further)
            yield decided
        return state, decided

    def ask(self, state: RunState, question: AnyQuestion) -> tuple[RunState, Decided]:
        """Put a question to the decision maker. Returns the state with the answer, and the event."""
        started = time.perf_counter()
        if isinstance(question, Question) and question.purpose == "steer":
            question = replace(question, prospect=partial(self.method.prospect, state))
        question, answer = self.decision_maker.decide(question)
        answer = question.checked(answer)
        seconds = time.perf_counter() - started
        chosen, asked = question.chosen(answer), question.was_asked(answer)
        state = replace(
            state,
            choice=chosen or state.choice,
            questions=state.questions + asked,
            policies_shown=state.policies_shown + asked * len(question.shown),
        )
        if question.purpose != "final":
            state = replace(state, search=self.method.answered(state, question, answer))
        silent = self.method.generations_to_question(state.search)
        return state, Decided(question, answer, chosen, self.method.bounds(state.search), silent, seconds)

    def _confirmed(self, state: RunState, policies: Sequence[Policy]) -> tuple[RunState, list[Policy]]:
        """Return the policies with scores from fresh starts, as the config wants, unless they have them already."""
        episodes, evaluation = self.config.evaluation.confirmation_episodes, self.config.evaluation
        todo = [policy for policy in policies if policy.confirmation is None]
        if not episodes or not todo or evaluation.units == "paper":  # paper units would move
            return state, list(policies)
        scored, steps = confirmed(todo, self.population, _confirmation_key(self.config), episodes, evaluation.episodes)
        state = replace(state, evaluation_steps=state.evaluation_steps + steps)
        return state, list(rescored(policies, scored))

    def _final_question(self, state: RunState, shown: Sequence[Policy]) -> Question:
        """Return the last question, which shows some of the archive: any other policy may be chosen, too."""
        previous = state.choice.id if state.choice else None
        bounds = self.method.bounds(state.search)
        objectives, limits = self.method.problem.objectives, self.method.limits(state.search)
        ids = [policy.id for policy in shown]
        others = tuple(policy for policy in state.archive.members if policy.id not in ids)
        return Question(
            "final", state.generation + 1, objectives, tuple(shown), bounds, previous, others, limits=limits
        )

    def _steps(self, state: RunState) -> int:
        """Return the environment steps used for learning so far."""
        return state.iterations * self.config.steps_per_iteration

    def _budget_left(self, state: RunState) -> bool:
        return state.iterations < self.config.iteration_budget

    def _satisfied(self, state: RunState) -> bool:
        return self.decision_maker.satisfied(state.archive.values)

    def _trained(
        self,
        state: RunState,
        train_states: TrainState,
        weights: np.ndarray,
        iterations: int,
        tasks: Tasks | None = None,
        select_seconds: float = 0.0,
    ) -> GenerationFinished:
        """Train agents [P] with weights [P, M], evaluate them, and take them in."""
        started = time.perf_counter()
        in_force = self.method.bounds(state.search)
        key = _training_key(self.config, state.generation)
        train_states, diagnostics = self.population.train(
            train_states, weights, key, iterations, self.config.learning_rate(state.iterations)
        )
        trained = time.perf_counter()
        state, offspring = self._evaluated(state, train_states, weights, tasks)
        evaluated = time.perf_counter()
        state = replace(state, iterations=state.iterations + iterations)
        seconds = Seconds(select_seconds, trained - started, evaluated - trained)
        return self._finished(state, offspring, tasks, seconds, iterations, diagnostics.means(), in_force)

    def _finished(
        self,
        state: RunState,
        offspring: tuple[Policy, ...],
        tasks: Tasks | None,
        seconds: Seconds,
        iterations: int,
        training: Mapping[str, float | None],
        in_force: np.ndarray,
    ) -> GenerationFinished:
        """Return the event of a generation."""
        utilities = self.decision_maker.utility(state.archive.values)
        return GenerationFinished(
            state,
            offspring,
            tasks.candidates if tasks else 0,
            self._steps(state),
            seconds,
            iterations * self.config.steps_per_iteration / seconds.total,
            training,
            front_metrics(state.archive.values, reference_point(state), self.metric_weights),
            None if utilities is None else float(utilities.max()),
            self.method.metrics(state, self.decision_maker.utility, offspring, tasks),
            in_force,
            self.method.generations_to_question(state.search),
        )

    def _evaluated(
        self, state: RunState, train_states: TrainState, weights: np.ndarray, tasks: Tasks | None
    ) -> tuple[RunState, tuple[Policy, ...]]:
        """Score agents [P], trained with weights [P, M]. Returns the state with them taken in, and their policies."""
        returns = self.population.evaluate(train_states, evaluation_keys(self.config, state.policies))
        scores, units = raw_scores(returns), None
        if state.units:
            discounts = self.config.ppo.discount, self.config.evaluation.scale_discount
            scores, units = paper_scores(returns, state.units, *discounts)
        offspring = _policies(state, train_states, weights, scores, tasks)
        state = replace(state, archive=state.archive.offer(offspring))
        if state.reference_point is None:
            state = replace(state, reference_point=self._first_reference_point(offspring))
        state = replace(state, search=self.method.taken_in(state, offspring, tasks))
        evaluation_steps, policies = state.evaluation_steps + scores.steps, state.policies + len(offspring)
        return replace(state, units=units, evaluation_steps=evaluation_steps, policies=policies), offspring

    def _first_reference_point(self, warmed_up: tuple[Policy, ...]) -> np.ndarray:
        if self.config.reference_point:
            return np.array(self.config.reference_point)
        return range_scale(values_of(warmed_up)).invert(np.array(-REFERENCE_MARGIN))


def blend(
    config: Config,
    environment: Environment[Any],
    state: RunState,
    most: int,
    decision_maker: DecisionMaker | None = None,
    population: Population | None = None,
) -> Blended:
    """Make the whole front of a run's state denser by at most so many blends.

    The environment is the config's; the decision maker, who is not asked, tells utilities. Scores are in raw units.
    Raises TrainingFault.
    """
    maker = decision_maker or make_user(config.user, environment.objectives)
    run = _Run(config, environment, maker, population or Population(environment, config.learning), nullcontext)
    run.population.compile()
    return run.blended(state, state.archive.members, most)


def _policies(
    state: RunState, train_states: TrainState, weights: np.ndarray, scores: Scores, tasks: Tasks | None
) -> tuple[Policy, ...]:
    """Return agents [P] and their scores as records."""
    predicted = None if tasks is None else tasks.predicted
    interval = None if tasks is None else tasks.interval
    return tuple(
        Policy(
            id=state.policies + index,
            generation=state.generation,
            parent=tasks.parents[index].id if tasks else None,
            weights=weights[index],
            values=scores.values[index],
            std=scores.std[index],
            discounted=scores.discounted[index],
            # Copied, or each policy would keep those of its whole generation in memory.
            snapshot=jax.tree.map(lambda leaf, index=index: leaf[index].copy(), train_states),
            predicted=None if predicted is None else predicted[index],
            interval=None if interval is None else interval[:, index],
            raw=None if scores.raw is None else scores.raw[index],
        )
        for index in range(len(weights))
    )

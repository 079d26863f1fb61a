"""PGMORL (Xu et al. 2020): a model predicts what comes of each policy and weights; the most promising are trained.

Nobody is asked before the end. Letters: C candidates, W candidate weights, P agents, M objectives.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from jmorl.methods.base import Method, PackedSearch, Tasks
from jmorl.search.bounds import members_within
from jmorl.search.buffer import PerformanceBuffer
from jmorl.search.metrics import Utility, prediction_metrics, utility_metrics
from jmorl.search.policy import Policy, values_of
from jmorl.search.prediction import Prediction, Records, predict
from jmorl.search.scaling import REFERENCE_MARGIN, Scale, range_scale, search_scale
from jmorl.search.scouts import Scouts
from jmorl.search.selection import select_tasks
from jmorl.search.weights import candidate_grid
from jmorl.state import RunState, reference_point

COUNTERS = ("silent_generations", "widenings", "generations_with_choice")


@dataclass(frozen=True)
class PGMORLState:
    """What the search knows besides the archive."""

    buffer: PerformanceBuffer
    records: Records
    bounds: np.ndarray  # [M] -inf where there is none; only the interactive method sets them
    # Of the interactive method alone:
    silent_generations: int = 0  # to go before the next question
    widenings: int = 0  # of the bounds
    generations_with_choice: int = 0  # trained since another policy was chosen
    limits: tuple[float, ...] | None = None  # [M] that the decision maker has set, -inf where none; None: never any
    scouts: Scouts = Scouts()


class PGMORL(Method[PGMORLState]):
    """PGMORL, and what the interactive method takes over from it."""

    def initial_state(self) -> PGMORLState:
        """Return an empty buffer and no records."""
        return self._state((), Records.empty(len(self.problem.objectives)))

    def tasks(self, run: RunState) -> Tasks:
        """Return the tasks whose predicted offspring improve the front most.

        After a choice only what lies within the bounds counts as an improvement.
        """
        generator = np.random.default_rng([self.problem.seed, run.generation])
        return self.selected(run, self.candidates(run), self.problem.agents, generator)

    def selected(self, run: RunState, continued: list[Policy], count: int, generator: np.random.Generator) -> Tasks:
        """Return so many tasks that continue some of these policies."""
        search, state = self.problem.search, run.search
        scale = self._scale_of_gains(run)
        bounded = run.choice is not None and search.gain_within == "bounds"
        front = members_within(run.archive.members, state.bounds) if bounded else run.archive.members
        if bounded:
            reference = scale.apply(state.bounds)
        elif search.value_scale == "range":
            reference = np.full_like(state.bounds, -REFERENCE_MARGIN)
        else:
            reference = np.zeros_like(state.bounds)  # the scale's origin is the reference point
        prediction = self.prediction(run, continued)
        hoped = prediction.expected + search.optimism * prediction.spread[:, None]
        tasks = select_tasks(
            scale.apply(hoped),
            scale.apply(values_of(front)),
            reference,
            count,
            search.sparsity_weight,
            generator,
        )
        pairs = [task.candidate for task in tasks], [task.weight for task in tasks]
        return self.promised(run, continued, prediction, *pairs)

    def promised(
        self,
        run: RunState,
        continued: Sequence[Policy],
        prediction: Prediction,
        candidates: Sequence[int],
        weights: Sequence[int],
    ) -> Tasks:
        """Return the tasks of these pairs of continued policies and weights, with what is expected of them."""
        expected, spread = prediction.expected[candidates, weights], prediction.spread[candidates]
        known = len(run.search.records.parents) > 0
        ends = run.search.records.interval_ends()
        return Tasks(
            [continued[candidate] for candidate in candidates],
            self.candidate_weights()[weights],
            expected,
            len(continued),
            expected + ends[:, None] * spread if known else None,
            spread if known else None,
        )

    def candidates(self, run: RunState) -> list[Policy]:
        """Return the policies whose training may be continued, at least one."""
        return list(run.search.buffer.members)

    def prediction(self, run: RunState, policies: Sequence[Policy]) -> Prediction:
        """Predict the values of policies after training with each of the candidate weights.

        The model's constants are for values scaled by range, whatever scale the gains are measured in.
        """
        state = run.search
        scale = search_scale(run.archive.values, state.bounds, reference_point(run), "range")
        found = predict(scale.apply(values_of(policies)), self.candidate_weights(), state.records.scaled(scale))
        return Prediction(scale.invert(found.expected), found.spread * scale.span)

    def candidate_weights(self) -> np.ndarray:
        """Return the weights [W, M] that a policy may be trained with after the warm-up."""
        return candidate_grid(len(self.problem.objectives), self.problem.search.weight_divisions)

    def taken_in(self, run: RunState, offspring: Sequence[Policy], tasks: Tasks | None) -> PGMORLState:
        """Return the state with the offspring in buffer and records."""
        state: PGMORLState = run.search
        records = state.records
        if tasks:
            records = records.add(
                values_of(tasks.parents), tasks.weights, values_of(offspring), _surprises(offspring, tasks)
            )
        return replace(state, records=records, buffer=state.buffer.offer(offspring, self._scale_of_gains(run)))

    def bounds(self, state: PGMORLState) -> np.ndarray:
        """Return the bounds [M] in force."""
        return state.bounds

    def metrics(
        self, run: RunState, utility: Utility, offspring: Sequence[Policy], tasks: Tasks | None
    ) -> Mapping[str, float | None]:
        """Return how good the prediction model was, and the utility of the population.

        The population of the paper's equations 6 and 7 is the performance buffer, for every method.
        """
        state = run.search
        scale = range_scale(run.archive.values)
        return {
            **utility_metrics(utility, state.buffer.members, state.bounds),
            **prediction_metrics(tasks.parents if tasks else (), offspring, scale),
        }

    def pack(self, state: PGMORLState) -> PackedSearch:
        """Return the state as a checkpoint keeps it. Records are left out before there are any."""
        records = {f"records_{name}": array for name, array in vars(state.records).items() if len(array)}
        groups = {name: getattr(state.scouts, name) for name in ("starts", "underway")}
        document = {
            "buffer": [policy.id for policy in state.buffer.members],
            **{name: getattr(state, name) for name in COUNTERS},
            "limits": state.limits and [limit if np.isfinite(limit) else None for limit in state.limits],
            "scouts": vars(state.scouts) | {name: [each.id for each in group] for name, group in groups.items()},
        }
        policies = dict.fromkeys((*state.buffer.members, *groups["starts"], *groups["underway"]))
        return PackedSearch(document, {"bounds": state.bounds, **records}, tuple(policies))

    def unpack(
        self, document: Mapping[str, Any], arrays: Mapping[str, np.ndarray], policies: Mapping[int, Policy]
    ) -> PGMORLState:
        """Return the state that was packed."""
        names = [f"records_{each.name}" for each in fields(Records)]
        records = Records.empty(len(arrays["bounds"]))
        if names[0] in arrays:  # an earlier version remembered no surprises
            nothing = np.full_like(arrays[names[0]], np.nan)
            records = Records(*(arrays.get(each, nothing) for each in names))
        state = self._state(tuple(policies[each] for each in document["buffer"]), records)
        # Runs of earlier versions have fewer counters: their bounds never gave way, nobody could set limits or scout.
        limits, scouts = document.get("limits"), document.get("scouts", vars(Scouts()))
        groups = {name: tuple(policies[each] for each in scouts[name]) for name in ("starts", "underway")}
        return replace(
            state,
            bounds=arrays["bounds"],
            **{name: document.get(name, 0) for name in COUNTERS},
            limits=limits and tuple(-np.inf if limit is None else float(limit) for limit in limits),
            scouts=Scouts(**{**scouts, **groups}),
        )

    def _state(self, members: tuple[Policy, ...], records: Records) -> PGMORLState:
        search = self.problem.search
        buffer = PerformanceBuffer(search.buffer_bins, search.buffer_size, members)
        return PGMORLState(buffer, records, bounds=np.full(len(self.problem.objectives), -np.inf))

    def _scale_of_gains(self, run: RunState) -> Scale:
        """Return the scale in which improvements of the front are measured."""
        kind = self.problem.search.value_scale
        return search_scale(run.archive.values, run.search.bounds, reference_point(run), kind)


def _surprises(offspring: Sequence[Policy], tasks: Tasks) -> np.ndarray | None:
    """Return how far the offspring lie from what was expected, in units of the spread [P, M]; None without a spread."""
    if tasks.predicted is None or tasks.spread is None:
        return None
    spread = np.where(tasks.spread > 0, tasks.spread, np.finfo(float).tiny)
    limit = 1e6  # where nothing has ever changed, any change is a surprise; its size says nothing
    return np.clip((values_of(offspring) - tasks.predicted) / spread, -limit, limit)

"""The paper's method: PGMORL within bounds that follow from the policy somebody prefers (Algorithm 1)."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from jmorl.decision.protocol import AnyQuestion, Question
from jmorl.methods.base import Tasks
from jmorl.methods.pgmorl import PGMORL, PGMORLState
from jmorl.search.bounds import members_within, widened_bounds, within
from jmorl.search.metrics import Utility
from jmorl.search.pareto import non_dominated
from jmorl.search.policy import Policy, values_of
from jmorl.search.prospect import Prospect
from jmorl.search.scaling import range_scale
from jmorl.search.scouts import Scouts, supporting_weights
from jmorl.state import RunState

PATIENCE = 2  # generations with one choice, after which the search has stagnated


class Interactive(PGMORL):
    """Ask before each generation which policy is preferred, and search where none is much worse."""

    def question(self, run: RunState) -> Question | None:
        """Return the archive to choose from, unless generations are left to go on without a question."""
        if run.search.silent_generations:
            return None
        previous = run.choice.id if run.choice else None
        generation, objectives = run.generation + 1, self.problem.objectives
        search = run.search
        members = run.archive.members
        return Question("steer", generation, objectives, members, search.bounds, previous, limits=search.limits)

    def tasks(self, run: RunState) -> Tasks:
        """Return tasks within the bounds; while the same policy stays preferred, some of them train scouts."""
        scouts = self._scouts(run.search)
        if not scouts or run.choice is None:
            return super().tasks(run)
        generator = np.random.default_rng([self.problem.seed, run.generation])
        scale = range_scale(run.archive.values)
        towards = supporting_weights(
            scale.apply(run.choice.values), scale.apply(run.archive.values), self.candidate_weights()
        )
        count = len(scouts)
        parts = [self.promised(run, scouts, self.prediction(run, scouts), [*range(count)], [towards] * count)]
        if count < self.problem.agents:
            parts.insert(0, self.selected(run, self.candidates(run), self.problem.agents - count, generator))
        return Tasks(
            [parent for part in parts for parent in part.parents],
            np.concatenate([part.weights for part in parts]),
            np.concatenate([part.predicted for part in parts]),
            parts[0].candidates,
            *(
                _joined([getattr(part, name) for part in parts], axis)
                for name, axis in (("interval", 1), ("spread", 0))
            ),
        )

    def _scouts(self, search: PGMORLState) -> tuple[Policy, ...]:
        """Return the scouts that the next generation trains. Once underway they go on, also if the choice moves."""
        if not search.scouts.underway and search.generations_with_choice < PATIENCE:
            return ()
        return search.scouts.trained_now(round(self.problem.search.outside_share * self.problem.agents))

    def answered(self, run: RunState, question: AnyQuestion, answer: Any) -> PGMORLState:
        """Return the state with the bounds that follow from the choice."""
        assert run.choice is not None and isinstance(question, Question), "the question is about policies"
        limits = answer.limits or question.limits
        state = replace(run.search, silent_generations=answer.generations, limits=limits)
        if run.choice.id != question.previous:
            state = replace(state, generations_with_choice=0)
        return self._bounded(run, state, run.choice)

    def asking_at_once(self, state: PGMORLState) -> PGMORLState:
        """Return the state without generations to go on for in silence."""
        return replace(state, silent_generations=0)

    def with_another_user(self, state: PGMORLState) -> PGMORLState:
        """Return the state without limits."""
        return replace(state, limits=None)

    def candidates(self, run: RunState) -> list[Policy]:
        """Return the choice, always, and the buffer members within the bounds."""
        inside = members_within(run.search.buffer.members, run.search.bounds)
        return inside if run.choice is None or run.choice in inside else [run.choice, *inside]

    def taken_in(self, run: RunState, offspring: Sequence[Policy], tasks: Any) -> PGMORLState:
        """Return the state with the offspring, one generation nearer to the next question.

        Where no question follows, bounds that give way do so anew: the offspring may lie within them.
        """
        state = super().taken_in(run, offspring, tasks)
        if tasks is None:
            state = replace(state, scouts=Scouts(tuple(offspring)))
        elif scouts := self._scouts(run.search):
            state = replace(state, scouts=state.scouts.after(offspring[-len(scouts) :]))
        state = replace(state, silent_generations=max(state.silent_generations - 1, 0))
        if run.choice is None:
            return state
        state = replace(state, generations_with_choice=state.generations_with_choice + 1)
        in_silence = state.silent_generations > 0 and self.problem.search.least_within > 0
        return self._bounded(run, state, run.choice) if in_silence else state

    def final_front(self, run: RunState) -> Sequence[Policy]:
        """Return the members of the archive within the bounds, and, if bounds give way, outside; within limits if any.

        Who follows a stand-in, or changes their mind, sees at the end what lies elsewhere, too.
        """
        bounds = run.search.bounds if not self.problem.search.least_within else np.full_like(run.search.bounds, -np.inf)
        inside = members_within(run.archive.members, bounds)
        if run.search.limits is None:
            return inside
        return members_within(inside, np.array(run.search.limits)) or inside

    def limits(self, state: PGMORLState) -> tuple[float, ...] | None:
        """Return the limits that were set."""
        return state.limits

    def generations_to_question(self, state: PGMORLState) -> int:
        """Return how many generations end before the next question."""
        return state.silent_generations

    def prospect(self, run: RunState, policy: Policy) -> Prospect:
        """Return which bounds a choice would set, what they would rule out, and what is expected within them."""
        search = self._bounded(run, run.search, policy)
        after, bounds = replace(run, search=search, choice=policy), search.bounds
        expected = self.prediction(after, self.candidates(after)).expected.reshape(-1, len(bounds))
        expected = np.minimum(expected, [objective.highest for objective in self.problem.objectives])
        expected = expected[within(expected, bounds)]
        kept = within(run.archive.values, bounds)
        return Prospect(bounds, kept, expected[non_dominated(expected)], search.records.odds())

    def metrics(
        self, run: RunState, utility: Utility, offspring: Sequence[Policy], tasks: Tasks | None
    ) -> Mapping[str, float | None]:
        """Return PGMORL's metrics, and how often the slack of the bounds was doubled."""
        return {**super().metrics(run, utility, offspring, tasks), "widenings": run.search.widenings}

    def _bounded(self, run: RunState, state: PGMORLState, chosen: Policy) -> PGMORLState:
        """Return the state with the bounds that follow from a choice (the paper's equation 4), widened if need be.

        Where the choice reaches a limit, the bounds widen no farther than that, less their slack at first.
        """
        values, search = run.archive.values, self.problem.search
        spans = np.ptp(values, axis=0)
        bounds = widened_bounds(
            chosen.values,
            search.delta,
            spans if search.bounds_scale == "range" else np.ones_like(spans),
            search.least_slack * spans,
            values_of(state.buffer.members),
            search.least_within,
            state.limits,
        )
        return replace(state, bounds=bounds.lower, widenings=bounds.widenings)


def _joined(arrays: Sequence[np.ndarray | None], axis: int) -> np.ndarray | None:
    """Return the arrays in one; None if one is missing."""
    known = [array for array in arrays if array is not None]
    return np.concatenate(known, axis=axis) if len(known) == len(arrays) else None

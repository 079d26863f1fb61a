"""The paper's method: PGMORL within bounds that follow from the policy somebody prefers (Algorithm 1)."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from jmorl.decision.protocol import AnyQuestion, Question
from jmorl.methods.base import Prospect
from jmorl.methods.pgmorl import PGMORL, PGMORLState
from jmorl.search.bounds import lower_bounds, members_within, within
from jmorl.search.pareto import non_dominated
from jmorl.search.policy import Policy
from jmorl.state import RunState


class Interactive(PGMORL):
    """Ask before each generation which policy is preferred, and search where none is much worse."""

    def question(self, run: RunState) -> Question | None:
        """Return the archive to choose from, unless generations are left to go on without a question."""
        if run.search.silent_generations:
            return None
        previous = run.choice.id if run.choice else None
        generation, objectives = run.generation + 1, self.problem.objectives
        return Question("steer", generation, objectives, run.archive.members, run.search.bounds, previous)

    def answered(self, run: RunState, question: AnyQuestion, answer: Any) -> PGMORLState:
        """Return the state with the bounds that follow from the choice."""
        assert run.choice is not None, "the question is about policies"
        state: PGMORLState = run.search
        return replace(state, bounds=self._bounds_after(run, run.choice), silent_generations=answer.generations)

    def asking_at_once(self, state: PGMORLState) -> PGMORLState:
        """Return the state without generations to go on for in silence."""
        return replace(state, silent_generations=0)

    def candidates(self, run: RunState) -> list[Policy]:
        """Return the choice, always, and the buffer members within the bounds."""
        inside = members_within(run.search.buffer.members, run.search.bounds)
        return inside if run.choice is None or run.choice in inside else [run.choice, *inside]

    def taken_in(self, run: RunState, offspring: Sequence[Policy], tasks: Any) -> PGMORLState:
        """Return the state with the offspring, one generation nearer to the next question."""
        state = super().taken_in(run, offspring, tasks)
        return replace(state, silent_generations=max(state.silent_generations - 1, 0))

    def final_front(self, run: RunState) -> Sequence[Policy]:
        """Return the members of the archive within the bounds."""
        return members_within(run.archive.members, run.search.bounds)

    def generations_to_question(self, state: PGMORLState) -> int:
        """Return how many generations end before the next question."""
        return state.silent_generations

    def prospect(self, run: RunState, policy: Policy) -> Prospect:
        """Return which bounds a choice would set, what they would rule out, and what is expected within them."""
        bounds = self._bounds_after(run, policy)
        after = replace(run, search=replace(run.search, bounds=bounds), choice=policy)
        expected = self.predictions(after, self.candidates(after)).reshape(-1, len(bounds))
        expected = expected[within(expected, bounds)]
        return Prospect(bounds, within(run.archive.values, bounds), expected[non_dominated(expected)])

    def _bounds_after(self, run: RunState, chosen: Policy) -> np.ndarray:
        """Return the bounds [M] that follow from a choice (the paper's equation 4)."""
        values, search = run.archive.values, self.problem.search
        unit = np.ptp(values, axis=0) if search.bounds_scale == "range" else np.ones(values.shape[1])
        return lower_bounds(chosen.values, search.delta, unit)

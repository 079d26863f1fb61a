"""Fixed weights: each agent is trained on with the weights it began with, and somebody chooses at the end.

The paper's a-priori approach (section 2.2.2), one weighted sum for each agent, as a baseline.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from jmorl.methods.base import Method, PackedSearch, Tasks
from jmorl.search.policy import Policy
from jmorl.state import RunState

Agents = tuple[Policy, ...]  # [P] the last policy of each agent


class FixedWeights(Method[Agents]):
    """P agents that keep their weights, evenly spread or given (`population.weights`)."""

    def initial_state(self) -> Agents:
        """Return no agents: those of the warm-up are the first."""
        return ()

    def tasks(self, run: RunState) -> Tasks:
        """Return every agent with its own weights."""
        return Tasks(run.search, self.problem.weights, predicted=None, candidates=len(run.search))

    def taken_in(self, run: RunState, offspring: Sequence[Policy], tasks: Tasks | None) -> Agents:
        """Return the offspring, good or bad: agents are never replaced by others."""
        return tuple(offspring)

    def pack(self, state: Agents) -> PackedSearch:
        """Return the agents as a checkpoint keeps them."""
        return PackedSearch({"agents": [policy.id for policy in state]}, policies=state)

    def unpack(
        self, document: Mapping[str, Any], arrays: Mapping[str, np.ndarray], policies: Mapping[int, Policy]
    ) -> Agents:
        """Return the agents that were packed."""
        return tuple(policies[each] for each in document["agents"])

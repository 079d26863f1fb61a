"""What every run knows between two generations, whatever its method."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from jmorl.search.archive import Archive
from jmorl.search.policy import Policy
from jmorl.units import RunningUnits


@dataclass(frozen=True)
class RunState:
    """All that a run knows between two generations."""

    search: Any  # what the method alone knows: its own kind of state
    archive: Archive = Archive()
    units: RunningUnits | None = None  # of the scores; None for raw ones, which have nothing to remember
    reference_point: np.ndarray | None = None  # [M] of the reported hypervolume; None before the warm-up
    choice: Policy | None = None  # what the decision maker chose last
    generation: int = 0  # finished generations, the warm-up not counted
    iterations: int = 0  # PPO iterations of every agent so far
    evaluation_steps: int = 0
    policies: int = 0  # evaluated so far: the id of the next one
    blendings: int = 0  # generations among them that blended the front, and trained nothing
    questions: int = 0
    policies_shown: int = 0


def reference_point(state: RunState) -> np.ndarray:
    """Return the reference point [M] of the reported hypervolume, of a state after the warm-up."""
    assert state.reference_point is not None, "the warm-up sets it"
    return state.reference_point

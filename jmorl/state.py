"""What a run knows between two generations, and what a choice makes of it: bounds, candidates, expectations.

Pure functions of a `RunState`, so that whoever asks the decision maker can also tell what an answer would mean.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from jmorl.config import Config
from jmorl.search.archive import Archive
from jmorl.search.bounds import lower_bounds, within
from jmorl.search.buffer import PerformanceBuffer
from jmorl.search.pareto import non_dominated
from jmorl.search.policy import Policy, values_of
from jmorl.search.prediction import Records, predict
from jmorl.search.scaling import Scale, search_scale
from jmorl.search.weights import candidate_grid
from jmorl.units import RunningUnits


@dataclass(frozen=True)
class RunState:
    """All that a run knows between two generations."""

    buffer: PerformanceBuffer
    records: Records
    bounds: np.ndarray  # [M] -inf before the first choice
    archive: Archive = Archive()
    units: RunningUnits | None = None  # of the scores; None for raw ones, which have nothing to remember
    reference_point: np.ndarray | None = None  # [M] of the reported hypervolume; None before the warm-up
    choice: Policy | None = None  # what the decision maker chose last
    silent_generations: int = 0  # still to go before the next question
    generation: int = 0  # finished generations, the warm-up not counted
    iterations: int = 0  # PPO iterations of every agent so far
    evaluation_steps: int = 0
    policies: int = 0  # evaluated so far: the id of the next one
    questions: int = 0
    policies_shown: int = 0


@dataclass(frozen=True)
class Prospect:
    """What choosing a policy would mean for the generation that follows."""

    bounds: np.ndarray  # [M] that would be in force
    kept: np.ndarray  # [N] bool, members of the archive that reach them; the others would be ruled out
    expected: np.ndarray  # [K, M] best of what the prediction model expects within them, raw units; K may be zero


def prospect(config: Config, state: RunState, chosen: Policy) -> Prospect:
    """What would follow if `chosen` were the answer to the question that the state leads to."""
    bounds = bounds_after(config, state, chosen)
    state = replace(state, bounds=bounds, choice=chosen)
    expected = predictions(config, state, candidates(state)).reshape(-1, len(bounds))
    expected = expected[within(expected, bounds)]
    return Prospect(bounds, within(state.archive.values, bounds), expected[non_dominated(expected)])


def bounds_after(config: Config, state: RunState, chosen: Policy) -> np.ndarray:
    """The bounds [M] that follow from a choice (the paper's equation 4)."""
    values = state.archive.values
    unit = np.ptp(values, axis=0) if config.search.bounds_scale == "range" else np.ones(values.shape[1])
    return lower_bounds(chosen.values, config.search.delta, unit)


def candidates(state: RunState) -> list[Policy]:
    """The policies whose training may be continued: the choice, always, and buffer members within the bounds."""
    inside = members_within(state.buffer.members, state.bounds)
    return inside if state.choice is None or state.choice in inside else [state.choice, *inside]


def predictions(config: Config, state: RunState, of: Sequence[Policy]) -> np.ndarray:
    """What each of the policies is expected to become with each of the candidate weights, [C, W, M] in raw units.

    The model's constants are for values scaled by range, whatever scale the gains are measured in.
    """
    scale = search_scale(state.archive.values, state.bounds, reference_point(state), "range")
    weights = candidate_weights(config, len(state.bounds))
    return scale.invert(predict(scale.apply(values_of(of)), weights, state.records.scaled(scale)))


def candidate_weights(config: Config, objectives: int) -> np.ndarray:
    """The weights [W, M] that a policy may be trained with after the warm-up."""
    return candidate_grid(objectives, config.search.weight_divisions)


def scale_of_gains(config: Config, state: RunState) -> Scale:
    """The scale in which improvements of the front are measured."""
    return search_scale(state.archive.values, state.bounds, reference_point(state), config.search.value_scale)


def members_within(policies: Sequence[Policy], bounds: np.ndarray) -> list[Policy]:
    """Those of the policies, at least one, that reach the bounds [M]."""
    inside = within(values_of(policies), bounds)
    return [policy for policy, kept in zip(policies, inside, strict=True) if kept]


def reference_point(state: RunState) -> np.ndarray:
    """That of the reported hypervolume, [M], of a state after the warm-up."""
    assert state.reference_point is not None, "the warm-up sets it"
    return state.reference_point

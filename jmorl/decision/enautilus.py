"""E-NAUTILUS: from the worst corner of a front to one of its members, choice by choice.

(Ruiz, Sindhya, Miettinen, Ruiz and Luque 2015; the paper, section 3.2.) The person starts at the nadir and is shown
a few points on the way to the front, each better in every objective than the last: nothing ever has to be given up.
Everything here is a pure function of a `State`; a choice makes a new one, which remembers the one it came from.
"""

from dataclasses import dataclass, replace

import numpy as np

from jmorl.search.bounds import within
from jmorl.search.scaling import range_scale

# Weight of the sum in the achievement function: it only decides between members whose worst shortfall is the same.
AUGMENTATION = 1e-6
# Members whose distances to a centroid differ by less than this part of the front's range are equally near.
TIE = 1e-9


@dataclass(frozen=True, eq=False)
class State:
    """Where a dialogue stands. `parent` is the state before the last choice."""

    values: np.ndarray  # [N, M] the members, raw units
    nadir: np.ndarray  # [M] worst value of each objective among all members
    point: np.ndarray  # [M] z, chosen last; at the start the nadir
    reachable: np.ndarray  # [N] bool, members at least as good as the point in every objective
    iterations_left: int  # h
    points: int  # n, at most so many are shown
    parent: "State | None" = None

    @property
    def choices(self) -> int:
        """How many choices led here, and so how many steps back there are."""
        return 0 if self.parent is None else 1 + self.parent.choices


@dataclass(frozen=True, eq=False)
class IntermediatePoint:
    """One of the points to choose from, on the straight line to a member of the front.

    `value` is at the same time the worst that can still come of choosing it.
    """

    value: np.ndarray  # [M] z_i, raw units
    best: np.ndarray  # [M] best still reachable value of each objective
    closeness: float  # percent of the way from the nadir to the representative
    reachable: np.ndarray  # [N] bool, members that stay reachable
    representative: int  # the member that the point heads for


def begin(values: np.ndarray, iterations: int, points: int) -> State:
    """Return the start, at the nadir, with all members [N, M] reachable. Members should not dominate each other.

    Raises ValueError unless there is a member, all values are finite, and both numbers are at least 1.
    """
    values = np.array(values, float)
    if values.ndim != 2 or values.size == 0 or not np.isfinite(values).all():
        raise ValueError(f"E-NAUTILUS needs the finite values of at least one policy, [N, M], not {values!r}")
    if iterations < 1:
        raise ValueError(f"E-NAUTILUS needs at least 1 iteration, not {iterations}")
    nadir = values.min(axis=0)
    return adjust(State(values, nadir, nadir, np.ones(len(values), bool), iterations, points), iterations, points)


def intermediate_points(state: State) -> tuple[IntermediatePoint, ...]:
    """Return the points of the next iteration, at most n, the best in the first objective first.

    z_i = ((h - 1) z + rep_i) / h, where rep_i stands for a cluster of the reachable members. Raises ValueError if
    no iterations are left.
    """
    if state.iterations_left == 0:
        raise ValueError("no iterations are left; step back or ask for more iterations")
    return tuple(_towards(state, member) for member in _representatives(state))


def choose(state: State, point: IntermediatePoint) -> State:
    """Move to one of the state's intermediate points; members that are not at least as good drop out."""
    return replace(
        state, point=point.value, reachable=point.reachable, iterations_left=state.iterations_left - 1, parent=state
    )


def step_back(state: State, steps: int) -> State:
    """Return the state before the last `steps` choices, exactly as it was. Raises ValueError if there were fewer."""
    if not 1 <= steps <= state.choices:
        raise ValueError(f"cannot take back {steps} choices: {state.choices} have been made")
    earlier = state
    for _ in range(steps):
        assert earlier.parent is not None
        earlier = earlier.parent
    return earlier


def adjust(state: State, iterations_left: int, points: int) -> State:
    """Return the same place with another h and n.

    No iterations left ends the dialogue here; at least 1 point is shown.
    """
    if iterations_left < 0 or points < 1:
        raise ValueError(f"cannot go on for {iterations_left} iterations with {points} points in each")
    return replace(state, iterations_left=iterations_left, points=points)


def finished(state: State) -> bool:
    """Whether nothing is left to choose: no iterations, or a single member (or several equal ones) reachable."""
    left = state.values[state.reachable]
    return state.iterations_left == 0 or bool((left == left[0]).all())


def result(state: State) -> int:
    """Return the index of the member that the dialogue ends on: of those reachable, the nearest to the last point.

    Nearest by an augmented achievement scalarising function (Wierzbicki 1980): the member whose worst objective,
    relative to the point and in units of the front's range, is best. Ties go to the first.
    """
    advance = (state.values - state.point) / range_scale(state.values).span
    achievement = advance.min(axis=1) + AUGMENTATION * advance.sum(axis=1)
    return int(np.argmax(np.where(state.reachable, achievement, -np.inf)))


def _towards(state: State, member: int) -> IntermediatePoint:
    """Return the point that is one iteration nearer to a reachable member."""
    target, h = state.values[member], state.iterations_left
    # Rounding must not put the point beyond its own representative, nor below the point before.
    value = np.clip(((h - 1) * state.point + target) / h, state.point, target)
    reachable = within(state.values, value)  # so also at least as good as the point before
    # The best of objective o among members as good as the point in all *others* is as good as the point in o, too,
    # because the representative is: so it is the best among those that stay reachable.
    best = state.values[reachable].max(axis=0)
    span = range_scale(state.values).span
    whole_way = np.linalg.norm((target - state.nadir) / span)
    way = np.linalg.norm((value - state.nadir) / span)
    closeness = 100 * float(way / whole_way) if whole_way > 0 else 100.0
    return IntermediatePoint(value, best, closeness, reachable, member)


def _representatives(state: State) -> list[int]:
    """For each of at most n clusters of reachable members the one nearest the centroid.

    The centroid itself may lie beyond a front that is not convex. Of equal members only the first counts.
    """
    members = np.flatnonzero(state.reachable)
    distinct, first = np.unique(state.values[members], axis=0, return_index=True)
    scaled = range_scale(state.values).apply(distinct)
    nearest = [_nearest_to_centroid(scaled, cluster) for cluster in _clusters(scaled, state.points)]
    return [int(members[first[index]]) for index in sorted(nearest, reverse=True)]


def _clusters(vectors: np.ndarray, most: int) -> list[list[int]]:
    """Return the distinct vectors [N, M] in at most so many clusters: average linkage (Euclidean), cut by count."""
    if len(vectors) <= most:
        return [[index] for index in range(len(vectors))]
    from scipy.cluster.hierarchy import linkage  # slow to import, and fronts are often small
    from scipy.spatial.distance import pdist

    # Merge s joins two clusters into number N + s. Cutting by count instead of by height keeps as many clusters as
    # asked for, even where several merges have the same height.
    clusters = {index: [index] for index in range(len(vectors))}
    merges = linkage(pdist(vectors), "average")[: len(vectors) - most]
    for number, (left, right, *_) in enumerate(merges, start=len(vectors)):
        clusters[number] = clusters.pop(int(left)) + clusters.pop(int(right))
    return list(clusters.values())


def _nearest_to_centroid(vectors: np.ndarray, cluster: list[int]) -> int:
    """Return the member of a cluster nearest its centroid; of equally near ones the best in the first objective."""
    candidates = np.array(sorted(cluster, reverse=True))
    distances = np.linalg.norm(vectors[candidates] - vectors[candidates].mean(axis=0), axis=1)
    return int(candidates[np.argmax(distances <= distances.min() + TIE)])

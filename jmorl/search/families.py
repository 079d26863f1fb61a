"""Families: policies of a front between which blends lose little, so that a continuum lies between them.

Xu et al. 2020 (section 3.4) group the policies of a front by their parameters. Here neighbours on the front are of one
family if what lies half-way between them was evaluated, and is no worse than the line between them.

Letters: N policies, E pairs of neighbours, M objectives.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components, minimum_spanning_tree

from jmorl.search.policy import Policy

TOLERANCE = 0.02  # of the front's range, that a blend of one family may lie below the line between its ends
ON_THE_LINE = np.linspace(0, 1, 101)[:, None]  # where between its ends a line is looked at
AT_ONCE = 2**22  # numbers that distances among three points may take


@dataclass(frozen=True, eq=False)
class Link:
    """Two neighbours on the front, and the blend half-way between them."""

    ends: tuple[int, int]  # ids
    values: np.ndarray  # [M] of the blend
    loss: float  # of the front's range, that it lies below the line between its ends

    @property
    def holds(self) -> bool:
        """Whether the ends are of one family."""
        return self.loss <= TOLERANCE


@dataclass(frozen=True, eq=False)
class Blending:
    """What came of blending a front."""

    front: tuple[Policy, ...]  # before
    links: tuple[Link, ...]
    blends: tuple[Policy, ...]  # that joined, each confirmed; their ids count from the one that was given
    tried: int
    evaluation_steps: int

    @cached_property
    def families(self) -> list[list[int]]:
        """The ids of each family of the front before."""
        ids = [policy.id for policy in self.front]
        links = [(ids.index(link.ends[0]), ids.index(link.ends[1])) for link in self.links if link.holds]
        return [[ids[index] for index in family] for family in families(len(ids), links)]


def neighbours(scaled: np.ndarray) -> np.ndarray:
    """Return the pairs [E, 2] of vectors [N, M] that are neighbours: no other lies in the ball between them.

    It is the Gabriel graph (Gabriel and Sokal 1969). Two objectives of a front have each vector between two others.
    """
    squared = np.square(scaled[:, None] - scaled[None]).sum(axis=2)
    np.fill_diagonal(squared, 0.0)
    found = []
    rows_at_once = max(AT_ONCE // len(scaled) ** 2, 1)
    for start in range(0, len(scaled), rows_at_once):
        some = squared[start : start + rows_at_once]
        sums = some[:, None, :] + squared[None]  # [rows, N, N]: by way of each third vector
        rows = np.arange(len(some))
        sums[rows, :, start + rows] = np.inf
        sums[:, np.arange(len(scaled)), np.arange(len(scaled))] = np.inf
        first, second = np.nonzero(sums.min(axis=2) >= some)
        found.append(np.stack([first + start, second], axis=1))
    pairs = np.concatenate(found)
    return np.asarray(pairs[pairs[:, 0] < pairs[:, 1]])


def below_line(first: np.ndarray, second: np.ndarray, between: np.ndarray) -> float:
    """Return how far a vector [M] lies below the line of two others: added to each objective, it reaches the line.

    Negative for one above it. All are in one scale.
    """
    line = (1 - ON_THE_LINE) * first + ON_THE_LINE * second
    return float((line - between).max(axis=1).min())


def families(count: int, links: Sequence[tuple[int, int]]) -> list[list[int]]:
    """Return the parts of so many policies that links hold together, each in order, those with the first one first."""
    first, second = np.array(links, int).reshape(-1, 2).T
    graph = coo_array((np.ones(len(first)), (first, second)), shape=(count, count))
    labels = connected_components(graph, directed=False)[1]
    return [np.flatnonzero(labels == label).tolist() for label in dict.fromkeys(labels.tolist())]


def largest_gap(scaled: np.ndarray) -> float:
    """Return the largest distance that must be crossed to get from one vector [N, M] to every other; 0 with one."""
    distances = np.linalg.norm(scaled[:, None] - scaled[None], axis=2)
    return float(minimum_spanning_tree(distances).max()) if len(scaled) > 1 else 0.0

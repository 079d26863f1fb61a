"""The front made denser without training: blends of its policies, tried where its gaps are largest.

Letters: P agents, N policies, M objectives, K policies that a blend is of.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import jax
import numpy as np

from jmorl.confirmation import batches, confirmed
from jmorl.learning.blending import blend, positive_shares
from jmorl.learning.moppo import TrainState
from jmorl.learning.population import Population
from jmorl.scoring import raw_scores
from jmorl.search.families import Blending, Link, below_line, neighbours
from jmorl.search.pareto import farthest_first, non_dominated
from jmorl.search.policy import Blend, Policy, values_of
from jmorl.search.scaling import Scale, range_scale

LEAST_GAP = 0.01  # of the front's range: nothing is looked for in smaller ones
LEAST_EPISODES = 100  # fresh ones, that confirm a blend
TRIES = 3  # times as many blends are tried, beside those half-way between neighbours, as may join the front
BEYOND = 1.5  # on the line from a policy, 0, to its neighbour, 1: where a blend beyond the neighbour is tried
BEYOND_ENDS = 0.5  # of the front's range, that a blend may lie beyond its ends
LEAST_SHARE = -1.0  # of a policy in a blend: what is too far away from all policies seldom works

Shares = Mapping[int, float]  # of the policies of a front, by their index; they add up to one


@dataclass(frozen=True, eq=False)
class _Point:
    """A policy of the front, or a blend that was tried."""

    shares: Shares  # of the front's policies, by their index
    values: np.ndarray  # [M]
    std: np.ndarray  # [M]
    discounted: np.ndarray  # [M]


def blend_front(
    front: Sequence[Policy],
    archive: Sequence[Policy],
    population: Population,
    keys: jax.Array,  # [episodes] that the run's policies are evaluated from
    fresh_key: jax.Array,  # for starts that confirm
    episodes: int,  # fresh ones
    most: int,  # blends that may join
    generation: int,
    next_id: int,
) -> Blending:
    """Return blends of a front that no policy of the archive dominates, at most so many, each with a confirmed score.

    Half-way between all neighbours one is tried; then, where gaps are largest, more: between what was found, and beyond
    one neighbour of a gap, away from what lies behind it. Of the best those are taken that fill gaps, and are confirmed
    by fresh episodes.
    """
    return _Search(front, archive, population, keys).result(
        fresh_key, max(episodes, LEAST_EPISODES), most, generation, next_id
    )


class _Search:
    """Blends that are tried on the way."""

    def __init__(self, front: Sequence[Policy], archive: Sequence[Policy], population: Population, keys: jax.Array):
        self.front = sorted(front, key=lambda policy: tuple(policy.values))
        self.archive = archive
        self.population = population
        self.keys = keys
        self.scale: Scale = range_scale(values_of(front))
        self.points = [
            _Point({index: 1.0}, policy.values, policy.std, policy.discounted)
            for index, policy in enumerate(self.front)
        ]
        self.family = list(range(len(self.front)))  # of each policy of the front, as far as known
        self.tried: set[frozenset[tuple[int, float]]] = set()
        self.steps = 0

    def result(self, key: jax.Array, episodes: int, most: int, generation: int, next_id: int) -> Blending:
        """Return what comes of it, with the blends that are confirmed."""
        links = list(self._links())
        blending = Blending(tuple(self.front), tuple(links), (), 0, 0)
        for number, family in enumerate(blending.families):
            for index, policy in enumerate(self.front):
                if policy.id in family:
                    self.family[index] = number
        left = TRIES * most
        while left > 0 and (promising := self._promising()[: min(self.population.size, left)]):
            self._try(promising)
            left -= len(promising)
        blends = self._confirmed(key, episodes, most, generation)
        numbered = tuple(replace(policy, id=next_id + index) for index, policy in enumerate(blends))
        return replace(blending, blends=numbered, tried=len(self.tried), evaluation_steps=self.steps)

    def _links(self) -> Iterator[Link]:
        """Try what is half-way between neighbours of the front. Yields them."""
        pairs = [(self.points[i], self.points[j]) for i, j in neighbours(self._scaled(self.points))]
        tried = self._try([_combined(first, second, 0.5) for first, second in pairs])
        for (first, second), found in zip(pairs, tried, strict=True):
            ends = [self.front[index].id for point in (first, second) for index in point.shares]
            loss = below_line(*self._scaled([first, second, found]))
            yield Link((ends[0], ends[1]), found.values, loss)

    def _promising(self) -> list[Shares]:
        """Return blends that were not tried yet, those in the widest gaps first.

        In each gap that is half-way, and beyond both of its edges. What lies beyond an end of the front is as promising
        as the gap before the end is wide.
        """
        best = self._best()
        scaled = self._scaled(best)
        pairs = neighbours(scaled)
        found: list[tuple[float, Shares]] = []
        for first, second in pairs:
            width = float(np.linalg.norm(scaled[first] - scaled[second]))
            found.append((width, _combined(best[first], best[second], 0.5)))
            for edge, other in ((first, second), (second, first)):
                ahead = scaled[other] - scaled[edge]
                behind = self._behind(best, scaled, edge, ahead)
                source = other if behind is None else behind  # with nothing behind it the edge is an end of the front
                found.append((width, _combined(best[source], best[edge], BEYOND)))
        wide = [(width, shares) for width, shares in found if width > LEAST_GAP]
        new = {
            _name(shares): (width, shares)
            for width, shares in wide
            if min(shares.values()) >= LEAST_SHARE and _name(shares) not in self.tried
        }
        return [shares for _, shares in sorted(new.values(), key=lambda each: -each[0])]

    def _behind(self, points: Sequence[_Point], scaled: np.ndarray, edge: int, ahead: np.ndarray) -> int | None:
        """Return the index of a point on the other side of a gap's edge than the gap, and about as far from it.

        `ahead` [M] leads from the edge into the gap. One of the edge's own family goes before all others.
        """
        steps = scaled[edge] - scaled
        other_side = np.flatnonzero(steps @ ahead > 0)
        if not len(other_side):
            return None
        near = [index for index in other_side.tolist() if self._related(points[edge], points[index])]
        choice = np.array(near) if near else other_side
        misfit = np.abs(np.linalg.norm(steps[choice], axis=1) - np.linalg.norm(ahead))
        return int(choice[misfit.argmin()])

    def _related(self, first: _Point, second: _Point) -> bool:
        """Return whether two points are of one family."""
        return len({self.family[index] for point in (first, second) for index in point.shares}) == 1

    def _best(self) -> list[_Point]:
        """Return all that is known, but for what is dominated, or far beyond the ends of the front."""
        kept = non_dominated(np.stack([point.values for point in self.points]))
        near = (self._scaled(self.points) >= -BEYOND_ENDS).all(axis=1)
        return [point for point, stays in zip(self.points, kept & near, strict=True) if stays]

    def _scaled(self, points: Sequence[_Point]) -> np.ndarray:  # [N, M]
        return self.scale.apply(np.stack([point.values for point in points]))

    def _try(self, blends: Sequence[Shares]) -> list[_Point]:
        """Evaluate blends, P at a time, and take them in."""
        found: list[_Point] = []
        for some in batches(blends, self.population.size):
            train_states = jax.tree.map(lambda *leaves: np.stack(leaves), *map(self._blended, some))
            scores = raw_scores(self.population.try_out(train_states, self.keys))
            self.steps += scores.steps
            # A blend whose numbers stop being finite counts as the worst there is.
            finite = np.isfinite(scores.values).all(axis=1, keepdims=True)
            values = np.where(finite, scores.values, self.scale.origin)
            found += map(_Point, some, values, scores.std, scores.discounted)
        found = found[: len(blends)]
        self.tried |= {_name(point.shares) for point in found}
        self.points += found
        return found

    def _blended(self, shares: Shares) -> TrainState:
        return blend([self.front[index].snapshot for index in shares], list(shares.values()))

    def _confirmed(self, key: jax.Array, episodes: int, most: int, generation: int) -> list[Policy]:
        """Return those of the best blends that fill gaps and, scored by fresh episodes, are still not dominated."""
        blends = [point for point in self._best() if len(point.shares) > 1]
        if not blends:
            return []
        scaled, taken = self._scaled(blends), self.scale.apply(values_of(self.front))
        chosen = [self._policy(blends[index], generation) for index in farthest_first(scaled, taken, most)]
        scored, steps = confirmed(chosen, self.population, key, episodes, len(self.keys), faults_stop=False)
        self.steps += steps
        found = [policy for policy in scored if np.isfinite(policy.values).all()]
        stays = non_dominated(values_of([*self.archive, *found]))[len(self.archive) :]
        return [policy for policy, each in zip(found, stays, strict=True) if each]

    def _policy(self, point: _Point, generation: int) -> Policy:
        parents = {self.front[index].id: share for index, share in point.shares.items()}
        weights = np.sum([share * self.front[index].weights for index, share in point.shares.items()], axis=0)
        ids = sorted(parents)
        return Policy(
            id=-1,
            generation=generation,
            parent=None,
            weights=np.array(positive_shares(weights)),
            values=point.values,
            std=point.std,
            discounted=point.discounted,
            snapshot=self._blended(point.shares),
            blend=Blend(tuple(ids), tuple(parents[each] for each in ids)),
        )


def _combined(first: _Point, second: _Point, position: float) -> Shares:
    """Return the shares in the blend at a position on the line from one point, 0, to another, 1, and beyond."""
    shares = {
        index: (1 - position) * first.shares.get(index, 0.0) + position * second.shares.get(index, 0.0)
        for index in sorted({*first.shares, *second.shares})
    }
    return {index: share for index, share in shares.items() if share}


def _name(shares: Shares) -> frozenset[tuple[int, float]]:
    return frozenset(shares.items())

"""Confirmed scores: what finalists are worth on fresh starts, which had no part in picking them.

The score that picked a policy may flatter it: the same starts score all policies of a run, so that the best of many is
the luckiest, too, and a rare fall may not be among them.

A fall in one of 300 episodes is more likely than not to be missing from 128 fresh ones, too. So the error of a score
counts one more episode, as far from the policy's mean as any episode of those confirmed with it was from its own: what
one finalist was seen to do, another may do on a start that it was not tried on. Without it one result in five on
HalfCheetah lay further from the mean of 1,000 other episodes than their error said.

Letters: P agents, N policies, M objectives.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from statistics import NormalDist
from typing import TypeVar

import jax
import numpy as np

from jmorl.learning.population import Population
from jmorl.scoring import raw_scores
from jmorl.search.pareto import farthest_first
from jmorl.search.policy import Confirmation, Policy, values_of
from jmorl.search.scaling import core_scale

T = TypeVar("T")
FINALISTS = 4  # times P: as many policies are confirmed before the last question, at most
CONFIDENCE = 0.99  # that the error of a confirmed score covers the mean of all starts, in each objective


def finalists(front: Sequence[Policy], choice: Policy | None, agents: int) -> list[Policy]:
    """Return the policies of a front that the result is likely to be among: all of a few.

    Of many half are those nearest the choice, and half are spread over the rest, each the one farthest from those so
    far (Gonzalez 1985): the choice may have been a stand-in's, or somebody may think otherwise at the end. None where
    there are many, and no choice.
    """
    most = FINALISTS * agents
    if len(front) <= most:
        return list(front)
    if choice is None:
        return []
    values = values_of(front)
    scale = core_scale(values)
    scaled = scale.apply(values)
    order = np.argsort(np.linalg.norm(scaled - scale.apply(choice.values), axis=1), kind="stable")
    nearest = order[: most // 2].tolist()
    taken = {*nearest, *farthest_first(scaled, scaled[nearest], most - len(nearest))}
    return [policy for index, policy in enumerate(front) if index in taken]


def confirmed(
    policies: Sequence[Policy],
    population: Population,
    key: jax.Array,
    episodes: int,
    at_once: int,
    faults_stop: bool = True,
) -> tuple[list[Policy], int]:
    """Return the policies with scores from so many fresh episodes or a few more, and the environment steps of these.

    All are scored from the same starts, drawn from `key`, `at_once` in each call of the compiled program. The errors
    of their scores allow for an episode like the oddest of them all. Raises TrainingFault for a return that is not
    finite, unless faults do not stop it.
    """
    evaluate = population.evaluate if faults_stop else population.try_out
    rounds = -(-episodes // at_once)
    found: list[np.ndarray] = []
    steps = 0
    for some in batches(policies, population.size):
        train_states = jax.tree.map(lambda *leaves: np.stack(leaves), *(policy.snapshot for policy in some))
        returns = []
        for number in range(rounds):
            scored = evaluate(train_states, jax.random.split(jax.random.fold_in(key, number), at_once))
            returns.append(np.asarray(scored.undiscounted, np.float64))
            steps += raw_scores(scored).steps
        found += list(np.concatenate(returns, axis=1))  # [episodes, M] each
    finite = [each for each in found if np.isfinite(each).all()]
    oddest = np.max([np.abs(each - each.mean(axis=0)).max(axis=0) for each in finite], axis=0, initial=0.0)  # [M]
    return [_confirmed(policy, each, oddest) for policy, each in zip(policies, found, strict=False)], steps


def batches(each: Sequence[T], size: int) -> Iterator[list[T]]:
    """Yield so many at a time; the last ones filled up with the first of them."""
    for start in range(0, len(each), size):
        some = list(each[start : start + size])
        yield some + some[:1] * (size - len(some))


def _confirmed(policy: Policy, returns: np.ndarray, oddest: np.ndarray) -> Policy:
    """Return the policy with the score of episodes [episodes, M]; its error allows for one more, [M] off their mean."""
    quantile = NormalDist().inv_cdf((1 + CONFIDENCE) / 2)
    std, episodes = returns.std(axis=0), len(returns)
    error = quantile * np.sqrt((std**2 + oddest**2 / episodes) / max(episodes - 1, 1))
    return replace(
        policy,
        values=returns.mean(axis=0),
        std=std,
        confirmation=Confirmation(policy.values, policy.std, episodes, error),
    )

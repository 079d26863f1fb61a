"""Fronts and questions of made-up policies."""

from collections.abc import Callable

import numpy as np
import pytest

from envs.core import Objective
from jmorl.decision.protocol import Question
from jmorl.search.policy import Policy

Front = tuple[Policy, ...]


def policy(id: int, values: np.ndarray) -> Policy:
    values = np.array(values, float)
    weights = np.full(len(values), 1 / len(values))
    return Policy(id, id // 10, None, weights, values, np.full(len(values), 0.5), values, None)


@pytest.fixture(scope="session")
def front_of() -> Callable[..., Front]:
    """Objective vectors [N, M] to policies with ids 10, 11, ..."""
    return lambda values: tuple(policy(id, each) for id, each in enumerate(np.asarray(values), start=10))


@pytest.fixture(scope="session")
def objectives_of() -> Callable[[int], tuple[Objective, ...]]:
    """The first few of four objectives."""
    every = tuple(Objective(name, f"{name} label", f"{name} unit") for name in ("time", "fuel", "noise", "tear"))
    return lambda count: every[:count]


@pytest.fixture(scope="session")
def ask(front_of, objectives_of) -> Callable[..., Question]:
    """A question about the vectors [N, M]."""

    def make(values, purpose="steer", generation=1, previous=None, bounds=None) -> Question:
        front = front_of(values)
        count = front[0].values.size
        bounds = np.full(count, -np.inf) if bounds is None else np.array(bounds, float)
        return Question(purpose, generation, objectives_of(count), front, bounds, previous)

    return make

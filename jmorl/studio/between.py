"""Blends of two policies on the page: what lies between them, at work and scored."""

from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import jax
import numpy as np

from jmorl.evaluation import evaluate_stored
from jmorl.search.policy import Blend
from jmorl.storage.blend_file import mix
from jmorl.storage.policy_file import StoredPolicy, load_policy

EPISODES = 16  # that score a blend while somebody moves the slider
BEYOND = 50  # per cent of the way between two policies, that a blend may lie beyond either


class BlendScore(NamedTuple):
    """What a blend returns."""

    mean: np.ndarray  # [M]
    std: np.ndarray  # [M] over the episodes


@lru_cache(maxsize=64)
def blended(first: Path, second: Path, per_cent: int) -> StoredPolicy:
    """Return the blend of two policy files, at so many per cent of the way from the first to the second.

    Raises PolicyFileError for those that do not fit, and ValueError for one too far beyond either.
    """
    if not -BEYOND <= per_cent <= 100 + BEYOND:
        raise ValueError(f"a blend lies from {-BEYOND} to {100 + BEYOND} % of the way, not at {per_cent} %")
    shares = [(load_policy(first), 1 - per_cent / 100), (load_policy(second), per_cent / 100)]
    shares.sort(key=lambda each: int(each[0].header["id"]))
    policies, coefficients = zip(*shares, strict=True)
    return mix(policies, Blend(tuple(policy.header["id"] for policy in policies), coefficients))


@lru_cache(maxsize=256)
def score(first: Path, second: Path, per_cent: int) -> BlendScore:
    """Return what the blend of two policy files returns, from the first of `jmorl evaluate`'s starts."""
    returns = evaluate_stored(blended(first, second, per_cent), jax.random.split(jax.random.key(0), EPISODES))
    undiscounted = np.asarray(returns.undiscounted, np.float64)
    return BlendScore(undiscounted.mean(axis=0), undiscounted.std(axis=0))

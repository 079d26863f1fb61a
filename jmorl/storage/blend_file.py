"""Blends of stored policies, without their run."""

from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from jmorl.learning.blending import Normalization, mixed, mixed_layers, mixed_normalization, positive_shares
from jmorl.search.policy import Blend
from jmorl.storage.policy_file import PolicyFileError, StoredPolicy

OF_ITS_TRAINING = ("generation", "parent")


def mix(policies: Sequence[StoredPolicy], blend: Blend) -> StoredPolicy:
    """Return the blend of stored policies, which has no score. Raises PolicyFileError for those that do not fit."""
    coefficients = np.array(blend.coefficients, float)
    if not len(policies) == len(coefficients) > 0 or not abs(coefficients.sum() - 1) < 1e-6:
        raise PolicyFileError(f"a blend needs a share of each policy, and they must add up to one; it has {blend}")
    first = policies[0]
    if any(_kind(other) != _kind(first) for other in policies[1:]):
        raise PolicyFileError("policies of other environments, networks or versions cannot be blended")
    normalizations = [Normalization(each.observation_mean, each.observation_variance) for each in policies]
    floor = first.header["network"]["variance_floor"]
    common = mixed_normalization(normalizations, blend.coefficients)
    weights = [np.array(each.header["weights"]) for each in policies]
    header = {
        **{name: content for name, content in first.header.items() if name not in OF_ITS_TRAINING},
        **{"id": None, "blend": asdict(blend), "weights": positive_shares(mixed(weights, blend.coefficients))},
    }
    return replace(
        first,
        header=header,
        layers=mixed_layers([each.layers for each in policies], normalizations, blend.coefficients, floor),
        log_std=mixed([each.log_std for each in policies], blend.coefficients),
        observation_mean=common.mean,
        observation_variance=common.variance,
    )


def _kind(policy: StoredPolicy) -> Any:
    """Return what must be equal for policies to be mixed."""
    header = policy.header
    shapes = [kernel.shape for kernel, _ in policy.layers]
    box = [array.tolist() for array in policy.box]
    return header["environment"], header["network"]["clip"], header["network"]["variance_floor"], shapes, box

"""Blends: policies whose parameters are affine combinations of those of others.

Between policies coefficients are positive (Xu et al. 2020, section 3.4); with a negative one a blend lies beyond one
policy, away from another. They add up to one.

A network sees observations in standard deviations from a mean, and each has statistics of its own. So the first layers
are rewritten for common statistics before they are mixed: what they compute stays the same, but for the clipping of
observations far out. A blend that is all of one policy is that policy.

Letters: K policies that are blended, O observation size.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import numpy as np

from jmorl.learning.moppo import TrainState
from jmorl.learning.statistics import VARIANCE_FLOOR

Layers = tuple[tuple[np.ndarray, np.ndarray], ...]  # kernel [in, out] and bias [out] of each


class Normalization(NamedTuple):
    """The statistics that a network's observations are normalised with."""

    mean: np.ndarray  # [O]
    variance: np.ndarray  # [O]


def mixed(arrays: Sequence[np.ndarray], coefficients: Sequence[float]) -> np.ndarray:
    """Return the combination of K arrays of one shape, in their kind of number."""
    total = sum(factor * np.asarray(array, np.float64) for factor, array in zip(coefficients, arrays, strict=True))
    return np.asarray(total, np.asarray(arrays[0]).dtype)


def mixed_normalization(normalizations: Sequence[Normalization], coefficients: Sequence[float]) -> Normalization:
    """Return the statistics of a blend."""
    shares = positive_shares(coefficients)
    return Normalization(*(mixed(each, shares) for each in zip(*normalizations, strict=True)))


def positive_shares(coefficients: Sequence[float] | np.ndarray) -> list[float]:
    """Return the shares in the statistics of a blend, K: variances and counts cannot be negative."""
    positive = np.maximum(coefficients, 0.0)
    shares: list[float] = (positive / positive.sum()).tolist()
    return shares


def mixed_layers(
    networks: Sequence[Layers],
    normalizations: Sequence[Normalization],
    coefficients: Sequence[float],
    variance_floor: float = VARIANCE_FLOOR,
) -> Layers:
    """Return the layers of a blend of K networks, for observations that `mixed_normalization` normalises."""
    common = mixed_normalization(normalizations, coefficients)
    rewritten = [
        (_rewritten(layers[0], own, common, variance_floor), *layers[1:])
        for layers, own in zip(networks, normalizations, strict=True)
    ]
    return tuple(
        (mixed([kernel for kernel, _ in layer], coefficients), mixed([bias for _, bias in layer], coefficients))
        for layer in zip(*rewritten, strict=True)
    )


def _rewritten(
    layer: tuple[np.ndarray, np.ndarray], own: Normalization, common: Normalization, floor: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return a first layer, for observations normalised with `own` statistics, for those with `common` ones.

    (x - m) / s = (x - m') / s' * s' / s + (m' - m) / s.
    """
    kernel, bias = layer
    own_std, common_std = (np.sqrt(np.asarray(each.variance, np.float64) + floor) for each in (own, common))
    shift = (np.asarray(common.mean, np.float64) - own.mean) / own_std
    return (kernel * (common_std / own_std)[:, None]).astype(kernel.dtype), (bias + shift @ kernel).astype(bias.dtype)


def blend(train_states: Sequence[TrainState], coefficients: Sequence[float]) -> TrainState:
    """Return the blend of K train states, host arrays: actor, critic and statistics.

    The optimiser's state is that of the one with the greatest coefficient: it is forgotten in a few updates.
    """
    first = train_states[int(np.argmax(coefficients))]
    normalizations = [
        Normalization(np.asarray(each.observation_statistics.mean), np.asarray(each.observation_statistics.variance))
        for each in train_states
    ]
    actors = [each.parameters["actor"]["params"] for each in train_states]
    critics = [each.parameters["critic"]["params"] for each in train_states]
    parameters = {
        "actor": {
            "params": {
                "MLP_0": _blended_mlp([actor["MLP_0"] for actor in actors], normalizations, coefficients),
                "log_std": mixed([actor["log_std"] for actor in actors], coefficients),
            }
        },
        "critic": {"params": _blended_mlp(critics, normalizations, coefficients)},
    }
    shares = positive_shares(coefficients)
    statistics = [
        jax.tree.map(lambda *arrays: mixed(arrays, shares), *each)
        for each in (
            [state.observation_statistics for state in train_states],
            [state.return_statistics for state in train_states],
        )
    ]
    return TrainState(parameters, jax.tree.map(np.copy, first.optimizer_state), *statistics)


def layers_of(mlp: Any) -> Layers:
    """Return the layers of an `MLP`'s parameters, the first one first."""
    return tuple((mlp[f"Dense_{index}"]["kernel"], mlp[f"Dense_{index}"]["bias"]) for index in range(len(mlp)))


def _blended_mlp(mlps: Sequence[Any], normalizations: Sequence[Normalization], coefficients: Sequence[float]) -> Any:
    layers = mixed_layers([layers_of(mlp) for mlp in mlps], normalizations, coefficients)
    return {f"Dense_{index}": {"kernel": kernel, "bias": bias} for index, (kernel, bias) in enumerate(layers)}

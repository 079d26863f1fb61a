"""Moving arrays [..., n, batch] along the tree, with indices known when the program is traced."""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np

from envs.planar.model import PlanarModel


def pick(values: jax.Array, index: np.ndarray) -> jax.Array:  # [..., n, batch] -> [..., len(index), batch]
    """Return the entries `index`. What comes from a single entry is left at length 1, to be broadcast."""
    first = int(index[0])
    if (index == first).all():
        return values[..., first : first + 1, :]
    if (np.diff(index) == 1).all():
        return values[..., first : first + len(index), :]
    return jnp.stack([values[..., int(i), :] for i in index], axis=-2)


def total(values: jax.Array, index: np.ndarray, size: int) -> jax.Array:  # [..., n, batch] -> [..., size, batch]
    """Return sums of the entries that share an `index`, in order.

    Written out, as reductions of a few terms are slow.
    """
    if len(index) == size and (index == np.arange(size)).all():
        return values
    sums = [sum(values[..., int(i), :] for i in np.flatnonzero(index == bin)) for bin in range(size)]
    return jnp.stack([jnp.broadcast_to(each, values[..., 0, :].shape) for each in sums], axis=-2)


def at_slots(model: PlanarModel, levels: Sequence[jax.Array]) -> jax.Array:  # [..., slots, batch]
    """Return what each level's bodies have, [..., bodies, batch], at all slots."""
    slots = []
    for values, level in zip(levels, model.levels, strict=True):
        picked = pick(values, level.slot_body)
        slots.append(jnp.broadcast_to(picked, (*picked.shape[:-2], len(level.slot_body), picked.shape[-1])))
    return jnp.concatenate(slots, axis=-2)


def constant(values: np.ndarray, like: jax.Array) -> jax.Array:  # [..., n] -> [..., n, 1]
    """Numbers of the model, to be used with an array [..., n, batch]."""
    return jnp.asarray(values, like.dtype)[..., None]

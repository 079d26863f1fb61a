"""The box that an environment's actions lie in, and the action that the output of a policy stands for.

A policy knows nothing of an environment's units: what it puts out is *normalised*, -1 and 1 being the two bounds of a
component. `ActionBox.action` is the one place where the environment's own units begin.
"""

from types import ModuleType
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from numpy.typing import ArrayLike


class ActionBox(NamedTuple):
    """The bounds of each of A components, and how a normalised action is mapped onto them.

    A component with an infinite bound has no middle and no width: it keeps its units (centre 0, half width 1).
    """

    low: Any  # [A] float32, the environment's own units
    high: Any  # [A] float32
    centre: Any  # [A] float32
    half_width: Any  # [A] float32

    def action(self, normalized: Any, xp: ModuleType = jnp) -> Any:  # [..., A] -> [..., A]
        """Return the action within the box that a policy's output stands for: centre + half width * output, clipped.

        `xp` is `jax.numpy`, or `numpy` for what is computed without JAX.
        """
        low, high, centre, half_width = (xp.broadcast_to(each, normalized.shape) for each in self)
        return xp.clip(centre + half_width * normalized, low, high)

    @property
    def normalized_bounds(self) -> tuple[np.ndarray, np.ndarray]:  # [A], [A]
        """The bounds as a policy's output meets them: -1 and 1, or what a component without a width has itself."""
        bounded = np.isfinite(self.low) & np.isfinite(self.high)
        return np.where(bounded, np.float32(-1), self.low), np.where(bounded, np.float32(1), self.high)


def action_box(low: ArrayLike, high: ArrayLike, size: int) -> ActionBox:
    """Return the box between two bounds, each a number or one for each of `size` components.

    Raises ValueError, naming the bound and its component, for what is no such thing or leaves nothing in between.
    """
    lows, highs = _bound("action_low", low, size), _bound("action_high", high, size)
    if not (lows < highs).all():
        component = int(np.argmin(lows < highs))
        which = f" in component {component}" if size > 1 else ""
        raise ValueError(f"action_low {lows[component]:g} is not below action_high {highs[component]:g}{which}")
    bounded = np.isfinite(lows) & np.isfinite(highs)
    wide_low, wide_high = lows.astype(np.float64), highs.astype(np.float64)  # where no sum or difference overflows
    with np.errstate(invalid="ignore"):  # inf - inf, which is not taken
        centre = np.where(bounded, (wide_low + wide_high) / 2, 0.0)
        half_width = np.where(bounded, (wide_high - wide_low) / 2, 1.0)
    return ActionBox(lows, highs, centre.astype(np.float32), half_width.astype(np.float32))


def _bound(name: str, bound: ArrayLike, size: int) -> np.ndarray:
    """Return a bound as float32 [A]. Raises ValueError."""
    try:
        values = np.asarray(bound)
        is_number = jnp.issubdtype(values.dtype, np.integer) or jnp.issubdtype(values.dtype, np.floating)
    except (TypeError, ValueError):  # of unequal lengths, or traced by JAX
        is_number = False
    if not is_number:
        raise ValueError(f"{name} is {bound!r}, not a number, or one for each of {size} components")
    if values.shape not in ((), (size,)):
        raise ValueError(f"{name} has shape {values.shape}, not () or ({size},)")
    with np.errstate(over="ignore"):  # what float32 has no number for is as good as infinite
        values = np.broadcast_to(values.astype(np.float32), (size,))
    if np.isnan(values).any():
        raise ValueError(f"{name} is not a number (NaN); -inf and inf leave a side open")
    return values

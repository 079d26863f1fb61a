"""Optimal undiscounted values of mo-mountaincarcontinuous-v0 on a grid of its states.

For weights (w_time, w_fuel) the value V solves V(s) = max_f w·r(s, f) + V(s') with V = 0 after
termination and no discount. Modified policy iteration (Puterman 1994, section 6.5) solves it on a
grid of positions and velocities; successors come from the environment's own `transition` and V
between the grid points is bilinear (semi-Lagrangian). Each grid starts from the solution of the grid
half as fine.

V is stationary: it does not know how many of the 999 steps of the time limit are left. It is bounded
below by -999 w_time, the value of never moving. This is exact as long as the best episodes are much
shorter than the limit; they last about 410 steps at w_time = 0.02, and below about 0.01 not moving
is best. Weights on time under 0.02 are therefore refused.

Shape letters: W weights, I positions, J velocities, K = I * J.
"""

import hashlib
import os
from functools import cache, partial
from pathlib import Path
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from envs import mountain_car
from envs.mountain_car import LEFT_WALL, MAX_SPEED, RIGHT_WALL, CarState, MountainCar


class Grid(NamedTuple):
    """How many evenly spaced positions and velocities, both ends included."""

    positions: int
    velocities: int

    @property
    def halved(self) -> "Grid":
        """The grid with every second point."""
        return Grid((self.positions + 1) // 2, (self.velocities + 1) // 2)


ENVIRONMENT = MountainCar()
FINEST = Grid(801, 561)
FEWEST_POSITIONS = 101  # a grid with fewer than twice as many starts from the value of not moving
GRID_FORCES = 41
EVALUATION_SWEEPS = 40  # of a fixed policy, between two improvements
TOLERANCE = 1e-3  # largest change of V in one improvement, in units of utility
MOST_IMPROVEMENTS = 200
LEAST_WEIGHT_ON_TIME = 0.02

CACHE = Path(__file__).parents[1] / ".cache" / "exact_front"


def optimal_values(weights: np.ndarray, grid: Grid = FINEST, cache: Path | None = CACHE) -> np.ndarray:
    """Return the optimal value of every grid point, for weights [W, 2] on (time, fuel): [W, I, J] in units of utility.

    Solutions are kept in the folder `cache`; None keeps nothing. Raises ValueError for weights that
    are not [W, 2], negative, or so small on time that the time limit matters.
    """
    weights = np.asarray(weights, np.float32)
    if weights.ndim != 2 or weights.shape[1] != 2:
        raise ValueError(f"weights must be [W, 2], on time and fuel, but have shape {weights.shape}")
    if (weights[:, 1] < 0).any() or (weights[:, 0] < LEAST_WEIGHT_ON_TIME * weights.sum(axis=1)).any():
        raise ValueError(
            f"weights must not be negative, with at least {LEAST_WEIGHT_ON_TIME:.0%} on time, where the time limit "
            f"does not matter; got {weights.tolist()}"
        )
    return np.stack([_stored_value(weight, grid, cache) for weight in weights])


def _stored_value(weight: np.ndarray, grid: Grid, cache: Path | None) -> np.ndarray:  # [I, J]
    """Return the value of one weight [2], from the cache if it is there."""
    if cache is None:
        return _solve(weight, grid, cache)
    file = cache / f"{_cache_key(weight.tobytes(), grid)}.npy"
    if not file.exists():
        value = _solve(weight, grid, cache)
        cache.mkdir(parents=True, exist_ok=True)
        unfinished = file.with_suffix(f".{os.getpid()}.tmp")
        with unfinished.open("wb") as stream:
            np.save(stream, value)
        unfinished.replace(file)
    return np.load(file)


def _cache_key(weight: bytes, grid: Grid) -> str:
    """Return a name that changes with the weight, the grid, the dynamics and this solver."""
    return hashlib.sha256(weight + repr(grid).encode() + _sources()).hexdigest()[:32]


@cache
def _sources() -> bytes:
    return Path(__file__).read_bytes() + Path(str(mountain_car.__file__)).read_bytes()


def _solve(weight: np.ndarray, grid: Grid, cache: Path | None) -> np.ndarray:  # [I, J]
    """Solve for one weight [2] by modified policy iteration. Raises RuntimeError if it does not converge."""
    value = _first_guess(weight, grid, cache)
    for _ in range(MOST_IMPROVEMENTS):
        improved, forces = _improve(value, weight, grid)
        change = float(jnp.abs(improved - value).max())
        value = improved
        if change < TOLERANCE:
            return np.asarray(value).reshape(grid)
        value = _evaluate(value, forces, weight, grid)
    raise RuntimeError(f"no convergence for weight {weight.tolist()} on {grid}: V still changes by {change:.2g}")


def _first_guess(weight: np.ndarray, grid: Grid, cache: Path | None) -> jax.Array:  # [K]
    """Return the solution of the grid half as fine, or on the coarsest the value of never moving."""
    if grid.positions < 2 * FEWEST_POSITIONS - 1:
        return jnp.full(grid.positions * grid.velocities, -ENVIRONMENT.time_limit * weight[0])
    coarse = jnp.asarray(_stored_value(weight, grid.halved, cache).ravel())
    return _interpolate(coarse, _locate(_points(grid), grid.halved), grid.halved)


class Location(NamedTuple):
    """Where states lie in a grid: the corner below, and how far beyond it in units of the spacing."""

    corner: jax.Array  # [...] int32 flat index
    position: jax.Array  # [...] 0 to 1
    velocity: jax.Array  # [...] 0 to 1


def _points(grid: Grid) -> CarState:  # [K]
    positions = jnp.linspace(LEFT_WALL, RIGHT_WALL, grid.positions)
    velocities = jnp.linspace(-MAX_SPEED, MAX_SPEED, grid.velocities)
    position, velocity = jnp.meshgrid(positions, velocities, indexing="ij")
    return CarState(position.ravel(), velocity.ravel())


def _locate(state: CarState, grid: Grid) -> Location:
    x = (state.position - LEFT_WALL) / (RIGHT_WALL - LEFT_WALL) * (grid.positions - 1)
    y = (state.velocity + MAX_SPEED) / (2 * MAX_SPEED) * (grid.velocities - 1)
    i = jnp.clip(jnp.floor(x), 0, grid.positions - 2)
    j = jnp.clip(jnp.floor(y), 0, grid.velocities - 2)
    return Location(i.astype(jnp.int32) * grid.velocities + j.astype(jnp.int32), x - i, y - j)


def _interpolate(value: jax.Array, at: Location, grid: Grid) -> jax.Array:
    """Bilinear interpolation of `value` [K] at any number of locations."""
    left, right = at.corner, at.corner + grid.velocities
    on_left = (1 - at.velocity) * value[left] + at.velocity * value[left + 1]
    on_right = (1 - at.velocity) * value[right] + at.velocity * value[right + 1]
    return (1 - at.position) * on_left + at.position * on_right


def action_values(value: jax.Array, weight: jax.Array, state: CarState, forces: jax.Array, grid: Grid) -> jax.Array:
    """w·r + V(s') of states and as many forces, both [...] of one axis."""
    outcome = jax.vmap(ENVIRONMENT.transition)(state, forces[:, None])
    ahead = _interpolate(value, _locate(outcome.state, grid), grid)
    return outcome.reward @ weight + jnp.where(outcome.terminated, 0.0, ahead)


@partial(jax.jit, static_argnames="grid")
def _improve(value: jax.Array, weight: jax.Array, grid: Grid) -> tuple[jax.Array, jax.Array]:
    """One sweep of value iteration: the best action value [K] and the force that attains it [K]."""

    def try_force(best: tuple[jax.Array, jax.Array], force: jax.Array) -> tuple[tuple[jax.Array, jax.Array], None]:
        best_value, best_force = best
        forces = jnp.full_like(best_force, force)
        tried = action_values(value, weight, _points(grid), forces, grid)
        return (jnp.maximum(best_value, tried), jnp.where(tried > best_value, forces, best_force)), None

    nothing = (jnp.full_like(value, -jnp.inf), jnp.zeros_like(value))
    best, _ = jax.lax.scan(try_force, nothing, jnp.linspace(-1.0, 1.0, GRID_FORCES))
    return best


@partial(jax.jit, static_argnames="grid")
def _evaluate(value: jax.Array, forces: jax.Array, weight: jax.Array, grid: Grid) -> jax.Array:  # [K]
    """Sweeps of V for fixed forces [K], never below the value of not moving until the time limit."""
    outcome = jax.vmap(ENVIRONMENT.transition)(_points(grid), forces[:, None])
    at, reward = _locate(outcome.state, grid), outcome.reward @ weight
    never_moving = -ENVIRONMENT.time_limit * weight[0]

    def sweep(_: int, value: jax.Array) -> jax.Array:
        ahead = jnp.where(outcome.terminated, 0.0, _interpolate(value, at, grid))
        return jnp.maximum(reward + ahead, never_moving)

    return jax.lax.fori_loop(0, EVALUATION_SWEEPS, sweep, value)

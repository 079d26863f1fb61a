"""The exact undiscounted Pareto front of mo-mountaincarcontinuous-v0 for linear weights.

    python -m benchmarks.exact_front

solves the environment by value iteration on two grids, prints the front and writes
`exact_front.json` beside this file. Other benchmarks call `exact_front` or `greedy_returns` with
the start positions on which they evaluated their own policies.

Method. `car_values` solves for the optimal values on a grid. The reported returns do not come from
the grid: they are those of episodes in the environment, whose every force maximises w·r + V(s')
over a far finer set of forces. At w_time = 1 fuel costs nothing, so its return is arbitrary among
the fastest episodes and only the time is meaningful.

Accuracy. Every return is attained in the environment, so a utility can only be too low. By how
much is shown twice: by the change from the next coarser grid, and by `trajectory_polish`, which
improves single episodes with the grid left out. Either is below 0.15 % of the mean utility for every
weight reported; a single episode may be one step too long, which matters most where time counts most.

Shape letters: W weights, S starts, T time limit, I positions, J velocities, K = I * J.
"""

import json
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from rich.table import Table

from benchmarks.car_values import ENVIRONMENT, FINEST, GRID_FORCES, Grid, action_values, optimal_values
from benchmarks.trajectory_polish import polished_return
from envs.mountain_car import CarState
from jmorl.display.console import PlainConsole

EPISODE_FORCES = 401

DEFAULT_STARTS = -0.6 + 0.2 * (np.arange(200) + 0.5) / 200  # [S] midpoints of 200 equal parts of U(-0.6, -0.4)
WEIGHTS_ON_TIME = (*(round(0.05 * i, 2) for i in range(1, 20)), 0.98)
USERS = {"A": 0.5, "B": 0.7, "C": 0.3}  # weight on time
POLISHED_STARTS = 5

RESULT = Path(__file__).with_suffix(".json")


class Episodes(NamedTuple):
    """Greedy episodes of every weight from every start."""

    returns: np.ndarray  # [W, S, 2] undiscounted (time, fuel)
    steps: np.ndarray  # [W, S] the terminating one included
    forces: np.ndarray  # [W, T, S] meaningless from `steps` on


def exact_front(weights: np.ndarray, start_positions: np.ndarray = DEFAULT_STARTS) -> np.ndarray:
    """Weights [W, 2] on (time, fuel) and starts [S] to the optimal mean returns [W, 2], on the finest grid.

    Raises ValueError as `optimal_values`.
    """
    return greedy_returns(optimal_values(weights), weights, start_positions).mean(axis=1)


def greedy_returns(values: np.ndarray, weights: np.ndarray, start_positions: np.ndarray) -> np.ndarray:
    """Undiscounted (time, fuel) [W, S, 2] of the policies greedy in `values` [W, I, J], from rest at [S]."""
    return greedy_episodes(values, weights, start_positions).returns


def greedy_episodes(values: np.ndarray, weights: np.ndarray, start_positions: np.ndarray) -> Episodes:
    """Play `values` [W, I, J] of `weights` [W, 2] greedily in the environment, from rest at each start [S]."""
    starts = jnp.asarray(start_positions, jnp.float32)
    played = [
        _play(jnp.asarray(value.ravel()), jnp.asarray(weight, jnp.float32), starts, Grid(*value.shape))
        for value, weight in zip(values, weights, strict=True)
    ]
    return Episodes(*(np.stack([np.asarray(part) for part in parts]) for parts in zip(*played, strict=True)))


@partial(jax.jit, static_argnames="grid")
def _play(value: jax.Array, weight: jax.Array, starts: jax.Array, grid: Grid) -> tuple[jax.Array, jax.Array, jax.Array]:
    """Greedy episodes for one weight [2] from starts [S]: returns [S, 2], steps [S], forces [T, S]."""
    forces = jnp.linspace(-1.0, 1.0, EPISODE_FORCES)

    def best_force(state: CarState) -> jax.Array:
        everywhere = jax.tree.map(lambda x: jnp.full_like(forces, x), state)
        return forces[jnp.argmax(action_values(value, weight, everywhere, forces, grid))]

    def move(state: CarState, running: jax.Array) -> tuple[CarState, jax.Array, jax.Array, jax.Array]:
        force = jax.vmap(best_force)(state)
        outcome = jax.vmap(ENVIRONMENT.transition)(state, force[:, None])
        reward = jnp.where(running[:, None], outcome.reward, 0.0)
        return outcome.state, running & ~jnp.asarray(outcome.terminated), reward, force

    def stay(state: CarState, running: jax.Array) -> tuple[CarState, jax.Array, jax.Array, jax.Array]:
        return state, running, jnp.zeros((*running.shape, 2)), jnp.zeros(running.shape)

    def step(carry: tuple[CarState, jax.Array], _: None) -> tuple[Any, Any]:
        # Nearly every step of the time limit comes after the last car arrived: skip the search there.
        state, still_running, reward, force = jax.lax.cond(carry[1].any(), move, stay, *carry)
        return (state, still_running), (reward, carry[1], force)

    first = (CarState(starts, jnp.zeros_like(starts)), jnp.ones(starts.shape, bool))
    _, (reward, running, force) = jax.lax.scan(step, first, length=ENVIRONMENT.time_limit)
    return reward.sum(axis=0), running.sum(axis=0), force


def _front_on(grid: Grid, weights: np.ndarray) -> Episodes:
    return greedy_episodes(optimal_values(weights, grid), weights, DEFAULT_STARTS)


def _polish_gains(weight: np.ndarray, episodes: Episodes, w: int) -> np.ndarray:
    """Return what polishing adds to the utility of a few evenly spread starts of weight number `w`, in per cent."""
    gains = []
    for s in np.linspace(0, len(DEFAULT_STARTS) - 1, POLISHED_STARTS).round().astype(int):
        forces = episodes.forces[w, : episodes.steps[w, s], s]
        utility = episodes.returns[w, s] @ weight
        polished = polished_return(ENVIRONMENT, forces, float(DEFAULT_STARTS[s]), weight) @ weight
        gains.append(100 * (polished - utility) / abs(utility))
    return np.array(gains)


def _row(weight: np.ndarray, fine: Episodes, coarse: Episodes, w: int) -> dict[str, float]:
    """Everything reported of weight number `w`. Returns and utilities are means over the default starts."""
    returns, coarse_returns = fine.returns[w].mean(axis=0), coarse.returns[w].mean(axis=0)
    gains = _polish_gains(weight, fine, w)
    row = {
        "weight_on_time": weight[0],
        "time": returns[0],
        "fuel": returns[1],
        "utility": returns @ weight,
        "mean_steps": fine.steps[w].mean(),
        "most_steps": fine.steps[w].max(),
        "coarse_time": coarse_returns[0],
        "coarse_fuel": coarse_returns[1],
        "coarse_utility": coarse_returns @ weight,
        "grids_differ_percent": 100 * ((returns - coarse_returns) @ weight) / abs(returns @ weight),
        "polish_gain_percent_mean": gains.mean(),
        "polish_gain_percent_max": gains.max(),
    }
    return {name: round(float(number), 4) for name, number in row.items()}


def _report(rows: list[dict[str, float]]) -> dict[str, Any]:
    users = {
        name: {"weight_on_time": on_time, "utility": row["utility"], "time": row["time"], "fuel": row["fuel"]}
        for name, on_time in USERS.items()
        for row in rows
        if row["weight_on_time"] == on_time
    }
    return {
        "environment": ENVIRONMENT.id,
        "method": "undiscounted modified policy iteration, bilinear in position and velocity; returns of greedy "
        "episodes in the environment; weights on (time, fuel) sum to one; no episode comes near the time limit, "
        "and V is bounded below by never moving, -999 times the weight on time",
        "starts": "midpoints of 200 equal parts of [-0.6, -0.4], at rest",
        "grid": FINEST._asdict() | {"forces": GRID_FORCES, "episode_forces": EPISODE_FORCES},
        "coarse_grid": FINEST.halved._asdict() | {"forces": GRID_FORCES, "episode_forces": EPISODE_FORCES},
        "polished_starts": POLISHED_STARTS,
        "users": users,
        "front": rows,
    }


def _table(rows: list[dict[str, float]]) -> Table:
    table = Table(title=f"Exact front of {ENVIRONMENT.id}, {len(DEFAULT_STARTS)} starts")
    fine, coarse = (f"{grid.positions} x {grid.velocities}" for grid in (FINEST, FINEST.halved))
    for column in ("weight on time", "time", "fuel", "steps (most)", f"utility {fine}", f"utility {coarse}"):
        table.add_column(column, justify="right")
    table.add_column("finer grid gains", justify="right")
    table.add_column("polishing gains (most)", justify="right")
    for row in rows:
        table.add_row(
            f"{row['weight_on_time']:.2f}",
            f"{row['time']:.2f}",
            f"{row['fuel']:.2f}",
            f"{row['mean_steps']:.1f} ({row['most_steps']:.0f})",
            f"{row['utility']:.3f}",
            f"{row['coarse_utility']:.3f}",
            f"{row['grids_differ_percent']:.3f} %",
            f"{row['polish_gain_percent_mean']:.3f} % ({row['polish_gain_percent_max']:.3f} %)",
        )
    return table


def main() -> None:
    """Solve, print and write `exact_front.json`."""
    on_time = np.array(WEIGHTS_ON_TIME)
    weights = np.stack([on_time, 1 - on_time], axis=1)
    fine, coarse = _front_on(FINEST, weights), _front_on(FINEST.halved, weights)
    rows = [_row(weight, fine, coarse, w) for w, weight in enumerate(weights)]
    report = _report(rows)
    console = PlainConsole()
    console.print(_table(rows))
    for name, user in report["users"].items():
        console.print(f"user {name} ({user['weight_on_time']:g} on time): utility {user['utility']:.3f}")
    RESULT.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

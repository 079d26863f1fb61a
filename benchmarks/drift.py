"""How far the paper's units drift: fixed policies reach the paper's targets with nothing learned at all.

    python -m benchmarks.drift          writes drift.npz beside this file, and prints what is reached when

Six near-optimal MountainCar policies, which never change, are scored in paper units generation after generation, after
30 untrained episodes, as in a run of six agents. Every score counts as in an archive that never scores anew. Then the
same with one and with three of the six replaced by a car that stands still.

The policies are greedy in the value function for gamma 0.995 at weights 1, .9, .7, .5, .3 and .15 on time, solved by
value iteration on a coarse grid: their returns are within a few per cent of the best, which is all that is needed.

Letters: K states of the grid, F forces, W weights, S starts, T steps of an episode.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rich.table import Table

from envs.mountain_car import GOAL_POSITION, GRAVITY, LEFT_WALL, MAX_SPEED, POWER, RIGHT_WALL
from jmorl.display.console import PlainConsole
from jmorl.units import RunningUnits, in_running_units, initial_units

GAMMA = 0.995  # of the value function, the scores and the units
ON_TIME = np.array([1.0, 0.9, 0.7, 0.5, 0.3, 0.15])  # [W]
STARTS = np.linspace(-0.6, -0.4, 5)  # [S]
POSITIONS = np.linspace(LEFT_WALL, RIGHT_WALL, 121)
VELOCITIES = np.linspace(-MAX_SPEED, MAX_SPEED, 121)
FORCES = np.linspace(-1.0, 1.0, 21)  # [F]
TOLERANCE = 1e-4
TIME_LIMIT = 999
UNTRAINED_EPISODES = 30
GENERATIONS = 19  # after the warm-up: 5 M steps are used up then
TARGETS = {"A": (-1.0, -1.0), "B": (-0.8, -1.2), "C": (-1.8, -0.5)}  # the paper's, Table 1
FIXTURE = Path(__file__).with_name("drift.npz")

Episode = tuple[np.ndarray, bool]  # raw rewards [T, 2], terminated
STANDING_STILL: Sequence[Episode] = [(np.tile([-1.0, 0.0], (TIME_LIMIT, 1)), False)] * len(STARTS)


def first_hits(policies: Sequence[Sequence[Episode]], seed: int = 0) -> tuple[dict[str, int | None], np.ndarray]:
    """Return when each target is reached first, None for never, and sigma, after each generation [G, 2].

    Generation 0 is the warm-up. A policy is its episodes; they never change.
    """
    units = after_untrained(seed)
    hits: dict[str, int | None] = dict.fromkeys(TARGETS)
    deviations = []
    for generation in range(GENERATIONS + 1):
        for policy in policies:
            score, units = scored(policy, units)
            for name, target in TARGETS.items():
                if hits[name] is None and (score >= target).all():
                    hits[name] = generation
        deviations.append(units.deviation)
    return hits, np.array(deviations)


def after_untrained(seed: int) -> RunningUnits:
    """Return the units after untrained agents: standard normal actions, clipped, which never reach the flag."""
    generator = np.random.default_rng(seed)
    units = initial_units(2)
    for _ in range(UNTRAINED_EPISODES):
        fuel = np.clip(generator.normal(size=TIME_LIMIT), -1, 1) ** 2
        _, units = in_running_units(np.stack([-np.ones(TIME_LIMIT), -fuel], axis=1), False, units, GAMMA)
    return units


def scored(episodes: Sequence[Episode], units: RunningUnits) -> tuple[np.ndarray, RunningUnits]:
    """Return the mean discounted return [2] of the episodes in running units, and those after them."""
    returns = []
    for rewards, terminated in episodes:
        scaled, units = in_running_units(rewards, terminated, units, GAMMA)
        returns.append(GAMMA ** np.arange(len(rewards)) @ scaled)
    return np.mean(returns, axis=0), units


def near_optimal_policies() -> list[list[Episode]]:
    """Return the fixture's policies, one for each weight, with an episode from each start."""
    with np.load(FIXTURE) as file:
        forces, lengths = file["forces"].astype(float), file["lengths"]
    return [[_episode(forces[w, s, : lengths[w, s]]) for s in range(len(STARTS))] for w in range(len(ON_TIME))]


def _episode(forces: np.ndarray) -> Episode:
    """Return the rewards of a car that reaches the flag with the last of the forces [T]."""
    time = np.append(-np.ones(len(forces) - 1), 0.0)
    return np.stack([time, -(forces**2)], axis=1), True


def move(position: np.ndarray, velocity: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Position and velocity after one step, and whether the flag is reached."""
    velocity = np.clip(velocity + POWER * force - GRAVITY * np.cos(3 * position), -MAX_SPEED, MAX_SPEED)
    position = np.clip(position + velocity, LEFT_WALL, RIGHT_WALL)
    velocity = np.where((position == LEFT_WALL) & (velocity < 0), 0.0, velocity)
    return position, velocity, (position >= GOAL_POSITION) & (velocity >= 0)


class Outcomes(NamedTuple):
    """Where every force leads from states [N]: reached the flag, or a place in the grid, all [N, F]."""

    reached: np.ndarray
    corner: np.ndarray  # flat index of the grid point below
    x: np.ndarray  # 0 to 1, how far beyond it
    y: np.ndarray


def outcomes(position: np.ndarray, velocity: np.ndarray) -> Outcomes:
    """Of every force, from states [N]."""
    position, velocity, reached = move(position[:, None], velocity[:, None], FORCES)
    x = (position - LEFT_WALL) / (POSITIONS[1] - POSITIONS[0])
    y = (velocity + MAX_SPEED) / (VELOCITIES[1] - VELOCITIES[0])
    i, j = np.minimum(x.astype(int), len(POSITIONS) - 2), np.minimum(y.astype(int), len(VELOCITIES) - 2)
    return Outcomes(reached, i * len(VELOCITIES) + j, x - i, y - j)


def action_values(value: np.ndarray, on_time: float, after: Outcomes) -> np.ndarray:
    """Return w . r + gamma V(s') [N, F], with V = `value` [K] bilinear between the points of the grid."""
    (reached, corner, x, y), across = after, len(VELOCITIES)
    low = (1 - y) * value[corner] + y * value[corner + 1]
    high = (1 - y) * value[corner + across] + y * value[corner + across + 1]
    reward = -on_time * ~reached - (1 - on_time) * FORCES**2
    return np.asarray(reward + GAMMA * np.where(reached, 0.0, (1 - x) * low + x * high))


def optimal_value(on_time: float) -> np.ndarray:  # [K]
    """Value iteration, from the value of never moving."""
    after = outcomes(*(grid.ravel() for grid in np.meshgrid(POSITIONS, VELOCITIES, indexing="ij")))
    value = np.full(len(POSITIONS) * len(VELOCITIES), -on_time / (1 - GAMMA))
    while True:
        better = action_values(value, on_time, after).max(axis=1)
        if np.abs(better - value).max() < TOLERANCE:
            return better
        value = better


def greedy_forces(value: np.ndarray, on_time: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the forces [S, TIME_LIMIT] from every start, and how many of them [S] it takes to the flag."""
    position, velocity = STARTS.copy(), np.zeros(len(STARTS))
    forces, lengths = np.zeros((len(STARTS), TIME_LIMIT)), np.zeros(len(STARTS), int)
    for step in range(TIME_LIMIT):
        forces[:, step] = FORCES[action_values(value, on_time, outcomes(position, velocity)).argmax(axis=1)]
        position, velocity, reached = move(position, velocity, forces[:, step])
        lengths = np.where(reached & (lengths == 0), step + 1, lengths)
    return forces, lengths


def main() -> None:
    """Solve, write the fixture and print the table."""
    played = [greedy_forces(optimal_value(on_time), on_time) for on_time in ON_TIME]
    forces, lengths = (np.stack(parts) for parts in zip(*played, strict=True))
    np.savez_compressed(FIXTURE, forces=forces[..., : lengths.max()].astype(np.float32), lengths=lengths)
    six = near_optimal_policies()
    table = Table(*("fixed policies", *TARGETS, "sigma after the warm-up", "at the end"), title="Reached in generation")
    for replaced in (0, 1, 3):
        hits, deviations = first_hits([*six[: 6 - replaced], *[STANDING_STILL] * replaced])
        name = f"{6 - replaced} near-optimal" + (f", {replaced} standing still" if replaced else "")
        reached = ("never" if hit is None else str(hit) for hit in hits.values())
        table.add_row(name, *reached, *(str(deviations[g].round(1).tolist()) for g in (0, -1)))
    PlainConsole().print(table)


if __name__ == "__main__":
    main()

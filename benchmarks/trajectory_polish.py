"""Improve one car episode by nonlinear programming, with no grid and no value function.

From a given start and for a given number of steps N the dynamics is a smooth function of the N
forces. The least fuel that reaches the flag at step N is a local optimum of

    min sum f_k^2   subject to   p_N >= goal, v_N >= 0, |f_k| <= 1,

found by sequential quadratic programming (Kraft 1988) from an episode that is nearly optimal; the
best N is searched upwards and downwards from that episode's length. Walls and the speed limit take
part: the constraints are computed by the environment's own `transition`, and so is the reported
return.
"""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import minimize

from envs.mountain_car import GOAL_POSITION, CarState, MountainCar

MARGIN = 2e-5  # beyond the goal, in position and velocity: float32 episodes shall arrive too
MOST_ITERATIONS = 100
PRECISION = 1e-5  # of the fuel, and of the scaled constraints
CONSTRAINT_SCALES = np.array([10.0, 100.0])  # position and velocity, to the size of the forces


def polished_return(
    environment: MountainCar,
    forces: np.ndarray,  # [N]
    start_position: float,
    weight: np.ndarray,  # [2]
) -> np.ndarray:  # [2]
    """Return the (time, fuel) of greatest utility among the episode `forces` and those polished from it.

    Every candidate is played in the environment, in float32, and dropped if it fails to terminate.
    """
    given = played_return(environment, forces, start_position)
    if given is None:
        raise ValueError(f"the episode to polish does not terminate within its {len(forces)} steps")

    def better(length: int, best: np.ndarray) -> np.ndarray | None:
        candidate_forces = least_fuel_forces(environment, forces, start_position, length)
        candidate = played_return(environment, candidate_forces, start_position)
        return candidate if candidate is not None and candidate @ weight > best @ weight else None

    best = better(len(forces), given)
    best = given if best is None else best
    for change in (-1, 1):
        length = len(forces) + change
        while (candidate := better(length, best)) is not None:
            best, length = candidate, length + change
    return best


def least_fuel_forces(
    environment: MountainCar,
    forces: np.ndarray,  # [N]
    start_position: float,
    length: int,
) -> np.ndarray:  # [length]
    """Locally least fuel to arrive at step `length`, searched from `forces` stretched to it.

    May fail to arrive: the caller plays it.
    """
    horizon = 64 * (length // 64 + 1)  # few distinct sizes: few compilations
    first = np.interp(np.linspace(0, 1, length), np.linspace(0, 1, len(forces)), forces)

    def beyond_goal(forces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        padded = np.zeros(horizon)
        padded[:length] = forces
        end, sensitivity = _end_and_sensitivity(environment, padded, length, start_position)
        excess = np.asarray(end) - np.array([GOAL_POSITION, 0.0]) - MARGIN
        return CONSTRAINT_SCALES * excess, CONSTRAINT_SCALES[:, None] * np.asarray(sensitivity)[:, :length]

    with jax.enable_x64(True):
        solution = minimize(
            lambda forces: (forces @ forces, 2 * forces),
            first,
            jac=True,
            bounds=[(-1, 1)] * length,
            constraints={"type": "ineq", "fun": lambda f: beyond_goal(f)[0], "jac": lambda f: beyond_goal(f)[1]},
            method="SLSQP",
            options={"maxiter": MOST_ITERATIONS, "ftol": PRECISION},
        )
    return np.asarray(solution.x)


def played_return(environment: MountainCar, forces: np.ndarray, start_position: float) -> np.ndarray | None:  # [2]
    """Return the (time, fuel) of playing `forces` [N] from rest until termination; None if they do not terminate."""
    padded = np.zeros(environment.time_limit, np.float32)
    padded[: len(forces)] = forces
    rewards, terminated = _play(environment, padded, np.float32(start_position))
    steps = np.flatnonzero(np.asarray(terminated)[: len(forces)])
    return np.asarray(rewards, np.float64)[: steps[0] + 1].sum(axis=0) if steps.size else None


@partial(jax.jit, static_argnums=0)
def _play(environment: MountainCar, forces: jax.Array, start: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Rewards [T, 2] and termination [T] of forces [T], played on past the flag."""

    def step(state: CarState, force: jax.Array) -> tuple[CarState, tuple[jax.Array, jax.Array]]:
        outcome = environment.transition(state, force[None])
        return outcome.state, (outcome.reward, jnp.asarray(outcome.terminated))

    return jax.lax.scan(step, CarState(start, jnp.zeros_like(start)), forces)[1]


@partial(jax.jit, static_argnums=0)
def _end_and_sensitivity(
    environment: MountainCar, forces: jax.Array, length: jax.Array, start: jax.Array
) -> tuple[jax.Array, jax.Array]:
    """Position and velocity [2] after the first `length` of the forces [H], and their derivative [2, H]."""

    def end(forces: jax.Array) -> tuple[jax.Array, jax.Array]:
        def step(state: CarState, k_and_force: tuple[jax.Array, jax.Array]) -> tuple[CarState, None]:
            k, force = k_and_force
            moved = environment.transition(state, force[None]).state
            return jax.tree.map(lambda new, old: jnp.where(k < length, new, old), moved, state), None

        state, _ = jax.lax.scan(step, CarState(start, jnp.zeros_like(start)), (jnp.arange(forces.size), forces))
        both = jnp.stack([state.position, state.velocity])
        return both, both

    sensitivity, reached = jax.jacrev(end, has_aux=True)(forces)
    return reached, sensitivity

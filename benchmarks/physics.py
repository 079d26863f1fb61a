"""Accuracy and speed of the planar dynamics of every runner, printed and written to `benchmarks/physics.json`.

    python -m benchmarks.physics                    beside MuJoCo, and MJX for the half cheetah, in the same run
    python -m benchmarks.physics --only ENV...      of these runners; what there is of others stays

Accuracy: one time step from each of 100,000 states and more, against MuJoCo with a solver that has converged. Speed:
environment steps; repetitions of all take turns, and the best of each counts, as machines are shared.
"""

import argparse
import json
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from jax.sharding import Mesh, PartitionSpec
from mujoco import rollout
from rich.table import Table

import envs
from benchmarks.runner_states import RUNNERS, Steps, kinds_of, runner_of, steps_of
from benchmarks.speed import machine
from envs.half_cheetah import HalfCheetah
from envs.physics import BodyState
from envs.planar import PlanarPhysics, solver
from envs.planar.step import forward
from jmorl.display.console import PlainConsole
from jmorl.learning.devices import usable_cores, use_all_cpu_cores

RESULT = Path(__file__).parent / "physics.json"
CHEETAH = HalfCheetah.id  # for which MJX is measured, too, and how many steps of Newton's method there are
STATES = 20_000  # of each kind
FIXED_STEPS = (2, 3, 4, 5, 6, 8)
# Environments -> environment steps in a repetition: about half a second.
ENVIRONMENTS = {24: 1000, 384: 120, 4096: 12}
MJX_ENVIRONMENTS, MJX_STEPS = 384, 4
REPEATS, MJX_REPEATS = 9, 3

Control = np.ndarray  # [steps, environments, U]


def main() -> None:
    """Measure, print and write, a runner at a time."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=RUNNERS, default=list(RUNNERS), metavar="ENV")
    options = parser.parse_args()
    use_all_cpu_cores()
    jax.config.update("jax_enable_compilation_cache", False)  # compilation is timed
    console = PlainConsole()
    for id in options.only:
        report = measured(id)
        for table in tables(id, report):
            console.print(table)
        whole = json.loads(RESULT.read_text(encoding="utf-8")) if RESULT.exists() else {}
        RESULT.write_text(json.dumps(whole | {id: report}, indent=1) + "\n", encoding="utf-8")


def measured(id: str) -> dict[str, Any]:
    """Return all that is found of a runner."""
    report: dict[str, Any] = {"machine": machine()}
    report["speed"] = [speed(id, environments, steps) for environments, steps in ENVIRONMENTS.items()]
    steps = {kind: steps_of(id, kind, STATES, seed) for seed, kind in enumerate(kinds_of(id))}
    report["accuracy"] = {kind: {} for kind in steps}
    for dtype in (np.float32, np.float64):
        after = advanced(id, steps, dtype)
        for kind, errors in after.items():
            report["accuracy"][kind][dtype.__name__] = distribution(errors)
    if id == CHEETAH:
        report["newton_steps"] = newton_steps(steps)
        report["fixed_steps"] = [fixed_steps(steps, count) for count in FIXED_STEPS]
    return report


# ---------------------------------------------------------------- accuracy


def advanced(id: str, steps: dict[str, Steps], dtype: type) -> dict[str, np.ndarray]:
    """Errors of the velocity one time step later, the greatest of a state's: [N] of each kind, m/s and rad/s."""
    with jax.enable_x64(dtype is np.float64):
        physics = PlanarPhysics(runner_of(id).model)

        def advance(qpos: jax.Array, qvel: jax.Array, control: jax.Array) -> jax.Array:
            return physics.advance(BodyState(qpos, qvel), control, 1)[0].qvel

        program = jax.jit(jax.vmap(advance))
        return {
            kind: np.abs(np.asarray(program(*_inputs(each, dtype))) - each.next_qvel[:STATES]).max(1)
            for kind, each in steps.items()
        }


def _inputs(steps: Steps, dtype: type) -> list[np.ndarray]:
    return [each[:STATES].astype(dtype) for each in (steps.qpos, steps.qvel, steps.control)]


def distribution(errors: np.ndarray) -> dict[str, Any]:
    """Quantiles, and how many are large."""
    levels = {"median": 0.5, "99 %": 0.99, "99.9 %": 0.999, "max": 1.0}
    return {
        "states": len(errors),
        **{name: float(f"{np.quantile(errors, level):.2g}") for name, level in levels.items()},
        "above 1e-3": int((errors > 1e-3).sum()),
        "above 1e-2": int((errors > 1e-2).sum()),
    }


def newton_steps(steps: dict[str, Steps]) -> dict[str, list[int]]:
    """How many states take 1, 2, 3, ... steps of Newton's method, the last of which finds that nothing changes."""
    model = PlanarPhysics(runner_of(CHEETAH).model).model

    def count(qpos: jax.Array, qvel: jax.Array, control: jax.Array) -> jax.Array:
        drive = jnp.asarray(model.actuator_gear, control.dtype) @ jnp.clip(control, *model.control_range)
        state = (each[:, None] for each in (qpos[model.dofs], qvel[model.dofs], drive))
        return forward(model, *state).solution.steps

    program = jax.jit(jax.vmap(count))
    counts = {kind: np.bincount(program(*_inputs(each, np.float32))) for kind, each in steps.items()}
    return {kind: each[1:].tolist() for kind, each in counts.items()}


def fixed_steps(steps: dict[str, Steps], count: int) -> dict[str, Any]:
    """Return what plain Newton steps miss if there are just so many."""
    with _at_most(count):
        errors = np.concatenate(list(advanced(CHEETAH, steps, np.float64).values()))
    return {"steps": count, **distribution(errors)}


@contextmanager
def _at_most(count: int) -> Iterator[None]:
    whole = solver.MAXIMAL_STEPS
    solver.MAXIMAL_STEPS = count
    try:
        yield
    finally:
        solver.MAXIMAL_STEPS = whole


# ---------------------------------------------------------------- speed


def speed(id: str, environments: int, steps: int) -> dict[str, Any]:
    """Environment steps a second, of so many environments for so many steps, by everyone who takes part."""
    start = _started(id, environments)
    rng, runner = np.random.default_rng(1), envs.make(id)
    normalized = rng.uniform(-1, 1, (steps, environments, runner.action_size)).astype(np.float32)
    controls = runner.action_box.action(normalized, np)
    compiled: dict[str, float] = {}
    players = {
        "planar": _jax_player(runner, "planar", start, controls, compiled),
        "mujoco": _mujoco_player(runner, start, controls),
    }
    row: dict[str, Any] = {"environments": environments, **_best(players, REPEATS, environments * steps)}
    if id == CHEETAH and environments == MJX_ENVIRONMENTS:
        few = controls[:MJX_STEPS]
        players = {
            "planar": _jax_player(runner, "planar", start, few, {}),
            "mjx": _jax_player(envs.make(id, physics="mjx"), "mjx", start, few, compiled),
        }
        row["beside mjx"] = _best(players, MJX_REPEATS, environments * MJX_STEPS)
    return row | {"compile_seconds": {name: round(seconds, 1) for name, seconds in compiled.items()}}


def _started(id: str, environments: int) -> tuple[np.ndarray, np.ndarray]:
    """States within a second or so of their start under random actions: qpos and qvel [N, V]."""
    steps = steps_of(id, "random actions", 200 * 100, seed=0)
    chosen = np.random.default_rng(0).choice(len(steps.qpos), environments)
    return steps.next_qpos[chosen], steps.next_qvel[chosen]


def _jax_player(
    runner: Any, name: str, start: tuple[np.ndarray, np.ndarray], controls: Control, compiled: dict[str, float]
) -> Callable[[], None]:
    """Return a runner's physics, its batch over all devices, as one program. Notes its compilation's seconds."""
    dynamics = runner.physics

    def advance(state: BodyState, control: jax.Array) -> tuple[BodyState, None]:
        return jax.vmap(lambda one, force: dynamics.advance(one, force, runner.frame_skip)[0])(state, control), None

    def play(state: BodyState, controls: jax.Array) -> BodyState:
        return jax.lax.scan(advance, state, controls)[0]

    mesh = Mesh(jax.devices(), ("device",))
    first, second = PartitionSpec("device"), PartitionSpec(None, "device")
    sharded = jax.shard_map(play, mesh=mesh, in_specs=(first, second), out_specs=first, check_vma=False)
    qpos, qvel = (jnp.asarray(each, jnp.float32) for each in start)
    arguments = BodyState(qpos, qvel), controls
    began = time.perf_counter()
    program = jax.jit(sharded).lower(*arguments).compile()
    compiled[name] = time.perf_counter() - began
    return lambda: jax.block_until_ready(program(*arguments)) and None


def _mujoco_player(runner: Any, start: tuple[np.ndarray, np.ndarray], controls: Control) -> Callable[[], None]:
    """MuJoCo's own rollouts on all threads, an environment step at a time, as a policy needs it."""
    model = runner.model
    threads = usable_cores()
    pool, workers = rollout.Rollout(nthread=threads), [mujoco.MjData(model) for _ in range(threads)]
    times = np.zeros((len(start[0]), 1))
    held = np.repeat(controls[:, :, None], runner.frame_skip, axis=2).astype(np.float64)  # [steps, N, substeps, U]

    def play() -> None:
        state = np.concatenate([times, *start], axis=1)
        for control in held:
            state = pool.rollout(model, workers, state, control)[0][:, -1]

    return play


def _best(players: dict[str, Callable[[], None]], repeats: int, steps: int) -> dict[str, Any]:
    """Each player's best rates in turns, by the clock and by the processors' time; and the first against the second."""
    clock, processor = (dict.fromkeys(players, np.inf) for _ in range(2))
    for player in players.values():
        player()
    for _ in range(repeats):
        for name, player in players.items():
            began = time.perf_counter(), time.process_time()
            player()
            clock[name] = min(clock[name], time.perf_counter() - began[0])
            processor[name] = min(processor[name], time.process_time() - began[1])
    ours, theirs = players
    return {
        "steps_per_second": {name: round(steps / seconds) for name, seconds in clock.items()},
        "steps_per_processor_second": {name: round(steps / seconds) for name, seconds in processor.items()},
        "times_as_fast": round(clock[theirs] / clock[ours], 2),
        "times_as_fast_by_processor": round(processor[theirs] / processor[ours], 2),
    }


# ---------------------------------------------------------------- for people


def tables(id: str, report: dict[str, Any]) -> Iterator[Table]:
    """Yield the report on a runner for people."""
    rates = Table("environments", "planar", "other", "times as fast", "by processor time")
    for row in report["speed"]:
        for result in filter(None, (row, row.get("beside mjx"))):
            (_, ours), (other, theirs) = result["steps_per_second"].items()
            ratios = result["times_as_fast"], result["times_as_fast_by_processor"]
            rates.add_row(str(row["environments"]), f"{ours:,}", f"{other} {theirs:,}", *map(str, ratios))
    seconds = {name: time for row in report["speed"] for name, time in row["compile_seconds"].items()}
    compilation = ", ".join(f"{name} {time} s" for name, time in seconds.items())
    rates.title = f"{id}: environment steps per second, {report['machine']['device']}; compilation: {compilation}"
    yield rates
    errors = ("median", "99 %", "99.9 %", "max", "above 1e-3", "above 1e-2")
    accuracy = Table("states", *errors, title=f"Error of the velocity after a time step, {STATES:,} states a row")
    for kind, types in report["accuracy"].items():
        for dtype, row in types.items():
            accuracy.add_row(f"{kind}, {dtype}", *(f"{row[column]:.4g}" for column in errors))
    yield accuracy
    if id != CHEETAH:
        return
    misses = Table("Newton steps", *errors, title="The same with so many plain Newton steps, float64, all states")
    for row in report["fixed_steps"]:
        misses.add_row(str(row["steps"]), *(f"{row[column]:.4g}" for column in errors))
    yield misses
    longest = max(map(len, report["newton_steps"].values()))
    counts = Table("states", *map(str, range(1, longest + 1)), title="States by Newton steps taken, float32")
    for kind, row in report["newton_steps"].items():
        counts.add_row(kind, *map(str, row))
    yield counts


if __name__ == "__main__":
    main()

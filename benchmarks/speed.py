"""Speed and memory of training, printed and written to `benchmarks/speed-ENVIRONMENT.json`.

    python -m benchmarks.speed              MountainCar, beside morl-baselines' PGMORL in the same run (10 minutes)
    python -m benchmarks.speed --env mo-halfcheetah-v5      (15 minutes)
    python -m benchmarks.speed --no-peer    without the peer

Compilation is timed apart from steady state, and every rate is of whole generations: training, evaluation and
selection. The peer runs in an environment of its own, `.venv-peer`, which is made the first time (gigabytes).
"""

import argparse
import json
import os
import platform
import resource
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import numpy as np
from rich.table import Table

import envs
from jmorl.config import resolve
from jmorl.display.console import PlainConsole
from jmorl.events import Compiled, GenerationFinished
from jmorl.learning.devices import usable_cores, use_all_cpu_cores
from jmorl.learning.population import Population
from jmorl.loop import run
from jmorl.search.prediction import Records, predict
from jmorl.search.selection import select_tasks
from jmorl.search.weights import evenly_spaced_weights, simplex_grid

HERE = Path(__file__).parent
ROOT = HERE.parent
PEER = ROOT / ".venv-peer"
PEER_PYTHON = PEER / "bin" / "python"
REPEATS = 3
SCALED_ITERATIONS = 2  # in a timed call, where sizes are compared


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--env", default="mo-mountaincarcontinuous-v0")
    parser.add_argument("--no-peer", action="store_true", help="without morl-baselines")
    parser.add_argument("--generations", type=int, default=5, help="of the measured runs (default: 5)")
    options = parser.parse_args()
    use_all_cpu_cores()
    report: dict[str, Any] = {"env": options.env, "machine": machine()}
    report["runs"] = {preset: whole_run(options.env, preset, options.generations) for preset in ("paper", "default")}
    report["parts"] = parts(options.env)
    report["selection"] = [selection(candidates) for candidates in (10, 100, 400)]
    report["scaling"] = scaling(options.env)
    if not options.no_peer:
        report["peer"] = peer(options.env)
        rate = report["peer"]["all_generations"]["steps_per_second"]
        for measured in report["runs"].values():
            measured["times_the_peer"] = round(measured["steps_per_second"] / rate, 1)
    console = PlainConsole()
    for table in tables(report):
        console.print(table)
    result = HERE / f"speed-{options.env}.json"
    result.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")


def machine() -> dict[str, Any]:
    """Return what it was measured on."""
    device = jax.devices()[0]
    return {
        "cpu": _cpu_name(),
        "cores": usable_cores(),
        "device": f"{jax.device_count()} x {device.device_kind}",
        "jax": jax.__version__,
        "load_before": round(os.getloadavg()[0], 2),
    }


def whole_run(env: str, preset: str, generations: int) -> dict[str, Any]:
    """Measure a PGMORL run at the preset's sizes: the median generation, and where its time goes."""
    config = resolve(preset, None, {"env": env, "method": "pgmorl"})
    iterations = config.population.warmup_iterations + (generations - 1) * config.population.iterations + 1
    config = config.replace(steps=iterations * config.steps_per_iteration)
    finished = []
    for event in run(config):
        if isinstance(event, Compiled):
            compile_seconds = event.seconds
        elif isinstance(event, GenerationFinished) and event.state.generation:
            finished.append(event)
    median = {
        part: statistics.median(getattr(event.seconds, part) for event in finished)
        for part in ("select", "train", "evaluate", "total")
    }
    return {
        "compile_seconds": round(compile_seconds, 2),
        "steps_per_second": round(statistics.median(event.steps_per_second for event in finished)),
        "slowest_and_fastest": [round(f(event.steps_per_second for event in finished)) for f in (min, max)],
        **{f"{part}_seconds": round(seconds, 4) for part, seconds in median.items()},
        **{f"{part}_share": round(median[part] / median["total"], 4) for part in ("select", "train", "evaluate")},
        "evaluation_steps_per_second": round(_evaluated_steps(finished) / median["evaluate"]),
        "peak_memory_mib": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024),
    }


def _evaluated_steps(finished: list[GenerationFinished]) -> float:
    """Environment steps of the median evaluation, up to the end of each episode."""
    counts = np.diff([event.state.evaluation_steps for event in finished])
    return float(np.median(counts))


def parts(env: str) -> dict[str, Any]:
    """Measure the environment alone, with random actions, all of a population's environments on one device."""
    environment = envs.make(env)
    count, steps = 24, 1000

    @jax.jit
    def play(key: jax.Array) -> jax.Array:
        states, _ = jax.vmap(environment.reset)(jax.random.split(key, count))
        keys = jax.random.split(key, (steps, count))
        actions = jax.random.uniform(key, (steps, count, environment.action_size), minval=-1.0)

        def act(states: Any, inputs: Any) -> Any:
            states, step = jax.vmap(environment.step)(inputs[0], states, inputs[1])
            return states, step.reward

        return jax.lax.scan(act, states, (keys, actions))[1].sum()

    seconds = _median_seconds(lambda: play(jax.random.key(0)))
    return {"environments": count, "environment_steps_per_second": round(count * steps / seconds)}


def selection(candidates: int) -> dict[str, Any]:
    """Prediction and task selection for so many candidates, 11 weights, 66 records and 6 tasks."""
    generator = np.random.default_rng(0)
    angles = generator.uniform(0, np.pi / 2, candidates)
    values = np.stack([np.cos(angles), np.sin(angles)], axis=1) * generator.uniform(0.7, 1.0, (candidates, 1))
    weights = simplex_grid(2, 10)
    parents, used = values[generator.integers(candidates, size=66)], weights[generator.integers(11, size=66)]
    children = parents + 0.1 * (used - 0.3) + generator.normal(0, 0.02, parents.shape)
    records = Records.empty(2).add(parents, used, children)

    def select() -> None:
        predictions = predict(values, weights, records).expected
        select_tasks(predictions, values, np.full(2, -0.1), 6, 1.0, np.random.default_rng(0))

    return {"candidates": candidates, "seconds": round(_median_seconds(select), 4)}


def scaling(env: str) -> list[dict[str, Any]]:
    """Return what an agent, and an environment, costs in an iteration as there are more of them.

    The sizes take turns, so that a machine that slows down meanwhile slows all of them.
    """
    sizes = ((6, 4), (24, 4), (96, 4), (6, 64))
    trainings = [_training(env, agents, environments) for agents, environments in sizes]
    rounds = [[_seconds(train) for train in trainings] for _ in range(REPEATS + 1)]
    rows = []
    for (agents, environments), seconds in zip(sizes, np.median(rounds[1:], axis=0) / SCALED_ITERATIONS, strict=True):
        steps = resolve("paper", None, {"env": env}).ppo.rollout_steps * agents * environments
        rows.append(
            {
                "agents": agents,
                "environments": environments,
                "iteration_seconds": round(seconds, 3),
                "milliseconds_per_agent": round(1e3 * seconds / agents, 2),
                "microseconds_per_step": round(1e6 * seconds / steps, 2),
            }
        )
    return rows


def _training(env: str, agents: int, environments: int) -> Callable[[], Any]:
    """Return some training iterations of a whole population, compiled."""
    config = resolve("paper", None, {"env": env}).replace(
        population={"agents": agents}, ppo={"environments": environments}, steps=10**9
    )
    population = Population(envs.make(config.env), config.learning)
    population.compile()
    train_states = population.initialize(jax.random.key(0))
    weights = evenly_spaced_weights(2, agents)
    return lambda: population.train(
        train_states, weights, jax.random.key(1), SCALED_ITERATIONS, config.ppo.learning_rate
    )


def _median_seconds(call: Callable[[], Any]) -> float:
    """Of three calls, after one that is not counted."""
    _seconds(call)
    return statistics.median(_seconds(call) for _ in range(REPEATS))


def _seconds(call: Callable[[], Any]) -> float:
    started = time.perf_counter()
    jax.block_until_ready(call())
    return time.perf_counter() - started


def install_peer() -> None:
    """Make the peer's environment, unless it is whole and newer than its requirements."""
    requirements, installed = HERE / "peer" / "requirements.txt", PEER / ".installed"
    if installed.exists() and installed.stat().st_mtime >= requirements.stat().st_mtime:
        return
    subprocess.run([sys.executable, "-m", "venv", PEER], check=True)
    subprocess.run([PEER_PYTHON, "-m", "pip", "install", "--quiet", "-r", requirements], check=True)
    installed.touch()


def peer(env: str) -> dict[str, Any]:
    """morl-baselines' PGMORL at the paper preset's sizes, now: a short warm-up and one generation."""
    install_peer()
    config = resolve("paper", None, {"env": env})
    sizes = {
        "--env": env,
        "--agents": config.population.agents,
        "--environments": config.ppo.environments,
        "--rollout-steps": config.ppo.rollout_steps,
        "--iterations": config.population.iterations,
        "--steps": config.steps_per_iteration * (config.population.iterations + 1),
        "--discount": config.ppo.discount,
    }
    flags = [str(part) for flag in sizes.items() for part in flag]
    command = [str(PEER_PYTHON), str(HERE / "peer" / "pgmorl.py"), *flags]
    result: dict[str, Any] = json.loads(
        subprocess.run(command, check=True, capture_output=True, encoding="utf-8").stdout
    )
    return result


def _cpu_name() -> str:
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor()


def tables(report: dict[str, Any]) -> list[Table]:
    """Return the report for people."""
    speed = Table("preset", "", "rate or share", "time", title=f"{report['env']}, {report['machine']['device']}")
    for preset, whole in report["runs"].items():
        for row in _run_rows(whole):
            speed.add_row(preset, *row)
        speed.add_section()
    speed.add_row("", "environment alone, 1 device", f"{report['parts']['environment_steps_per_second']:,} steps/s", "")
    for row in report["selection"]:
        speed.add_row("", f"selection, {row['candidates']} candidates", "", f"{row['seconds']:.3f} s")
    if "peer" in report:
        rate = report["peer"]["all_generations"]["steps_per_second"]
        speed.add_row("paper", "morl-baselines, whole generation", f"{rate:,.0f} steps/s", "")
    cost = Table("agents", "environments", "ms per agent", "µs per step", title="One training iteration")
    for row in report["scaling"]:
        fields = ("agents", "environments", "milliseconds_per_agent", "microseconds_per_step")
        cost.add_row(*(str(row[field]) for field in fields))
    return [speed, cost]


def _run_rows(whole: dict[str, Any]) -> list[tuple[str, str, str]]:
    rows = [
        ("whole generation", f"{whole['steps_per_second']:,} steps/s", f"{whole['total_seconds']:.2f} s"),
        ("- training", f"{whole['train_share']:.1%}", f"{whole['train_seconds']:.2f} s"),
        ("- evaluation", f"{whole['evaluate_share']:.1%}", f"{whole['evaluate_seconds']:.3f} s"),
        ("  evaluation alone", f"{whole['evaluation_steps_per_second']:,} steps/s", ""),
        ("- selection", f"{whole['select_share']:.1%}", f"{whole['select_seconds']:.3f} s"),
        ("compilation, once a run", "", f"{whole['compile_seconds']:.1f} s"),
        ("peak memory so far", f"{whole['peak_memory_mib']:,} MiB", ""),
    ]
    if "times_the_peer" in whole:
        rows.append(("times as fast as morl-baselines", f"{whole['times_the_peer']:.1f}", ""))
    return rows


if __name__ == "__main__":
    main()

"""What checkpoints cost, printed and written to `benchmarks/checkpoints.json`.

    python -m benchmarks.checkpoints        (3 minutes)

A checkpoint is written while the next generation trains. What it costs is the processor time that it takes from that:
its share of a generation's processor time, which hardly depends on what else the machine does. `if_waited_percent` is
what it would cost by the clock if training stood still meanwhile, waiting for the disk included: more than it can cost.
The checkpoints measured have as many policies as a whole run evaluates, more than any but the last one can have.
"""

import json
import statistics
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

from rich.table import Table

import envs
from benchmarks.speed import machine
from jmorl.config import Config, resolve
from jmorl.display.console import PlainConsole
from jmorl.events import GenerationFinished
from jmorl.learning.devices import use_all_cpu_cores
from jmorl.loop import make_method, run
from jmorl.report.timeline import Timeline
from jmorl.search.archive import Archive
from jmorl.state import RunState
from jmorl.storage.checkpoints import CheckpointWriter
from jmorl.storage.run_folder import folder_bytes

RESULT = Path(__file__).parent / "checkpoints.json"
GENERATIONS = {"mo-mountaincarcontinuous-v0": 8, "mo-halfcheetah-v5": 3}
REPEATS = 5
BARS = {"mo-mountaincarcontinuous-v0": 8.0, "mo-halfcheetah-v5": 2.0}  # percent of a generation

Times = dict[str, float]


def main() -> None:
    """Measure, print and write."""
    use_all_cpu_cores()
    report = {"machine": machine(), "cost": {env: cost(env, count) for env, count in GENERATIONS.items()}}
    RESULT.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
    PlainConsole().print(table(report["cost"]))


def cost(env: str, generations: int) -> dict[str, Any]:
    """Of a checkpoint against a generation, after a warm-up and a first generation that are not counted."""
    config = resolve(overrides={"env": env})
    policies = config.population.agents * (Timeline(config, since=0.0).generations + 1)
    timed, state = _timed_generations(config, generations)
    with tempfile.TemporaryDirectory() as folder:
        method = make_method(config, envs.make(env))
        writer = CheckpointWriter(Path(folder), "benchmark", keep=1, method=method)
        states = [_grown(state, policies, state.generation + more) for more in range(REPEATS)]
        written = [_timed_checkpoint(writer, each) for each in states]
        writer.close()
        size = folder_bytes(Path(folder))
    generation, checkpoint = _medians(timed), _medians(written)
    percent = {name: round(100 * checkpoint[name] / generation[name], 2) for name in checkpoint}
    return {
        "generation": generation,
        "checkpoint": {**checkpoint, "policies": policies, "megabytes": round(size / 1e6, 2)},
        "percent": percent["processor_seconds"],
        "if_waited_percent": percent["seconds"],
        "bar_percent": BARS[env],
    }


def _timed_generations(config: Config, count: int) -> tuple[list[Times], RunState]:
    """Of a run without checkpoints; and its state after that."""
    timed: list[Times] = []
    started = _clocks()
    for event in run(config):
        if isinstance(event, GenerationFinished):
            if event.state.generation > 1:
                timed.append(_since(started))
            if len(timed) == count:
                return timed, event.state
            started = _clocks()
    raise AssertionError(f"the run has fewer than {count + 1} generations")


def _timed_checkpoint(writer: CheckpointWriter, state: RunState) -> Times:
    started = _clocks()
    writer.save(state, {})
    writer.wait()
    return _since(started)


def _grown(state: RunState, policies: int, generation: int) -> RunState:
    """Return the state with so many policies in archive and buffer."""
    members = state.archive.members
    copies = tuple(replace(members[index % len(members)], id=index) for index in range(policies))
    search = replace(state.search, buffer=replace(state.search.buffer, members=copies))
    return replace(state, archive=Archive(copies), search=search, choice=None, generation=generation)


def _clocks() -> Times:
    return {"seconds": time.perf_counter(), "processor_seconds": time.process_time()}


def _since(started: Times) -> Times:
    return {name: now - started[name] for name, now in _clocks().items()}


def _medians(timed: list[Times]) -> Times:
    return {name: round(statistics.median(each[name] for each in timed), 4) for name in timed[0]}


def table(costs: dict[str, dict[str, Any]]) -> Table:
    """Return the figures, an environment to a row."""
    printed = Table(title="Checkpoints")
    printed.add_column("environment")
    for column in ("generation", "checkpoint", "policies", "MB", "processor time", "if waited for", "bar"):
        printed.add_column(column, justify="right")
    for env, measured in costs.items():
        generation, checkpoint = measured["generation"], measured["checkpoint"]
        printed.add_row(
            env,
            f"{generation['seconds']:.2f} s",
            f"{checkpoint['seconds']:.2f} s",
            str(checkpoint["policies"]),
            f"{checkpoint['megabytes']:.1f}",
            f"{measured['percent']:.1f} %",
            f"{measured['if_waited_percent']:.1f} %",
            f"{measured['bar_percent']:.0f} %",
        )
    return printed


if __name__ == "__main__":
    main()

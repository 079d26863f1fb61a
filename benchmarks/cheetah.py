"""What runs find on HalfCheetah: hypervolume, each user's best utility, and how fast and how cheaply policies run.

    python -m benchmarks.cheetah                                the committed result: all users, methods and seeds
    python -m benchmarks.cheetah --methods pgmorl --seeds 1 --set ppo.environments=32 ppo.rollout_steps=50 --out FILE
                                                                a variant of the preset, as its table has them

For each seed one PGMORL run, judged for every user, and one interactive run for each user. Everything is in raw units:
mean undiscounted returns of deterministic episodes of 1,000 steps, 50 seconds. Reference point (-100, -6000).
"""

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.arms import add_arms, arms
from jmorl.config import Config
from jmorl.decision.utility import USERS
from jmorl.learning.devices import use_all_cpu_cores
from jmorl.run import Compiled, GenerationFinished, run

ENVIRONMENT = "mo-halfcheetah-v5"
STEPS_OF_AN_EPISODE = 1000
RUNNING = 1.0  # m/s: what is slower is not called running
WEIGHTS = np.array(list(USERS.values()))  # [3, 2]
RESULT = Path(__file__).with_name("cheetah.json")


def main() -> None:
    """Run everything that is asked for, print the tables and write the result after every run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_arms(parser, RESULT)
    options = parser.parse_args()
    use_all_cpu_cores()
    rows: list[dict[str, Any]] = []
    for config in arms(options, ENVIRONMENT):
        rows.append(_judged(config))
        print(json.dumps({name: rows[-1][name] for name in ("method", "user", "seed", "utility")}), flush=True)
        report = {"preset": options.preset, "set": options.set, "rows": rows}
        options.out.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
    for table in tables(rows):
        Console().print(table)


def _judged(config: Config) -> dict[str, Any]:
    """One run: what its front is worth at the end, and its curve over the generations."""
    curve: list[dict[str, Any]] = []
    wall = cpu = 0.0
    for event in run(config):
        if isinstance(event, Compiled):
            wall, cpu = time.perf_counter(), time.process_time()
        if isinstance(event, GenerationFinished):
            values = event.state.archive.values
            point = {
                "steps": event.steps,
                "seconds": round(time.perf_counter() - wall, 1),
                "cpu_seconds": round(time.process_time() - cpu, 1),
                "hypervolume": round(event.front.hypervolume),
                "utility": (values @ WEIGHTS.T).max(axis=0).round(1).tolist(),
            }
            curve.append(point)
    speed = values[:, 0] / STEPS_OF_AN_EPISODE
    runners = values[speed >= RUNNING]
    cheapest = runners[np.argmax(runners[:, 1])] if len(runners) else None
    return {
        "method": config.method,
        "user": config.user if config.method == "interactive" else None,
        "seed": config.seed,
        "hypervolume": curve[-1]["hypervolume"],
        "utility": dict(zip(USERS, curve[-1]["utility"], strict=True)),
        "fastest_metres_per_second": round(float(speed.max()), 2),
        "cheapest_runner": None if cheapest is None else cheapest.round(1).tolist(),
        "front": len(values),
        "curve": curve,
    }


def tables(rows: list[dict[str, Any]]) -> list[Table]:
    """The runs one by one, and the means over seeds."""
    heads = ("method", "user", "seed", "hypervolume / 1e6", *(f"U {user}" for user in USERS), "fastest m/s")
    each = Table(*heads, "cheapest above 1 m/s", "front", "seconds", title="Run by run")
    means = Table(*heads[:2], "seeds", *heads[3:], "seconds", title="Means over the seeds")
    arms = sorted({(row["method"], row["user"] or "") for row in rows})
    for method, user in arms:
        arm = [row for row in rows if (row["method"], row["user"] or "") == (method, user)]
        for row in arm:
            cheapest = "none" if row["cheapest_runner"] is None else "({:.0f}, {:.0f})".format(*row["cheapest_runner"])
            each.add_row(method, user, str(row["seed"]), *_figures([row]), cheapest, str(row["front"]), _seconds([row]))
        means.add_row(method, user, str(len(arm)), *_figures(arm), _seconds(arm))
    return [each, means]


def _figures(arm: list[dict[str, Any]]) -> list[str]:
    return [
        f"{np.mean([row['hypervolume'] for row in arm]) / 1e6:.2f}",
        *(f"{np.mean([row['utility'][user] for row in arm]):.0f}" for user in USERS),
        f"{np.mean([row['fastest_metres_per_second'] for row in arm]):.2f}",
    ]


def _seconds(arm: list[dict[str, Any]]) -> str:
    return f"{np.mean([row['curve'][-1]['seconds'] for row in arm]):.0f}"


if __name__ == "__main__":
    main()

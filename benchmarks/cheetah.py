"""What runs find on HalfCheetah: hypervolume, each user's best utility, and how fast and how cheaply policies run.

    python -m benchmarks.cheetah                                the committed result: all users, methods and seeds
    python -m benchmarks.cheetah --methods pgmorl --seeds 1 --set ppo.environments=32 ppo.rollout_steps=50 --out FILE
                                                                a variant of the preset, as its table has them

For each seed one PGMORL run, judged for every user, and one interactive run for each user. Everything is in raw units:
mean undiscounted returns of deterministic episodes of 1,000 steps, 50 seconds. Reference point (-100, -6000). Runs are
made as those of `jmorl paper`, and those that it has made already are not made again.
"""

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

from benchmarks.arms import add_arms, arms
from jmorl.config import Config
from jmorl.decision.utility import USERS
from jmorl.display.console import PlainConsole
from jmorl.experiments.cells import Cell, Places, missing
from jmorl.experiments.record import RunRecord, read_record
from jmorl.experiments.runner import make
from jmorl.learning.devices import use_all_cpu_cores
from jmorl.paper.analysis import generations_within, greatest_utility
from jmorl.paper.plan import CHEETAH, ITEMS, USER_STEPS, Plan
from jmorl.search.pareto import hypervolume

STEPS_OF_AN_EPISODE = 1000
RUNNING = 1.0  # m/s: what is slower is not called running
RESULT = Path(__file__).with_name("cheetah.json")
PAPER = Places(Path(__file__).with_name("paper") / "records", Path("runs/paper"))
VARIANTS = Places(Path("runs/cheetah/records"), Path("runs/cheetah/work"))


def main() -> None:
    """Run everything that is asked for, print the tables and write the result after every run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_arms(parser, RESULT)
    options = parser.parse_args()
    use_all_cpu_cores()
    rows: list[dict[str, Any]] = []
    for config in arms(options, CHEETAH):
        rows.append(_judged(_record(config)))
        print(json.dumps({name: rows[-1][name] for name in ("method", "user", "seed", "utility")}), flush=True)
        report = {"preset": options.preset, "set": options.set, "rows": rows}
        options.out.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
    for table in tables(rows):
        PlainConsole().print(table)


def _record(config: Config) -> RunRecord:
    """Return the run with this config: the paper's, if it is one of them."""
    plan, item = Plan(), ITEMS["fig7"]
    if config.method == "pgmorl":
        paper = plan.pgmorl(item, "raw", config.seed)
    else:
        paper = plan.interactive(item, "raw", config.user, config.seed)
    same = {"steps": paper.config.steps, "checkpoints": paper.config.checkpoints.model_dump()}
    if config.replace(**same).identity() == paper.config.identity():
        cell, places = paper, PAPER
    else:
        cell, places = Cell(config.identity(), config), VARIANTS
    return make([cell], places, lambda *_: None)[0] if missing([cell], places) else read_record(places.record(cell))


def _judged(record: RunRecord) -> dict[str, Any]:
    """Return what a run's front is worth after so many steps, and its curve over the generations."""
    steps = USER_STEPS[CHEETAH]
    utilities = [greatest_utility(record, weights, steps).round(1).tolist() for weights in USERS.values()]
    reference = np.array(record.config["reference_point"])
    curve: list[dict[str, Any]] = []
    for number in range(generations_within(record, steps)):
        values = record.values[list(record.generations[number].front)]
        point = {
            "steps": record.generations[number].steps,
            "hypervolume": round(hypervolume(values, reference)),
            "utility": [curve_of_user[number] for curve_of_user in utilities],
        }
        curve.append(point)
    speed = values[:, 0] / STEPS_OF_AN_EPISODE
    runners = values[speed >= RUNNING]
    cheapest = runners[np.argmax(runners[:, 1])] if len(runners) else None
    interactive = record.config["method"] == "interactive"
    return {
        "method": record.config["method"],
        "user": record.config["user"] if interactive else None,
        "seed": record.config["seed"],
        "hypervolume": curve[-1]["hypervolume"],
        "utility": dict(zip(USERS, curve[-1]["utility"], strict=True)),
        "fastest_metres_per_second": round(float(speed.max()), 2),
        "cheapest_runner": None if cheapest is None else cheapest.round(1).tolist(),
        "front": len(values),
        "curve": curve,
    }


def tables(rows: list[dict[str, Any]]) -> list[Table]:
    """Return the runs one by one, and the means over seeds."""
    heads = ("method", "user", "seed", "hypervolume / 1e6", *(f"U {user}" for user in USERS), "fastest m/s")
    each = Table(*heads, "cheapest above 1 m/s", "front", title="Run by run")
    means = Table(*heads[:2], "seeds", *heads[3:], title="Means over the seeds")
    arms = sorted({(row["method"], row["user"] or "") for row in rows})
    for method, user in arms:
        arm = [row for row in rows if (row["method"], row["user"] or "") == (method, user)]
        for row in arm:
            cheapest = "none" if row["cheapest_runner"] is None else "({:.0f}, {:.0f})".format(*row["cheapest_runner"])
            each.add_row(method, user, str(row["seed"]), *_figures([row]), cheapest, str(row["front"]))
        means.add_row(method, user, str(len(arm)), *_figures(arm))
    return [each, means]


def _figures(arm: list[dict[str, Any]]) -> list[str]:
    return [
        f"{np.mean([row['hypervolume'] for row in arm]) / 1e6:.2f}",
        *(f"{np.mean([row['utility'][user] for row in arm]):.0f}" for user in USERS),
        f"{np.mean([row['fastest_metres_per_second'] for row in arm]):.2f}",
    ]


if __name__ == "__main__":
    main()

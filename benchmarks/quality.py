"""How good the policies are that a run finds on MountainCar, against the exact front from the same starts.

    python -m benchmarks.quality                              the committed result: all users, methods and seeds
    python -m benchmarks.quality --seeds 1 --set ppo.discount=0.99 --out FILE      one seed of a variant

For each seed one PGMORL run, judged for every user, and one interactive run for each user. A shortfall is how far
a utility lies below the exact front's, in per cent of the latter; both are means of undiscounted returns over the
same start positions: the run's own evaluation starts, and for the chosen policy 100 fresh ones.
"""

import argparse
import functools
import json
import sys
from pathlib import Path
from typing import Any

import jax
import numpy as np
from rich.progress import track
from rich.table import Table

import envs
from benchmarks.arms import add_arms, arms
from benchmarks.exact_front import exact_front
from jmorl.config import Config
from jmorl.decision.utility import USERS
from jmorl.display.console import PlainConsole
from jmorl.events import GenerationFinished, RunFinished
from jmorl.learning.devices import use_all_cpu_cores
from jmorl.learning.moppo import MOPPO
from jmorl.loop import evaluation_keys, run
from jmorl.search.policy import Policy, values_of

ENVIRONMENT = "mo-mountaincarcontinuous-v0"
FRESH_EPISODES, FRESH_SEED = 100, 12345
CLOSE = 5.0  # per cent: steps are counted until the best utility is this close
WEIGHTS = np.array(list(USERS.values()))  # [3, 2]
RESULT = Path(__file__).with_name("quality.json")


def main() -> None:
    """Run everything that is asked for, print the table and write the result."""
    options = _options()
    use_all_cpu_cores()
    configs = list(arms(options, ENVIRONMENT))
    rows: list[dict[str, Any]] = []
    for config in track(configs, console=PlainConsole(stderr=True), disable=not sys.stderr.isatty()):
        rows += _judged(config, options.users if config.method == "pgmorl" else [config.user])
        if options.verbose:
            print(json.dumps(rows[-1]), flush=True)
        report = {"preset": options.preset, "set": options.set, "rows": rows}  # after every run: none is lost
        options.out.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
    PlainConsole().print(_table(rows))
    PlainConsole().print(_summary(rows))


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_arms(parser, RESULT)
    parser.add_argument("--verbose", action="store_true", help="print a line after each run")
    return parser.parse_args()


def _judged(config: Config, users: list[str]) -> list[dict[str, Any]]:
    """One run, as a row for each of the users who judge it."""
    steps, best, seconds = [], [], 0.0
    for event in run(config):
        match event:
            case GenerationFinished():
                steps.append(event.steps)
                best.append((event.state.archive.values @ WEIGHTS.T).max(axis=0))
                seconds += event.seconds.total
            case RunFinished():
                finished = event
    exact = _exact(evaluation_keys(config))
    shortfall = 100 * (exact - np.array(best)) / np.abs(exact)  # [G + 1, 3]
    rows = []
    for user in users:
        column = list(USERS).index(user)
        close = np.flatnonzero(shortfall[:, column] <= CLOSE)
        front = finished.state.archive.members
        chosen = finished.chosen if config.method == "interactive" else _best(front, column)
        rows.append(
            {
                "user": user,
                "method": config.method,
                "seed": config.seed,
                "shortfall_percent": round(float(shortfall[-1, column]), 3),
                "fresh_shortfall_percent": round(_fresh_shortfall(config, chosen, column), 3),
                "steps_until_close": steps[close[0]] if len(close) else None,
                "steps": steps[-1],
                "seconds": round(seconds, 1),
                "chosen": chosen.values.round(2).tolist(),
            }
        )
    return rows


def _best(front: tuple[Policy, ...], column: int) -> Policy:
    return front[int(np.argmax(values_of(front) @ WEIGHTS[column]))]


def _exact(keys: jax.Array) -> np.ndarray:
    """Return the exact front's utility for each user, [3], from the starts of these keys."""
    return _exact_from(tuple(jax.vmap(envs.make(ENVIRONMENT).initial_state)(keys).position.tolist()))


@functools.cache
def _exact_from(positions: tuple[float, ...]) -> np.ndarray:
    return (exact_front(WEIGHTS, np.array(positions)) * WEIGHTS).sum(axis=1)


def _fresh_shortfall(config: Config, chosen: Policy, column: int) -> float:
    """Return the chosen policy's shortfall on fresh episodes."""
    keys = jax.random.split(jax.random.key(FRESH_SEED), FRESH_EPISODES)
    moppo = MOPPO(envs.make(ENVIRONMENT), config.ppo)
    returns = jax.jit(moppo.evaluate)(chosen.snapshot, keys)
    exact = _exact(keys)[column]
    utility = np.asarray(returns.undiscounted, np.float64).mean(axis=0) @ WEIGHTS[column]
    return float(100 * (exact - utility) / abs(exact))


def _table(rows: list[dict[str, Any]]) -> Table:
    table = Table(title="Shortfall against the exact front, seed by seed")
    for column in ("user", "method", "seed", "shortfall %", "fresh episodes %", "steps to 5 %", "chosen (time, fuel)"):
        table.add_column(column, justify="left" if column in ("user", "method") else "right")
    for row in sorted(rows, key=lambda row: (row["user"], row["method"], row["seed"])):
        table.add_row(
            row["user"],
            row["method"],
            str(row["seed"]),
            f"{row['shortfall_percent']:.2f}",
            f"{row['fresh_shortfall_percent']:.2f}",
            "never" if row["steps_until_close"] is None else f"{row['steps_until_close']:,}",
            f"({row['chosen'][0]:.1f}, {row['chosen'][1]:.1f})",
        )
    return table


def _summary(rows: list[dict[str, Any]]) -> Table:
    """Means over the seeds; a run that never came close counts with all its steps, marked by >=."""
    table = Table(title="Means over seeds")
    for column in (
        "user",
        "method",
        "shortfall %",
        "worst seed %",
        "fresh episodes %",
        "steps to 5 %",
        "seconds a run",
    ):
        table.add_column(column, justify="left" if column in ("user", "method") else "right")
    for user, method in sorted({(row["user"], row["method"]) for row in rows}):
        arm = [row for row in rows if (row["user"], row["method"]) == (user, method)]
        shortfalls = np.array([row["shortfall_percent"] for row in arm])
        fresh = np.mean([row["fresh_shortfall_percent"] for row in arm])
        steps = np.mean([row["steps_until_close"] or row["steps"] for row in arm])
        censored = ">= " if any(row["steps_until_close"] is None for row in arm) else ""
        table.add_row(
            user,
            method,
            f"{shortfalls.mean():.2f}",
            f"{shortfalls.max():.2f}",
            f"{fresh:.2f}",
            f"{censored}{steps:,.0f}",
            f"{np.mean([row['seconds'] for row in arm]):.0f}",
        )
    return table


if __name__ == "__main__":
    main()

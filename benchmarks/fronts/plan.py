"""Which runs are made, and what is published on their tasks."""

import json
from dataclasses import dataclass
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

import envs
from jmorl.config import resolve
from jmorl.experiments.cells import Cell

# Environment -> the name of its task where it is published. Budgets and all other settings are the default preset's.
TASKS = {
    "pgmorl-halfcheetah-v2": "MO-HalfCheetah-v2",
    "pgmorl-walker2d-v2": "MO-Walker2d-v2",
    "pgmorl-hopper-v2": "MO-Hopper-v2",
    "pgmorl-hopper-v3": "MO-Hopper-v3",
}
METHODS = ("PGMORL", "interactive")
SEEDS = (1, 7, 10, 42, 100)  # settings were chosen on others
PUBLISHED = Path(__file__).with_name("published.json")


def cells(env: str) -> list[Cell]:
    """Return the runs on a task, seed by seed."""
    return [cell(env, method, seed) for seed, method in product(SEEDS, METHODS)]


def cell(env: str, method: str, seed: int) -> Cell:
    """Return a run. The user of the interactive method weighs all objectives alike."""
    user = f"weights={','.join('1' for _ in envs.make(env).objectives)}"
    given: dict[str, Any] = {"env": env, "method": method.lower(), "user": user, "seed": seed}
    if method == "PGMORL":  # nobody is asked, so that what concerns the person plays no part
        given["evaluation"] = {"confirmation_episodes": 0}
    return Cell(f"{env}-{method}-seed_{seed}", resolve(overrides=given | {"checkpoints": {"keep": 2}}))


@dataclass(frozen=True)
class Published:
    """What is published on a task: of hypernetwork MORL, over its seeds."""

    steps: float
    seconds: float
    seeds: int
    hypervolume: float
    hypervolume_sd: float
    expected_utility: float | None
    front: np.ndarray | None  # [N, M] of one seed


@cache
def published(env: str) -> Published:
    """Return what is published on an environment's task."""
    found = json.loads(PUBLISHED.read_text(encoding="utf-8"))
    name = TASKS[env]
    results = found["hypernetwork"][name]
    front = results.get("front_seed0")
    utility = found["expected_utility_101_weights"].get(name, [None])[0]
    return Published(
        found["steps"][name],
        results["seconds_mean"],
        results["seeds"],
        results["hv_mean"],
        results["hv_sd"],
        utility,
        None if front is None else np.array(front),
    )

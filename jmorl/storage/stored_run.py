"""Reading a run folder back: what tables, plots and later decisions are made from."""

import csv
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import envs
from envs.core import Objective
from jmorl.config import Config, ConfigError, resolve
from jmorl.decision.records import Record, ScriptError, read_log
from jmorl.search.policy import Policy
from jmorl.storage.manifest import read_manifest
from jmorl.storage.versions import NewerFormat
from jmorl.units import measured_in


class StoredRunError(ValueError):
    """A folder that is no run, or one that cannot be read."""


@dataclass(frozen=True)
class StoredRun:
    """A run as its folder tells it. Policies have no snapshot."""

    path: Path
    config: Config
    manifest: Mapping[str, Any]
    objectives: tuple[Objective, ...]
    metrics: Mapping[str, np.ndarray]  # column -> [G + 1], NaN where empty
    policies: tuple[Policy, ...]  # all evaluated, by id
    front: tuple[Policy, ...]  # at least one
    decisions: tuple[Record, ...]
    result: Mapping[str, Any] | None  # None for a run that has not ended

    @property
    def chosen(self) -> Policy | None:
        """The run's result; None for a run that has not ended."""
        return self.policies[self.result["chosen"]["policy"]] if self.result else None

    @property
    def bounds(self) -> np.ndarray:
        """The bounds in each generation [G + 1, M], -inf where there were none."""
        columns = [self.metrics[f"bound_{objective.name}"] for objective in self.objectives]
        return np.nan_to_num(np.stack(columns, axis=1), nan=-np.inf)


def read_run(path: Path) -> StoredRun:
    """Read a run folder. Raises StoredRunError, naming the file, if there is none or it cannot be read; and
    NewerFormat.
    """
    try:
        manifest = read_manifest(path)
        config = resolve(file=path / "config.toml")
        objectives = measured_in(config.evaluation.units, envs.make(config.env).objectives)
        policies = tuple(_policy(row, objectives) for row in _rows(path / "policies.csv"))
        result = path / "result.json"
        log = path / "decisions.jsonl"
        return StoredRun(
            path,
            config,
            manifest,
            objectives,
            _columns(_rows(path / "metrics.csv")),
            policies,
            tuple(policies[int(row["policy"])] for row in _rows(path / "front.csv")),
            tuple(read_log(log)) if log.exists() else (),
            json.loads(result.read_text(encoding="utf-8")) if result.exists() else None,
        )
    except NewerFormat:
        raise
    except FileNotFoundError as error:
        raise StoredRunError(f"{path} is not a run folder, or its run ended in the warm-up: {error}") from error
    except (OSError, KeyError, IndexError, TypeError, ValueError, ConfigError, ScriptError) as error:
        raise StoredRunError(f"{path} cannot be read as a run: {error}") from error


def _rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    for number, row in enumerate(rows, start=2):
        if None in row.values():
            raise ValueError(f"{path}, line {number} ends too early")
    return rows


def _columns(rows: list[dict[str, str]]) -> dict[str, np.ndarray]:
    return {name: np.array([_number(row[name]) for row in rows]) for name in rows[0]}


def _number(cell: str) -> float:
    return float(cell) if cell else np.nan


def _policy(row: Mapping[str, str], objectives: tuple[Objective, ...]) -> Policy:
    def vector(prefix: str) -> np.ndarray:
        return np.array([_number(row[f"{prefix}_{objective.name}"]) for objective in objectives])

    def vector_or_none(prefix: str) -> np.ndarray | None:
        return None if np.isnan(vector(prefix)).any() else vector(prefix)

    return Policy(
        id=int(row["policy"]),
        generation=int(row["generation"]),
        parent=int(row["parent"]) if row["parent"] else None,
        weights=vector("weight"),
        values=vector("value"),
        std=vector("std"),
        discounted=vector("discounted"),
        snapshot=None,
        predicted=vector_or_none("predicted"),
        raw=vector_or_none("raw"),
    )

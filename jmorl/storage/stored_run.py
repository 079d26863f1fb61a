"""Reading a run folder back: what tables, plots and later decisions are made from."""

from collections import defaultdict
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import TypeAdapter
from typing_extensions import TypedDict

import envs
from envs.core import Objective
from jmorl.config import Config, ConfigError, resolve
from jmorl.decision.records import DecisionRecord, Record, ScriptError, read_log
from jmorl.search.policy import Blend, Confirmation, Policy
from jmorl.storage.csv_log import read_rows
from jmorl.storage.documents import check_fields, json_object
from jmorl.storage.families_file import Families, read_families
from jmorl.storage.layout import Layout
from jmorl.storage.manifest import check_config, read_manifest
from jmorl.storage.notes_file import Notes, read_notes
from jmorl.storage.versions import NewerFormat
from jmorl.units import measured_in


class StoredRunError(ValueError):
    """A folder that is no run, or one that cannot be read."""


class _Chosen(TypedDict):
    policy: int


class _Result(TypedDict):
    """What is relied on of a result; there is more."""

    reason: Literal["budget", "satisfied", "stopped"]
    chosen: _Chosen


_RESULT = TypeAdapter(_Result)
NUMBERS = ("steps", "evaluation_steps", "select_seconds", "train_seconds", "evaluate_seconds")  # no run is without


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
    families: Families | None = None  # of the front that was blended last; None if none was
    notes: Notes = Notes()  # that somebody has given to it and its policies

    @property
    def chosen(self) -> Policy | None:
        """The run's result, with its confirmed score if it has one; None for a run that has not ended."""
        if not self.result:
            return None
        row = self.result["chosen"]
        return _as_confirmed(self.policies[row["policy"]], row, self.objectives)

    @property
    def below_reference(self) -> int:
        """How many members of the last front the hypervolume leaves out; 0 for runs of versions that do not say."""
        counts = self.metrics.get("below_reference")
        return 0 if counts is None or np.isnan(counts[-1]) else int(counts[-1])

    @property
    def bounds(self) -> np.ndarray:
        """The bounds in each generation [G + 1, M], -inf where there were none."""
        columns = [self.metrics[f"bound_{objective.name}"] for objective in self.objectives]
        return np.nan_to_num(np.stack(columns, axis=1), nan=-np.inf)


@dataclass(frozen=True, eq=False)
class StoredFront:
    """The front of a run as its folder tells it, and what the run ended on."""

    ids: tuple[int, ...]
    values: np.ndarray  # [N, M]
    result: tuple[int, np.ndarray] | None  # id and values [M], confirmed where the run did so; None before its end


def read_run(path: Path | str) -> StoredRun:
    """Read a run folder. Raises NewerFormat, and StoredRunError, naming the file, for none or a damaged one."""
    path = Path(path)
    layout = Layout(path)
    if not layout.manifest.exists() or not layout.metrics.exists():
        why = "is not a run folder, or its run ended in the warm-up" if path.exists() else "does not exist"
        raise StoredRunError(f"{path} {why}")
    with _reading(layout.root, " as a run"):
        manifest = read_manifest(path)
        config = resolve(file=layout.config)
        check_config(path, manifest, config)
        objectives = measured_in(config.evaluation.units, envs.make(config.env).objectives)
        decisions = tuple(read_log(layout.decisions)) if layout.decisions.exists() else ()
        result = read_result(layout.result) if layout.result.exists() else None
        families = read_families(layout.families) if layout.families.exists() else None
    with _reading(layout.metrics):
        metrics = _metrics(read_rows(layout.metrics))
    with _reading(layout.policies):
        policies = _policies(read_rows(layout.policies), objectives)
    with _reading(layout.front):
        by_id = {policy.id: policy for policy in policies}
        front = tuple(by_id[_whole_number(row["policy"])] for row in read_rows(layout.front))
    generations = len(metrics["generation"])
    decisions = tuple(record for record in decisions if record.generation <= generations)
    notes = read_notes(path)
    run = StoredRun(path, config, manifest, objectives, metrics, policies, front, decisions, result, families, notes)
    _check_together(run)
    with _reading(layout.result):
        _ = run.chosen  # its confirmed score can be read
    return run


def read_front(path: Path, objectives: tuple[Objective, ...]) -> StoredFront:
    """Read the present front of a run, and its result, without the rest. Raises StoredRunError, naming the file."""
    layout = Layout(path)
    names = [f"value_{objective.name}" for objective in objectives]
    with _reading(layout.front):
        rows = read_rows(layout.front)
        ids = tuple(_whole_number(row["policy"]) for row in rows)
        values = np.array([[float(row[name]) for name in names] for row in rows]).reshape(-1, len(names))
    result = None
    with _reading(layout.result):
        if layout.result.exists():
            row = read_result(layout.result)["chosen"]
            result = row["policy"], np.array([row[name] for name in names], float)
    return StoredFront(ids, values, result)


@contextmanager
def _reading(path: Path, kind: str = "") -> Iterator[None]:
    """Turn what goes wrong in reading a file, or a folder of some kind, into StoredRunError that names it."""
    try:
        yield
    except NewerFormat:
        raise
    except KeyError as error:
        raise StoredRunError(f"{path} cannot be read{kind}: it has no {error}") from error
    except OSError as error:
        raise StoredRunError(f"{path} cannot be read{kind}: {error.strerror}: {error.filename}") from error
    except ConfigError as error:
        raise StoredRunError(f"{Layout(path).config} cannot be used: {'; '.join(error.problems)}") from error
    except (ValueError, TypeError, IndexError, ScriptError) as error:
        named = str(error).startswith(f"{path},")
        raise StoredRunError(str(error) if named else f"{path} cannot be read{kind}: {error}") from error


def read_result(path: Path) -> Mapping[str, Any]:
    """Read the result of a run. Raises OSError, and DocumentError for one that is damaged."""
    result = json_object(path.read_bytes(), str(path))
    check_fields(result, _RESULT, str(path))
    return result


def _metrics(rows: list[dict[str, str]]) -> Mapping[str, np.ndarray]:
    """Return the columns [G + 1]; one that the version of the run did not write is NaN."""
    columns = {name: np.array([_number(row[name]) for row in rows]) for name in (rows[0] if rows else ())}
    if not np.array_equal(columns.get("generation", np.array([])), np.arange(max(len(rows), 1))):
        raise ValueError("its generations are not 0, 1, 2 and so on")
    if not all(np.isfinite(columns[name]).all() for name in NUMBERS):
        raise ValueError(f"numbers are missing from one of the columns {', '.join(NUMBERS)}")
    return defaultdict(lambda: np.full(len(rows), np.nan), columns)


def _policies(rows: list[dict[str, str]], objectives: tuple[Objective, ...]) -> tuple[Policy, ...]:
    policies = tuple(_policy(row, objectives) for row in rows)
    if not policies or [policy.id for policy in policies] != list(range(len(policies))):
        raise ValueError("its policies are not 0, 1, 2 and so on")
    return policies


def _check_together(run: StoredRun) -> None:
    """Raise StoredRunError if a file speaks of what another does not have."""
    layout = Layout(run.path)
    known, generations, objectives = len(run.policies), len(run.metrics["generation"]), len(run.objectives)
    if not run.front:
        raise StoredRunError(f"{layout.front} has no policy")
    # A run that was killed may have noted the policies of a generation, but not yet the generation; one that has ended
    # may have been killed while its front was blended.
    trained = [policy.generation for policy in run.policies if policy.blend is None or not run.result]
    if max(trained) > generations - bool(run.result):
        raise StoredRunError(f"{layout.metrics} ends before {layout.policies}")
    if run.result and not 0 <= run.result["chosen"]["policy"] < known:
        raise StoredRunError(f"{layout.result} names a policy that {layout.policies} does not have")
    if run.families:
        mentioned = {end for link in run.families.links for end in link.ends}
        if not mentioned <= set(range(known)) or any(len(link.values) != objectives for link in run.families.links):
            raise StoredRunError(f"{layout.families} speaks of what {layout.policies} does not have")
    for record in run.decisions:
        values = [shown.values for shown in record.shown]
        if isinstance(record, DecisionRecord):
            values.append(record.values)
            if not 0 <= record.policy < known:
                raise StoredRunError(f"{layout.decisions} names a policy that {layout.policies} does not have")
        if any(len(each) != objectives for each in values):
            raise StoredRunError(f"{layout.decisions} has values that are not one for each of {objectives} objectives")


def _number(cell: str) -> float:
    """Return the number of a cell; NaN for an empty one, and for infinity, of which nothing can be drawn."""
    number = float(cell) if cell else np.nan
    return number if np.isfinite(number) else np.nan


def _as_confirmed(policy: Policy, row: Mapping[str, Any], objectives: tuple[Objective, ...]) -> Policy:
    """Return the policy as the row of a result has it: with confirmed values, where there are some."""
    if "confirmation_episodes" not in row:
        return policy
    value, std, error, claimed, claimed_std = (
        np.array([row[f"{prefix}_{objective.name}"] for objective in objectives], float)
        for prefix in ("value", "std", "error", "claimed", "claimed_std")
    )
    confirmation = Confirmation(claimed, claimed_std, row["confirmation_episodes"], error)
    return replace(policy, values=value, std=std, confirmation=confirmation)


def _whole_number(cell: str) -> int:
    if not cell.isdecimal():
        raise ValueError(f"{cell!r} is not a whole number")
    return int(cell)


def _blend(cell: str) -> Blend | None:
    """Return the blend that a cell tells of, as `12:0.4 15:0.6`; None for an empty one."""
    pairs = [part.partition(":") for part in cell.split()]
    parents, shares = tuple(_whole_number(parent) for parent, _, _ in pairs), tuple(float(share) for *_, share in pairs)
    return Blend(parents, shares) if pairs else None


def _policy(row: Mapping[str, str], objectives: tuple[Objective, ...]) -> Policy:
    """Return the policy of a row; what the version of the run did not write is NaN, or None."""

    def needed(prefix: str) -> np.ndarray:
        vector = np.array([float(row[f"{prefix}_{objective.name}"]) for objective in objectives])
        if not np.isfinite(vector).all():
            raise ValueError(f"the {prefix} of policy {row['policy']} is not finite")
        return vector

    def vector(prefix: str) -> np.ndarray:
        return np.array([_number(row.get(f"{prefix}_{objective.name}", "")) for objective in objectives])

    def vector_or_none(prefix: str) -> np.ndarray | None:
        return None if np.isnan(vector(prefix)).any() else vector(prefix)

    return Policy(
        id=_whole_number(row["policy"]),
        generation=_whole_number(row["generation"]),
        parent=_whole_number(row["parent"]) if row["parent"] else None,
        weights=needed("weight"),
        values=needed("value"),
        std=vector("std"),
        discounted=vector("discounted"),
        snapshot=None,
        predicted=vector_or_none("predicted"),
        interval=None if vector_or_none("low") is None else np.stack([vector("low"), vector("high")]),
        raw=vector_or_none("raw"),
        blend=_blend(row.get("blend", "")),
    )

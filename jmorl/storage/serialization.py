"""The state of a run as a few arrays and one JSON document, and back.

A state holds hundreds of policies with dozens of small arrays each, and every file or array costs more than its
bytes. So each kind of number of all policies becomes one array, a row for each policy; what its columns are is in the
document.
Letters: N policies, M objectives, R records, F numbers of one kind in a snapshot.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any

import jax
import numpy as np

from envs.core import Environment
from jmorl.config import Config
from jmorl.learning.execution import own_settings
from jmorl.learning.moppo import MOPPO
from jmorl.loop import make_method
from jmorl.methods.base import Method, MethodError, PackedSearch
from jmorl.search.archive import Archive
from jmorl.search.policy import Blend, Confirmation, Policy
from jmorl.state import RunState
from jmorl.units import RunningUnits

COUNTERS = tuple(field.name for field in fields(RunState) if field.type is int)
VECTORS = ("weights", "values", "std", "discounted")  # of a policy, [M]
SEARCH = "search_"  # before the names of the method's own arrays


class PackingError(ValueError):
    """A packed state that does not fit the run it is unpacked for."""


@dataclass(frozen=True)
class PackedState:
    """What a checkpoint keeps of a `RunState`."""

    document: Mapping[str, Any]  # counters, who is where, and what the columns of the snapshots are
    arrays: Mapping[str, np.ndarray]


def pack(state: RunState, method: Method[Any]) -> PackedState:
    """Return the whole state, after the warm-up or later. Every policy that it mentions is kept once."""
    assert state.reference_point is not None, "the warm-up sets it"
    search = method.pack(state.search)
    if not isinstance(search, PackedSearch):
        raise MethodError(f"pack must return a jmorl.PackedSearch, not {search!r}")
    choice = (state.choice,) if state.choice else ()
    known = {policy.id: policy for policy in (*state.archive.members, *search.policies, *choice)}
    policies = [known[each] for each in sorted(known)]
    document = {
        "counters": {name: int(getattr(state, name)) for name in COUNTERS},
        "policies": [
            {"id": p.id, "generation": p.generation, "parent": p.parent, "predicted": p.predicted is not None}
            | _packed_blend(p)
            for p in policies
        ],
        "archive": [policy.id for policy in state.archive.members],
        "choice": state.choice.id if state.choice else None,
        "search": search.document,
        "snapshot": _columns(policies[0].snapshot),
    }
    vectors = {name: np.stack([getattr(policy, name) for policy in policies]) for name in VECTORS}
    nothing = np.full_like(policies[0].values, np.nan)
    arrays = {
        **vectors,
        "predicted": np.stack([nothing if p.predicted is None else p.predicted for p in policies]),
        "interval": np.stack([np.stack([nothing, nothing]) if p.interval is None else p.interval for p in policies]),
        "reference_point": state.reference_point,
        **_packed_units(state.units, policies),
        **{f"{SEARCH}{name}": array for name, array in search.arrays.items()},
        **_packed([policy.snapshot for policy in policies]),
    }
    return PackedState(document, arrays)


def unpack(packed: PackedState, config: Config, environment: Environment[Any]) -> RunState:
    """Return the state as it was, bit for bit.

    Raises PackingError if its snapshots are not those of the train states that `config` describes.
    """
    document, arrays = packed.document, packed.arrays
    with own_settings():
        key = jax.eval_shape(jax.random.key, 0)
        train_state = jax.eval_shape(MOPPO(environment, config.ppo).initial_train_state, key)
    expected = _columns(train_state)
    if document["snapshot"] != expected:
        raise PackingError(f"it has train states of another shape: {_first_difference(document['snapshot'], expected)}")
    snapshots = _unpacked(arrays, len(document["policies"]), train_state)
    policies = {
        origin["id"]: Policy(
            id=origin["id"],
            generation=origin["generation"],
            parent=origin["parent"],
            **{name: arrays[name][row].copy() for name in VECTORS},
            snapshot=snapshots[row],
            predicted=arrays["predicted"][row].copy() if origin["predicted"] else None,
            interval=_interval(arrays, row),
            raw=arrays["raw"][row].copy() if "raw" in arrays else None,
            **_unpacked_blend(origin),
        )
        for row, origin in enumerate(document["policies"])
    }
    choice = document["choice"]
    own = {name.removeprefix(SEARCH): array for name, array in arrays.items() if name.startswith(SEARCH)}
    return RunState(
        search=make_method(config, environment).unpack(document["search"], own, policies),
        archive=Archive(tuple(policies[each] for each in document["archive"])),
        units=RunningUnits(*arrays["units"]) if "units" in arrays else None,
        reference_point=arrays["reference_point"],
        choice=None if choice is None else policies[choice],
        **document["counters"],
    )


def _packed_blend(policy: Policy) -> dict[str, Any]:
    """Return what only a blend has: of which policies it is, and where its score comes from. Nothing for others."""
    if policy.blend is None or policy.confirmation is None:
        return {}
    return {"blend": asdict(policy.blend), "confirmation": jax.tree.map(_as_json, vars(policy.confirmation))}


def _unpacked_blend(origin: Mapping[str, Any]) -> dict[str, Any]:
    if "blend" not in origin:
        return {}
    blend = Blend(*(tuple(origin["blend"][name]) for name in ("parents", "coefficients")))
    found = origin["confirmation"]
    scores = {name: np.array(found[name]) for name in ("claimed", "claimed_std", "error")}
    return {"blend": blend, "confirmation": Confirmation(episodes=found["episodes"], **scores)}


def _as_json(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else value


def _interval(arrays: Mapping[str, np.ndarray], row: int) -> np.ndarray | None:
    """Return the interval of a policy's prediction; None without one, and in states of versions that had none."""
    interval = arrays["interval"][row].copy() if "interval" in arrays else None
    return None if interval is None or np.isnan(interval).any() else interval


def from_format_1(packed: PackedState) -> PackedState:
    """Return a state as packed by the first version, which knew one search only, in the present form."""
    document, arrays = dict(packed.document), dict(packed.arrays)
    counters = dict(document["counters"])
    document["search"] = {
        "buffer": document.pop("buffer"),
        "silent_generations": counters.pop("silent_generations"),
    }
    document["counters"] = counters
    arrays["std"] = arrays.pop("spread")
    own = [name for name in arrays if name == "bounds" or name.startswith("records_")]
    arrays |= {f"{SEARCH}{name}": arrays.pop(name) for name in own}
    return PackedState(document, arrays)


def _packed_units(units: RunningUnits | None, policies: Sequence[Policy]) -> dict[str, np.ndarray]:
    """Nothing in raw units, where policies have no raw values beside their scores."""
    if units is None:
        return {}
    raw = [policy.raw for policy in policies if policy.raw is not None]  # all of them
    return {"units": np.stack(list(vars(units).values())), "raw": np.stack(raw)}


def _columns(snapshot: Any) -> list[list[Any]]:
    """Name, kind and shape of every array in a snapshot, in the order of its tree."""
    leaves, _ = jax.tree_util.tree_flatten_with_path(snapshot)
    return [[jax.tree_util.keystr(path), str(np.dtype(leaf.dtype)), list(leaf.shape)] for path, leaf in leaves]


def _packed(snapshots: Sequence[Any]) -> dict[str, np.ndarray]:
    """For each kind of number one array [N, F]."""
    rows = [jax.tree.leaves(snapshot) for snapshot in snapshots]
    arrays = {}
    for kind, indices in _kinds(rows[0]).items():
        array = np.empty((len(rows), sum(rows[0][index].size for index in indices)), kind)
        for row, numbers in zip(rows, array, strict=True):
            np.concatenate([np.ravel(row[index]) for index in indices], out=numbers)
        arrays[_array_name(kind)] = array
    return arrays


def _unpacked(arrays: Mapping[str, np.ndarray], count: int, train_state: Any) -> list[Any]:
    """Return the snapshots, shaped as `train_state`. Each has its own memory, so that none keeps the others alive."""
    leaves, tree = jax.tree.flatten(train_state)
    found: list[list[Any]] = [[None] * len(leaves) for _ in range(count)]
    for kind, indices in _kinds(leaves).items():
        ends = np.cumsum([leaves[index].size for index in indices])[:-1]
        for row, numbers in enumerate(arrays[_array_name(kind)]):
            for index, part in zip(indices, np.split(numbers, ends), strict=True):
                found[row][index] = part.reshape(leaves[index].shape).copy()
    return [jax.tree.unflatten(tree, each) for each in found]


def _kinds(leaves: Sequence[Any]) -> dict[str, list[int]]:
    """Which leaves hold which kind of number."""
    kinds: dict[str, list[int]] = {}
    for index, leaf in enumerate(leaves):
        kinds.setdefault(str(np.dtype(leaf.dtype)), []).append(index)
    return kinds


def _array_name(kind: str) -> str:
    return f"snapshot_{kind}"


def _first_difference(stored: list[list[Any]], expected: list[list[Any]]) -> str:
    for one, other in zip(stored, expected, strict=False):
        if one != other:
            return f"{one} where {other} belongs"
    return f"{len(stored)} arrays where {len(expected)} belong"

"""Checkpoints of a run: `checkpoints/GENERATION/`, each on its own enough to go on from.

arrays/          the numbers of the run's state, written by Orbax (`jmorl.storage.serialization`)
metrics.csv      the logs as they were then: metrics.csv, policies.csv and decisions.jsonl
checkpoint.json  one line: versions, the rest of the state, and size and SHA-256 of every other file;
                 a second line: the SHA-256 of the first

A checkpoint is written beside its place and renamed when it is whole and on the disk. Orbax reads some damaged files
without complaint, so nothing is given to it before every byte is known to be what was written.
"""

import hashlib
import importlib.metadata
import json
import os
import shutil
from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from jmorl.methods.base import Method
from jmorl.state import RunState
from jmorl.storage.files import partial_path, sync
from jmorl.storage.serialization import PackedState, from_format_1, pack
from jmorl.storage.versions import check_format

FORMAT = 2
DOCUMENT = "checkpoint.json"
ARRAYS = "arrays"


class CheckpointError(RuntimeError):
    """A checkpoint could not be written. What was written before it stands."""


class DamagedCheckpoint(ValueError):
    """A checkpoint is not as it was written; the message names the file."""


@dataclass(frozen=True)
class Checkpoint:
    """What a checkpoint holds."""

    generation: int
    run: str  # the id of the run that wrote it
    state: PackedState
    logs: Mapping[str, str]  # file name -> text


class CheckpointWriter:
    """Writes the checkpoints of one run, each in the background, and deletes all but the last `keep`.

    What goes wrong there is raised, as CheckpointError, by the next `save` or `wait`.
    """

    def __init__(self, folder: Path, run: str, keep: int, method: Method[Any]):
        self.folder = folder
        self.run = run
        self.keep = keep
        self.method = method
        self._thread = ThreadPoolExecutor(1, "checkpoints")
        self._writing: Future[None] | None = None

    def save(self, state: RunState, logs: Mapping[str, str]) -> None:
        """Write a checkpoint of the state and of the logs' texts, when the one before is done."""
        self.wait()
        self._writing = self._thread.submit(self._write, state, logs)

    def wait(self) -> None:
        """Return when everything is on the disk."""
        if self._writing is not None:
            writing, self._writing = self._writing, None
            writing.result()

    def close(self) -> None:
        """Wait, and take nothing more."""
        try:
            self.wait()
        finally:
            self._thread.shutdown()

    def _write(self, state: RunState, logs: Mapping[str, str]) -> None:
        try:
            write_checkpoint(self.folder, Checkpoint(state.generation, self.run, pack(state, self.method), logs))
            for generation in stored_generations(self.folder)[: -self.keep]:
                shutil.rmtree(checkpoint_path(self.folder, generation))
        except Exception as error:  # Orbax has several of its own for a full disk
            problem = f"the checkpoint of generation {state.generation} could not be written: {error}"
            raise CheckpointError(problem) from error


def checkpoint_path(folder: Path, generation: int) -> Path:
    """Where the checkpoint of a generation is, in the folder of all."""
    return folder / f"{generation:05d}"


def stored_generations(folder: Path) -> list[int]:
    """The generations that have a checkpoint, the earliest first."""
    return sorted(int(path.name) for path in folder.glob("[0-9]*") if path.name.isdigit())


def write_checkpoint(folder: Path, checkpoint: Checkpoint) -> None:
    """Write a checkpoint into the folder of all, visible only when it is whole and on the disk."""
    path = checkpoint_path(folder, checkpoint.generation)
    temporary = partial_path(path)
    shutil.rmtree(temporary, ignore_errors=True)
    try:
        temporary.mkdir(parents=True)
        _write_arrays(temporary / ARRAYS, checkpoint.state.arrays)
        for name, text in checkpoint.logs.items():
            (temporary / name).write_bytes(text.encode())
        document = {
            "format": FORMAT,
            "jmorl": importlib.metadata.version("jmorl"),
            "run": checkpoint.run,
            "generation": checkpoint.generation,
            "logs": list(checkpoint.logs),
            "state": checkpoint.state.document,
            "files": {name: _fingerprint(temporary / name) for name in _file_names(temporary)},
        }
        line = json.dumps(document, allow_nan=False) + "\n"
        (temporary / DOCUMENT).write_text(line + _digest_line(line), encoding="utf-8")
        for each in (temporary, *temporary.rglob("*")):
            sync(each)
        os.rename(temporary, path)
        sync(folder)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def read_checkpoint(folder: Path, generation: int) -> Checkpoint:
    """Read a checkpoint, every byte of which is compared with its digest first.

    Raises DamagedCheckpoint, naming the file, and NewerFormat.
    """
    path = checkpoint_path(folder, generation)
    document = _read_document(path / DOCUMENT)
    for name, fingerprint in document["files"].items():
        _check(path / name, fingerprint)
    logs = {name: (path / name).read_bytes().decode() for name in document["logs"]}
    packed = PackedState(document["state"], _read_arrays(path / ARRAYS))
    if document["format"] == 1:
        packed = from_format_1(packed)
    return Checkpoint(document["generation"], document["run"], packed, logs)


def _read_document(path: Path) -> dict[str, Any]:
    try:
        text = path.read_bytes()
    except FileNotFoundError:
        raise DamagedCheckpoint(f"{path} is missing") from None
    line, end, digest = text.partition(b"\n")
    if digest != _digest_line((line + end).decode(errors="replace")).encode():
        raise DamagedCheckpoint(f"{path} is damaged: it is not as it was written")
    document: dict[str, Any] = json.loads(line)
    check_format(document, FORMAT, document["jmorl"], str(path))
    return document


def _digest_line(line: str) -> str:
    return hashlib.sha256(line.encode()).hexdigest() + "\n"


def _check(path: Path, fingerprint: Mapping[str, Any]) -> None:
    """Raise DamagedCheckpoint unless the file is as it was written."""
    if not path.is_file():
        raise DamagedCheckpoint(f"{path} is missing")
    size = path.stat().st_size
    if size != fingerprint["bytes"]:
        raise DamagedCheckpoint(f"{path} is damaged: it has {size} bytes, not {fingerprint['bytes']}")
    if _fingerprint(path) != fingerprint:
        raise DamagedCheckpoint(f"{path} is damaged: its bytes are not those that were written")


def _fingerprint(path: Path) -> dict[str, Any]:
    with path.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    return {"bytes": path.stat().st_size, "sha256": digest}


def _file_names(folder: Path) -> list[str]:
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())


def _write_arrays(path: Path, arrays: Mapping[str, np.ndarray]) -> None:
    """Uncompressed: the mantissas of trained networks are noise, and compressing them costs more than their bytes."""
    import orbax.checkpoint as ocp  # takes half a second to import

    handler = ocp.PyTreeCheckpointHandler(use_ocdbt=True, use_compression=False)
    with ocp.Checkpointer(handler) as checkpointer:
        checkpointer.save(path.absolute(), dict(arrays))
    (path / "commit_success.txt").unlink(missing_ok=True)  # names this place, and a run may be moved


def _read_arrays(path: Path) -> dict[str, np.ndarray]:
    import orbax.checkpoint as ocp

    with ocp.PyTreeCheckpointer() as checkpointer:
        restored: dict[str, np.ndarray] = checkpointer.restore(path.absolute())
    return restored

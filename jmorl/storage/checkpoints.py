"""Checkpoints of a run: `checkpoints/GENERATION/`, each on its own enough to go on from.

arrays/          the numbers of the run's state (`jmorl.storage.serialization`), written by `jmorl.storage.arrays`
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
import re
import shutil
from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter
from typing_extensions import TypedDict

from jmorl.methods.base import Method
from jmorl.state import RunState
from jmorl.storage.arrays import ArraysError, read_arrays, write_arrays
from jmorl.storage.documents import DocumentError, check_fields, json_object
from jmorl.storage.files import partial_path, remove, sync
from jmorl.storage.layout import CheckpointLayout, checkpoint_path
from jmorl.storage.serialization import PackedState, from_format_1, pack
from jmorl.storage.versions import check_format

FORMAT = 2


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


class _Fingerprint(TypedDict):
    bytes: int
    sha256: str


class _Document(TypedDict):
    run: str
    generation: int
    logs: list[str]
    state: dict[str, Any]
    files: dict[str, _Fingerprint]  # path in the folder -> what it must be


_DOCUMENT = TypeAdapter(_Document)


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
                remove(checkpoint_path(self.folder, generation))
        except Exception as error:
            reason = error.strerror if isinstance(error, OSError) and error.strerror else error
            problem = f"the checkpoint of round {state.generation} could not be written: {reason}"
            raise CheckpointError(problem) from error


def stored_generations(folder: Path) -> list[int]:
    """Return the generations that have a checkpoint, the earliest first."""
    numbers = (int(path.name) for path in folder.glob("*") if re.fullmatch("[0-9]+", path.name))
    return sorted(number for number in numbers if checkpoint_path(folder, number).exists())


def write_checkpoint(folder: Path, checkpoint: Checkpoint) -> None:
    """Write a checkpoint into the folder of all, visible only when it is whole and on the disk."""
    path = checkpoint_path(folder, checkpoint.generation)
    temporary = partial_path(path)
    remove(temporary)
    layout = CheckpointLayout(temporary)
    try:
        temporary.mkdir(parents=True)
        write_arrays(layout.arrays, checkpoint.state.arrays)
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
        layout.document.write_bytes((line + _digest_line(line)).encode())
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
    layout = CheckpointLayout(checkpoint_path(folder, generation))
    document = _read_document(layout.document)
    if document["generation"] != generation:
        raise DamagedCheckpoint(f"{layout.root} is the checkpoint of round {document['generation']}")
    for name, fingerprint in document["files"].items():
        _check(layout.root / name, fingerprint)
    try:
        logs = {name: _bytes(layout.root / name).decode() for name in document["logs"]}
        arrays = read_arrays(layout.arrays)
    except (ArraysError, UnicodeDecodeError) as error:
        raise DamagedCheckpoint(f"{layout.root} is damaged: {error}") from error
    packed = PackedState(document["state"], arrays)
    if document["format"] == 1:
        packed = from_format_1(packed)
    return Checkpoint(generation, document["run"], packed, logs)


def _read_document(path: Path) -> dict[str, Any]:
    line, end, digest = _bytes(path).partition(b"\n")
    if digest != _digest_line((line + end).decode(errors="replace")).encode():
        raise DamagedCheckpoint(f"{path} is damaged: it is not as it was written")
    try:
        document = json_object(line, str(path))
        check_format(document, FORMAT, str(path))
        check_fields(document, _DOCUMENT, str(path))
    except DocumentError as error:
        raise DamagedCheckpoint(str(error)) from error
    return document


def _bytes(path: Path) -> bytes:
    """Return what a file holds. Raises DamagedCheckpoint."""
    try:
        return path.read_bytes()
    except FileNotFoundError:
        raise DamagedCheckpoint(f"{path} is missing") from None
    except OSError as error:
        raise DamagedCheckpoint(f"{path} cannot be read: {error.strerror}") from error


def _digest_line(line: str) -> str:
    return hashlib.sha256(line.encode()).hexdigest() + "\n"


def _check(path: Path, fingerprint: Mapping[str, Any]) -> None:
    """Raise DamagedCheckpoint unless the file is as it was written."""
    content = _bytes(path)
    if len(content) != fingerprint["bytes"]:
        raise DamagedCheckpoint(f"{path} is damaged: it has {len(content)} bytes, not {fingerprint['bytes']}")
    if hashlib.sha256(content).hexdigest() != fingerprint["sha256"]:
        raise DamagedCheckpoint(f"{path} is damaged: its bytes are not those that were written")


def _fingerprint(path: Path) -> dict[str, Any]:
    with path.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    return {"bytes": path.stat().st_size, "sha256": digest}


def _file_names(folder: Path) -> list[str]:
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())

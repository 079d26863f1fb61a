"""What a run folder has to go on from: the settings that its run was started with, and the checkpoints."""

from dataclasses import fields
from pathlib import Path
from typing import Any

from envs.core import Environment
from jmorl.config import Config, ConfigError, resolve
from jmorl.state import RunState
from jmorl.storage.checkpoints import Checkpoint, DamagedCheckpoint, read_checkpoint, stored_generations
from jmorl.storage.documents import DocumentError
from jmorl.storage.layout import Layout, checkpoint_path
from jmorl.storage.manifest import Manifest, check_config, read_manifest
from jmorl.storage.run_folder import has_begun
from jmorl.storage.serialization import PackingError, unpack

Found = tuple[Checkpoint, RunState]


class CannotContinue(ValueError):
    """There is no run in the folder that could go on from there; the message says why, and what to do."""


def read_start(path: Path) -> tuple[Manifest, Config]:
    """Read the manifest and the config of a run. Raises CannotContinue and NewerFormat."""
    layout = Layout(path)
    if not layout.manifest.exists():
        raise CannotContinue(f"{path} is not a run folder: it has no {layout.manifest.name}")
    if not layout.config.exists():
        raise CannotContinue(_without_config(layout))
    try:
        manifest = read_manifest(path)
        config = resolve(file=layout.config)
        check_config(path, manifest, config)
    except ConfigError as error:
        raise CannotContinue(f"{layout.config} cannot be used: {'; '.join(error.problems)}") from error
    except DocumentError as error:
        raise CannotContinue(f"{path} cannot be read as a run: {error}") from error
    except OSError as error:
        raise CannotContinue(f"{path} cannot be read as a run: {error.filename}: {error.strerror}") from error
    return manifest, config


def _without_config(layout: Layout) -> str:
    """Say what to do about a run whose config is not there."""
    if has_begun(layout):
        return (
            f"{layout.root} has lost its {layout.config.name}; put it back, or start again with `jmorl train --force`"
        )
    return f"the run in {layout.root} ended before it began; start it again with `jmorl train`"


def last_good(
    path: Path, manifest: Manifest, config: Config, environment: Environment[Any]
) -> tuple[Found | None, list[str]]:
    """Return the last checkpoint that is whole and its state, None if there is none; and what is wrong with later ones.

    Raises CannotContinue and NewerFormat.
    """
    notes: list[str] = []
    for generation in reversed(stored_generations(Layout(path).checkpoints)):
        try:
            checkpoint = _own_checkpoint(path, generation, manifest)
            return (checkpoint, _unpacked(path, checkpoint, config, environment)), notes
        except DamagedCheckpoint as error:
            notes.append(str(error))
    return None, notes


def state_after(
    path: Path, generation: int, manifest: Manifest, config: Config, environment: Environment[Any]
) -> Found:
    """Return the checkpoint of a generation, and its state. Raises CannotContinue and NewerFormat."""
    stored = stored_generations(Layout(path).checkpoints)
    if generation not in stored:
        raise CannotContinue(
            f"{path} has no checkpoint of round {generation}, only of: {', '.join(map(str, stored)) or 'none'}"
        )
    try:
        checkpoint = _own_checkpoint(path, generation, manifest)
        return checkpoint, _unpacked(path, checkpoint, config, environment)
    except DamagedCheckpoint as error:
        raise CannotContinue(f"{error}; branch off another round") from error


def _own_checkpoint(path: Path, generation: int, manifest: Manifest) -> Checkpoint:
    """Return a checkpoint of the run in a folder. Raises DamagedCheckpoint, for one of another run, too."""
    folder = Layout(path).checkpoints
    checkpoint = read_checkpoint(folder, generation)
    if checkpoint.run != manifest["run"]:
        raise DamagedCheckpoint(f"{checkpoint_path(folder, generation)} belongs to another run")
    return checkpoint


def _unpacked(path: Path, checkpoint: Checkpoint, config: Config, environment: Environment[Any]) -> RunState:
    """Return the state in a checkpoint. Raises CannotContinue if the run has no such states now.

    Its bytes are as they were written, so that an earlier checkpoint would not do either.
    """
    place = checkpoint_path(Layout(path).checkpoints, checkpoint.generation)
    try:
        state = unpack(checkpoint.state, config, environment)
        _check_counters(state, checkpoint.generation)
        return state
    except PackingError as error:
        raise CannotContinue(f"{place} does not fit this jmorl: {error}") from error
    except (AttributeError, KeyError, IndexError, TypeError, ValueError) as error:
        raise CannotContinue(f"{place} does not fit this jmorl: its state cannot be read ({error!r})") from error


def _check_counters(state: RunState, generation: int) -> None:
    """Raise ValueError unless the state counts, and is of the generation."""
    counters = {field.name: getattr(state, field.name) for field in fields(state) if field.type is int}
    wrong = [name for name, count in counters.items() if type(count) is not int or count < 0]
    if wrong or state.generation != generation:
        raise ValueError(f"wrong numbers of {', '.join(wrong) or 'generations'}")

"""manifest.json of a run folder: which run it is, what made it, where, and where it was taken up again."""

import importlib.metadata
import platform
import subprocess
import sys
import time
import uuid
from pathlib import Path
from typing import Any

import jax
from pydantic import TypeAdapter
from typing_extensions import TypedDict

from jmorl.config import Config
from jmorl.display.characters import unicode_argument
from jmorl.storage.documents import DocumentError, check_fields, json_object
from jmorl.storage.layout import Layout
from jmorl.storage.versions import check_format

FORMAT = 2
PACKAGES = ("jmorl", "jax", "jaxlib", "flax", "optax", "numpy", "scipy", "moocore", "orbax-checkpoint")

Manifest = dict[str, Any]


class _Parent(TypedDict):
    run: str
    name: str
    generation: int


class _Device(TypedDict):
    kind: str
    platform: str
    count: int


class _Manifest(TypedDict):
    """What is relied on of a manifest; there may be more."""

    run: str
    parent: _Parent | None
    started: str
    config: str
    commit: str | None
    packages: dict[str, str]
    device: _Device
    resumed: list[dict[str, Any]]


_MANIFEST = TypeAdapter(_Manifest)


def new_manifest(config: Config, parent: Manifest | None = None) -> Manifest:
    """Of a run that begins here and now. `parent`: id, name and generation of the run that it branches off."""
    program, *arguments = sys.argv
    return {
        "format": FORMAT,
        "run": uuid.uuid4().hex,
        "parent": parent,
        "started": now(),
        "command": [Path(program).name, *map(unicode_argument, arguments)],
        "config": config.identity(),
        "seed": config.seed,
        "commit": _commit(),
        **circumstances(),
        "resumed": [],
    }


def circumstances() -> Manifest:
    """Return the versions and the device on which the last bits of a run's numbers depend."""
    device = jax.devices()[0]
    return {
        "python": platform.python_version(),
        "packages": {name: importlib.metadata.version(name) for name in PACKAGES},
        "platform": platform.platform(),
        "device": {"kind": device.device_kind, "platform": device.platform, "count": jax.device_count()},
    }


def read_manifest(folder: Path) -> Manifest:
    """Read the manifest of a run. Raises OSError, DocumentError for one that is damaged, and NewerFormat."""
    path = Layout(folder).manifest
    manifest = json_object(path.read_bytes(), str(path))
    check_format(manifest, FORMAT, str(path))
    check_fields(manifest, _MANIFEST, str(path))
    return manifest


def check_config(folder: Path, manifest: Manifest, config: Config) -> None:
    """Raise DocumentError unless the config in a folder is the one that its run was started with."""
    if not config.is_identified_by(manifest["config"]):
        raise DocumentError(
            f"{Layout(folder).config} is not what run {manifest['run']} was started with (by jmorl "
            f"{manifest['packages'].get('jmorl')}: {manifest['config']}, now: {config.identity()}); restore it, or "
            "start a run of its own with `jmorl train --config`"
        )


def differences(before: Manifest, here: Manifest) -> list[str]:
    """In words, what is other than it was, of the circumstances that matter to numbers."""
    changes = [
        f"{name} {before['packages'].get(name)} is now {version}"
        for name, version in here["packages"].items()
        if before["packages"].get(name) != version
    ]
    for name, was in before["device"].items():
        if here["device"][name] != was:
            changes.append(f"device {name} {was} is now {here['device'][name]}")
    return changes


def now() -> str:
    """Return the present time as text, UTC."""
    return time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())


def _commit() -> str | None:
    """Return the commit of the source tree, with a mark if it was changed since; None outside a repository."""
    command = ["git", "-C", str(Path(__file__).parent), "describe", "--always", "--dirty", "--abbrev=40"]
    try:
        found = subprocess.run(command, capture_output=True, encoding="utf-8", check=True, timeout=10)
        return found.stdout.strip()
    except (OSError, ValueError, subprocess.SubprocessError):
        return None

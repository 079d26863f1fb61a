"""A run and its branches: every question, what was chosen, and where one may choose otherwise."""

from dataclasses import dataclass
from pathlib import Path

from jmorl.decision.records import DecisionRecord, ScriptError, read_log
from jmorl.storage.checkpoints import stored_generations
from jmorl.storage.layout import Layout
from jmorl.storage.manifest import Manifest, read_manifest
from jmorl.storage.notes_file import Notes, read_notes


@dataclass(frozen=True)
class Branch:
    """A run among those that began as one."""

    path: Path
    run: str  # id in its manifest
    parent: str | None  # id of the run it leaves; None for the first
    leaves_after: int  # the last generation that it shares with its parent; -1 for the first run
    depth: int  # how many branches lie between it and the first run
    steps: tuple[DecisionRecord, ...]  # its own questions, not those before it left
    checkpoints: tuple[int, ...]  # generations after which one may go on otherwise
    finished: bool
    noted: Notes  # names, favourites and notes that somebody has given

    @property
    def name(self) -> str:
        """Return the name of its folder."""
        return self.path.name

    @property
    def title(self) -> str:
        """Return the name of its folder, and the name that somebody has given it."""
        return self.noted.run.named(self.name)


def read_tree(path: Path) -> tuple[Branch, ...]:
    """Read the run in a folder and its relatives in the folders beside it, each followed by its own branches."""
    path = path.resolve()
    manifests = {each: manifest for each in path.parent.iterdir() if (manifest := _manifest(each))}
    by_run = {manifest["run"]: each for each, manifest in manifests.items()} | {manifests[path]["run"]: path}
    root = path
    while (parent := manifests[root].get("parent")) and parent["run"] in by_run:
        root = by_run[parent["run"]]
    return tuple(_below(root, manifests, depth=0))


def free_folder(path: Path) -> Path:
    """Return a folder for a branch of the run in a folder: beside it, with the next free number."""
    first = read_tree(path)[0].path
    number = 2
    while first.with_name(f"{first.name}-{number}").exists():
        number += 1
    return first.with_name(f"{first.name}-{number}")


def _below(path: Path, manifests: dict[Path, Manifest], depth: int) -> list[Branch]:
    branch = _branch(path, manifests[path], depth)
    children = [each for each, manifest in manifests.items() if (manifest.get("parent") or {}).get("run") == branch.run]
    children.sort(key=lambda each: (manifests[each]["parent"]["generation"], manifests[each]["started"], each.name))
    return [branch, *(member for child in children for member in _below(child, manifests, depth + 1))]


def _branch(path: Path, manifest: Manifest, depth: int) -> Branch:
    parent = manifest.get("parent")
    leaves_after = parent["generation"] if parent else -1
    return Branch(
        path,
        manifest["run"],
        parent["run"] if parent else None,
        leaves_after,
        depth,
        tuple(record for record in _decisions(path) if record.generation > leaves_after),
        tuple(stored_generations(Layout(path).checkpoints)),
        Layout(path).result.exists(),
        read_notes(path),
    )


def _decisions(path: Path) -> list[DecisionRecord]:
    try:
        records = read_log(Layout(path).decisions) if Layout(path).decisions.exists() else []
    except ScriptError:  # a line is being written
        return []
    return [record for record in records if isinstance(record, DecisionRecord)]


def _manifest(path: Path) -> Manifest | None:
    """Read the manifest of a run; None for a folder without a readable one."""
    try:
        manifest = read_manifest(path) if Layout(path).config.exists() else {}
    except (OSError, ValueError, KeyError):
        return None
    return manifest if "run" in manifest else None

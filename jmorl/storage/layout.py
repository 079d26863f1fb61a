"""The names of all files and folders of a run, each written here and nowhere else."""

from dataclasses import dataclass
from pathlib import Path


class _Inside:
    """The path of a name in the folder that has it as an attribute."""

    def __init__(self, name: str):
        self.name = name

    def __get__(self, folder: "_Folder", owner: type["_Folder"]) -> Path:
        return folder.root / self.name


@dataclass(frozen=True)
class _Folder:
    """A folder whose files have fixed names."""

    root: Path


class Layout(_Folder):
    """The paths in the run folder `root`; `jmorl.storage.run_folder` says what each file holds."""

    config = _Inside("config.toml")
    manifest = _Inside("manifest.json")
    metrics = _Inside("metrics.csv")
    policies = _Inside("policies.csv")
    front = _Inside("front.csv")
    families = _Inside("families.json")
    decisions = _Inside("decisions.jsonl")
    policy_files = _Inside("policies")  # a folder
    checkpoints = _Inside("checkpoints")  # a folder
    result = _Inside("result.json")
    chosen = _Inside("chosen.npz")
    plots = _Inside("plots")  # a folder
    lock = _Inside("run.lock")
    enautilus = _Inside("enautilus.json")
    enautilus_log = _Inside("enautilus.jsonl")
    notes = _Inside("notes.json")

    def policy(self, policy_id: int) -> Path:
        """Return where the file of an archived policy is."""
        return self.policy_files / f"{policy_id:05d}.npz"


class CheckpointLayout(_Folder):
    """The paths in the folder of one checkpoint; `jmorl.storage.checkpoints` says what each holds."""

    document = _Inside("checkpoint.json")
    arrays = _Inside("arrays")  # a folder


def checkpoint_path(checkpoints: Path, generation: int) -> Path:
    """Return where the checkpoint of a generation is, in the folder of all checkpoints of a run."""
    return checkpoints / f"{generation:05d}"

"""Loading executes no code, whatever the file was made to hold."""

import gc
import hashlib
import json
import pickle

import numpy as np
import pytest

from jmorl.storage.checkpoints import (
    Checkpoint,
    DamagedCheckpoint,
    read_checkpoint,
    write_checkpoint,
)
from jmorl.storage.layout import CheckpointLayout, checkpoint_path
from jmorl.storage.policy_file import PolicyFileError, load_policy
from jmorl.storage.serialization import pack
from tests.stored import stored_linear_policy


class Payload:
    """Makes a folder when it is unpickled."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return type(self.path).mkdir, (self.path,)


@pytest.fixture
def trace(tmp_path):
    """The folder that a payload makes; a test that has made sure of that may not leave it there."""
    path = tmp_path / "executed"
    pickle.loads(pickle.dumps(Payload(path)))
    path.rmdir()
    yield path
    assert not path.exists()


@pytest.mark.parametrize("place", ["header", "layer_0_kernel", "observation_mean", "unheard_of"])
def test_a_policy_file_with_a_pickle_in_it_is_refused(trace, tmp_path, place):
    path = tmp_path / "policy.npz"
    stored_linear_policy(path, "mo-mountaincarcontinuous-v0", [[0.0, 1.0]])
    with np.load(path) as file:
        arrays = dict(file)
    np.savez(path, **arrays | {place: np.array([Payload(trace)], object)}, allow_pickle=True)
    with pytest.raises(PolicyFileError, match=r"policy.npz is not a policy file: .*allow_pickle=False"):
        load_policy(path)


def test_a_pickle_by_the_name_of_a_policy_file_is_refused(trace, tmp_path):
    path = tmp_path / "policy.npz"
    path.write_bytes(pickle.dumps(Payload(trace)))
    with pytest.raises(PolicyFileError, match="policy.npz is not a policy file"):
        load_policy(path)


def test_a_checkpoint_with_a_pickle_for_any_of_its_files_is_refused(trace, checkpoint, tmp_path):
    for path, payload in with_payloads(checkpoint, trace):
        with pytest.raises(DamagedCheckpoint, match=path.name):
            read_checkpoint(tmp_path, 1)
        assert path.read_bytes() == payload


# What Orbax was about to do when it failed is left behind without its event loop.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_checkpoint_whose_digests_were_forged_as_well_executes_nothing(trace, checkpoint, tmp_path):
    """Orbax passes over some files, and fails in its own words over others."""
    document, refused = CheckpointLayout(checkpoint).document, 0
    honest = document.read_text()
    for path, payload in with_payloads(checkpoint, trace):
        if path != document:
            document.write_text(signed(honest, path.relative_to(checkpoint).as_posix(), payload))
            try:
                read_checkpoint(tmp_path, 1)
            except DamagedCheckpoint:
                refused += 1
            document.write_text(honest)
    gc.collect()
    assert refused


@pytest.fixture
def checkpoint(make_state, method, tmp_path):
    """The folder of generation 1."""
    write_checkpoint(
        tmp_path, Checkpoint(1, "run", pack(make_state(1), method), {"metrics.csv": "generation\r\n0\r\n"})
    )
    return checkpoint_path(tmp_path, 1)


def with_payloads(folder, trace):
    """One file after the other, while a payload is in its place."""
    payload = pickle.dumps(Payload(trace))
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        content = path.read_bytes()
        path.write_bytes(payload)
        yield path, payload
        path.write_bytes(content)


def signed(text, name, content):
    """A checkpoint's document with the digest of other content for one of its files."""
    document = json.loads(text.splitlines()[0])
    document["files"][name] = {"bytes": len(content), "sha256": hashlib.sha256(content).hexdigest()}
    line = json.dumps(document) + "\n"
    return line + hashlib.sha256(line.encode()).hexdigest() + "\n"

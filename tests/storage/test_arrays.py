"""Arrays in a folder of any name; what cannot be read back is an error, in one sentence."""

import logging
import shutil
import tempfile

import numpy as np
import pytest
from orbax.checkpoint import PyTreeCheckpointer

from jmorl.storage.arrays import ArraysError, read_arrays, write_arrays

ARRAYS = {"x": np.arange(6.0).reshape(2, 3), "y": np.arange(3, dtype=np.uint32), "z": np.array([np.nan, -0.0], "f4")}
# Below the first four Orbax leaves out what it wrote; the next two it cannot write down; the others it can.
NAMES = (
    "My Runs [2026]",
    "a[1]",
    "p [2]/inner",
    "back\\slash",
    "gs:",
    "not utf-8 \udcff",
    "é 日本",
    "star*",
    "new\nline",
)


@pytest.mark.parametrize("name", NAMES)
def test_arrays_in_a_folder_of_any_name_come_back_and_may_be_moved(tmp_path, name):
    folder = tmp_path / name
    folder.mkdir(parents=True)
    write_arrays(folder / "arrays", ARRAYS)
    moved = shutil.copytree(folder / "arrays", tmp_path / "plain")
    for place in (folder / "arrays", moved):
        found = read_arrays(place)
        assert found.keys() == ARRAYS.keys()
        for key, array in ARRAYS.items():
            assert (found[key].dtype, found[key].tobytes()) == (array.dtype, array.tobytes())
    assert [path.name for path in folder.iterdir()] == ["arrays"]


def test_nothing_is_left_among_the_temporary_files(tmp_path, monkeypatch):
    (tmp_path / "temporary").mkdir()
    (tmp_path / "a[1]").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    write_arrays(tmp_path / "a[1]" / "arrays", ARRAYS)
    read_arrays(tmp_path / "a[1]" / "arrays")
    assert not list((tmp_path / "temporary").iterdir())


def test_a_folder_for_temporary_files_that_is_of_no_use_is_named(tmp_path, monkeypatch):
    (tmp_path / "t[1]").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "t[1]"))
    with pytest.raises(OSError, match=r"t\[1\], has special characters in its path; set TMPDIR"):
        write_arrays(tmp_path / "t[1]" / "arrays", ARRAYS)
    assert not list((tmp_path / "t[1]").iterdir())


def test_what_orbax_cannot_read_is_an_error_in_one_line(tmp_path):
    write_arrays(tmp_path / "arrays", ARRAYS)
    (tmp_path / "arrays" / "manifest.ocdbt").unlink()
    with pytest.raises(ArraysError, match="NOT_FOUND") as error:
        read_arrays(tmp_path / "arrays")
    assert "\n" not in str(error.value) and len(str(error.value)) < 300


@pytest.mark.parametrize("change", [lambda found: found.pop("y"), lambda found: found["x"].__setitem__((0, 0), 7.0)])
def test_arrays_are_compared_with_what_was_written_before_anybody_relies_on_them(tmp_path, monkeypatch, change):
    restore = PyTreeCheckpointer.restore

    def differently(checkpointer, path):
        found = {name: array.copy() for name, array in restore(checkpointer, path).items()}
        change(found)
        return found

    monkeypatch.setattr(PyTreeCheckpointer, "restore", differently)
    with pytest.raises(ArraysError, match="what was written is not what was read back"):
        write_arrays(tmp_path / "arrays", ARRAYS)


def test_only_orbax_is_quiet_and_only_meanwhile(tmp_path, monkeypatch, caplog):
    restore, logger = PyTreeCheckpointer.restore, logging.getLogger("absl")

    def report(path):
        logger.handle(logger.makeRecord("absl", logging.ERROR, path, 1, path, (), None))

    def reporting(checkpointer, path):
        report("/packages/orbax/checkpoint/futures.py")
        report("/packages/flax/core.py")
        return restore(checkpointer, path)

    write_arrays(tmp_path / "arrays", ARRAYS)
    monkeypatch.setattr(PyTreeCheckpointer, "restore", reporting)
    read_arrays(tmp_path / "arrays")
    report("/packages/orbax/later.py")
    assert [record.pathname for record in caplog.records] == ["/packages/flax/core.py", "/packages/orbax/later.py"]

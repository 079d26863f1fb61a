"""Modules of the user's that have the name of one of ours or of a library's."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
ENVIRONMENT = "from envs import MountainCar, register\nregister('base', MountainCar)\n"


def run(folder, *arguments):
    """Run Python in a folder, with the project found where it is installed."""
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "120"},
        capture_output=True,
        encoding="utf-8",
    )


def test_files_in_the_working_directory_do_not_hide_ours_nor_a_librarys(tmp_path):
    for name in ("envs", "numpy", "random", "jax"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('of the user')")
    listed = run(tmp_path, "-m", "jmorl", "envs")
    assert listed.returncode == 0 and "mo-mountaincarcontinuous-v0" in listed.stdout, listed.stderr


def test_a_folder_that_ours_hides_is_named(tmp_path):
    (tmp_path / "envs").mkdir()
    (tmp_path / "envs" / "base.py").write_text(ENVIRONMENT)
    trained = run(tmp_path, "-m", "jmorl", "train", "--env", "envs.base:base")
    assert trained.returncode == 2 and not (tmp_path / "runs").exists()
    assert f"No module named 'envs.base'; {tmp_path / 'envs'} is hidden by " in trained.stderr
    assert trained.stderr.endswith("which has the same name: rename yours\n")


def test_a_module_that_a_library_hides_is_named(tmp_path):
    (tmp_path / "numpy.py").write_text(ENVIRONMENT)
    trained = run(tmp_path, "-m", "jmorl", "train", "--env", "numpy:base")
    assert trained.returncode == 2
    assert "unknown environment 'base'" in trained.stderr and f"{tmp_path / 'numpy.py'} is hidden by " in trained.stderr


def test_a_module_in_the_working_directory_is_found(tmp_path):
    (tmp_path / "my_own.py").write_text("print('here')")
    trained = run(tmp_path, "-m", "jmorl", "train", "--env", "my_own:base")
    assert trained.stdout == "here\n" and "hidden" not in trained.stderr


@pytest.mark.parametrize("first", ["import jmorl", "import envs"])
def test_a_program_beside_a_folder_of_that_name(tmp_path, first):
    """Ours is found if it comes first; if the other one does, that is said."""
    (tmp_path / "envs").mkdir()
    (tmp_path / "envs" / "__init__.py").touch()
    (tmp_path / "program.py").write_text(f"{first}\nimport jmorl, envs\nprint(envs.ids())")
    ran = run(tmp_path, "program.py")
    if first == "import jmorl":
        assert "mo-halfcheetah-v5" in ran.stdout
    else:
        assert ran.returncode == 1
        assert f"{tmp_path / 'envs' / '__init__.py'} has been imported under this name" in ran.stderr

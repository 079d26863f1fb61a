"""Where a run is that was not given a folder."""

import time
from concurrent.futures import ThreadPoolExecutor

import pytest

import envs
from envs.checks import NotAsDeclared
from jmorl.storage.run_folder import RunFolder


def test_runs_that_begin_in_the_same_second_get_the_next_free_names(tmp_path, monkeypatch, small_config):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(time, "strftime", lambda *_: "20260101-120000")
    environment = envs.make(small_config.env)

    def create(_):
        with RunFolder.create(None, small_config, environment) as folder:
            return str(folder.path)

    with ThreadPoolExecutor(4) as pool:
        made = sorted(pool.map(create, range(4)))
    assert made == ["runs/20260101-120000", *(f"runs/20260101-120000-{number}" for number in (2, 3, 4))]
    assert all((tmp_path / path / "manifest.json").exists() for path in made)


def test_bad_input_reserves_no_name(tmp_path, monkeypatch, small_config):
    monkeypatch.chdir(tmp_path)

    def refuse(environment):
        raise NotAsDeclared("not as it says")

    monkeypatch.setattr("jmorl.storage.run_folder.check_environment", refuse)
    with pytest.raises(NotAsDeclared):
        RunFolder.create(None, small_config, envs.make(small_config.env))
    assert not list(tmp_path.iterdir())

"""A new run begins whole, or not at all."""

import pytest

from jmorl.config import ConfigError
from jmorl.storage.begin import begin
from jmorl.storage.manifest import read_manifest
from tests.registered import ThreeWays

USER = {"env": ThreeWays.id, "user": "weights=1,1,1"}


def test_a_run_without_a_name_is_named_after_the_time(tmp_path):
    runs = tmp_path / "not" / "there"
    names = []
    for _ in range(2):
        with begin(overrides=USER, runs=runs).folder as folder:
            names.append(folder.path.name)
            assert folder.path.parent == runs and read_manifest(folder.path)["config"] == folder.config.identity()
    assert len(set(names)) == 2 and all(name[:8].isdecimal() for name in names)


def test_all_problems_are_told_at_once_and_nothing_is_made(tmp_path):
    used = tmp_path / "used"
    used.mkdir()
    (used / "file").touch()
    given = []

    def problems_of(config):
        given.append(config)
        return ["mood: is bad"]

    with pytest.raises(ConfigError) as error:
        begin(overrides={**USER, "seed": -1, "ask": "never"}, out=used, problems_of=problems_of)
    assert [problem.partition(":")[0] for problem in error.value.problems] == ["ask", "seed", "mood", "out"]
    with pytest.raises(ConfigError) as error:
        begin(overrides=USER, out=tmp_path / "new", problems_of=problems_of)
    assert error.value.problems == ["mood: is bad"] and given[0] is None and given[1].env == ThreeWays.id
    script = {"env": ThreeWays.id, "user": f"script={tmp_path}/gone"}
    with pytest.raises(ConfigError, match="gone"):
        begin(overrides=script, out=tmp_path / "new")
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["file", "used"]

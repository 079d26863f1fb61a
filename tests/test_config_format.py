"""A setting that is added tomorrow orphans no run of today."""

import pytest

from jmorl import config_format
from jmorl.config import Config, ConfigError, resolve
from jmorl.presets import PAPER_RULE

FORMAT_1_DEFAULT = "de2fb9c202325fb9"  # the digest of `resolve()` in the first version, which had the paper's search
FORMAT_1_PAPER = "fbdcd9303d5a0ae3"  # of `resolve("paper", overrides={"env": "mo-halfcheetah-v5", "user": "C"})`


def test_the_baseline_has_every_setting_and_no_other():
    assert dict(config_format.flat_settings(Config().model_dump(mode="json"))).keys() == config_format.BASELINE.keys()


def test_the_baseline_is_a_config_without_differences():
    config = Config.model_validate(config_format.before_settings_were_added())
    assert config.identity() == config_format.identity(config_format.before_settings_were_added())
    assert config.identity() != config.replace(seed=2).identity()


def test_identities_of_the_first_format_are_known():
    assert resolve(overrides=PAPER_RULE).is_identified_by(FORMAT_1_DEFAULT)
    assert not resolve().is_identified_by(FORMAT_1_DEFAULT)
    paper = resolve("paper", overrides={"env": "mo-halfcheetah-v5", "user": "C"})
    assert paper.is_identified_by(FORMAT_1_PAPER)
    assert not paper.replace(seed=2).is_identified_by(FORMAT_1_PAPER)


def test_a_setting_of_today_cannot_hide_behind_an_identity_of_the_first_format():
    weighted = resolve(overrides=PAPER_RULE | {"population": {"weights": (1.0, 0.0) * 6}})
    assert not weighted.is_identified_by(FORMAT_1_DEFAULT)
    assert config_format.identity_of_format_1(weighted.model_dump(mode="json")) is None


def test_what_is_kept_changes_no_identity():
    assert resolve().replace(checkpoints={"keep": 1}).identity() == resolve().identity()


@pytest.fixture
def with_a_setting_of_tomorrow(monkeypatch):
    """A setting whose default, "new", does other things than were done before there was one, "old"."""
    from pydantic import Field

    from jmorl.search.settings import SearchConfig

    class Tomorrow(SearchConfig):
        stagnation: str = Field("new", description="what to do when nothing is left")

    class ConfigOfTomorrow(Config):
        search: Tomorrow = Tomorrow()

    monkeypatch.setattr("jmorl.config.Config", ConfigOfTomorrow)
    baseline = {**config_format.BASELINE, "search.stagnation": "old"}
    monkeypatch.setattr(config_format, "BASELINE", baseline)
    added = config_format.ADDED_SINCE_FORMAT_1 | {"search.stagnation"}
    monkeypatch.setattr(config_format, "ADDED_SINCE_FORMAT_1", added)
    return ConfigOfTomorrow


def stagnation(config):
    return config.model_dump()["search"]["stagnation"]


def test_tomorrow_the_runs_of_today_are_what_they_are(tmp_path, request):
    """In both formats: their files mean what was done then, and their identities are known."""
    today = resolve(overrides={"user": "B", "population": {"weights": (1.0, 0.0) * 6}})
    of_format_1 = resolve(overrides=PAPER_RULE | {"user": "B"})
    second, first = tmp_path / "second.toml", tmp_path / "first.toml"
    second.write_text(today.to_toml(), encoding="utf-8")
    lines = of_format_1.to_toml().splitlines(keepends=True)
    first.write_text("".join(line for line in lines if not line.startswith(("format", "weights ="))), encoding="utf-8")
    identity, digest = today.identity(), config_format.identity_of_format_1(of_format_1.model_dump(mode="json"))
    request.getfixturevalue("with_a_setting_of_tomorrow")
    for file, stored in ((second, identity), (first, digest)):
        read = resolve(file=file)
        assert stagnation(read) == "old"
        assert read.is_identified_by(stored)
        assert not read.replace(search={"stagnation": "new"}).is_identified_by(stored)
    assert stagnation(resolve()) == "new"
    by_hand = tmp_path / "by_hand.toml"
    by_hand.write_text('user = "B"\n', encoding="utf-8")
    assert stagnation(resolve(file=by_hand)) == "new"


def test_a_file_of_a_newer_format_is_refused(tmp_path):
    file = tmp_path / "config.toml"
    file.write_text("format = 99\n", encoding="utf-8")
    with pytest.raises(ConfigError, match=r"has format 99; this jmorl knows up to \d+: update it"):
        resolve(file=file)

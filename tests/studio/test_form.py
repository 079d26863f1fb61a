"""The form of a new run: everything that is wrong with it at once, and nothing made before it is right."""

import sys
from dataclasses import replace

import pytest

from jmorl.config import Config, ConfigError, resolve
from jmorl.presets import PRESETS
from jmorl.studio import words
from jmorl.studio.form import Form, environments
from tests.registered import ThreeWays

SMALL = """
population = {agents = 4, warmup-iterations = 2, iterations = 3}
ppo.rollout_steps = 16
ppo.minibatches = 4
"""
RIGHT = Form(env=ThreeWays.id, steps="100000", seed="7", ask="always", question="few", more=SMALL)


def problems(form, runs):
    with pytest.raises(ConfigError) as error:
        form.begin(runs)
    assert not list(runs.iterdir())
    return error.value.problems


def test_what_is_filled_in_becomes_a_run_in_a_folder_of_its_name(tmp_path):
    with replace(RIGHT, name=" my run ").begin(tmp_path).folder as folder:
        config = folder.config
    assert folder.path == tmp_path / "my run" and resolve(file=folder.path / "config.toml") == config
    assert (config.env, config.user, config.steps, config.seed) == (ThreeWays.id, "terminal", 100_000, 7)
    assert (config.ask, config.question, config.population.agents) == ("always", "few", 4)


def test_without_a_name_the_folder_is_called_after_the_time_and_settings_count_more_than_fields(tmp_path):
    form = replace(RIGHT, more=SMALL + 'seed = 9\nuser = "weights=1,1,1"')
    with form.begin(tmp_path).folder as folder:
        assert folder.path.parent == tmp_path and folder.path.name[:8].isdecimal()
        assert (folder.config.seed, folder.config.user) == (9, "weights=1,1,1")


def test_what_is_not_filled_in_is_as_the_preset_has_it(tmp_path):
    form = Form(preset="paper")
    with form.begin(tmp_path).folder as folder:
        assert folder.config == form.usual() == resolve("paper", overrides={"user": "terminal"})
    assert form.usual().ask == "always" and Form().usual().ask == "unsure"
    assert Form(env="no-such-environment").usual() is None


def test_all_problems_are_told_at_once(tmp_path):
    form = replace(RIGHT, steps="many", seed="-1", name="../up", more="ppo.epochs = 0\nmood = 1\nuser = 'script=x'")
    told = problems(form, tmp_path)
    assert {problem.partition(":")[0] for problem in told} == {"steps", "seed", "folder", "ppo.epochs", "mood", "user"}
    assert problems(replace(RIGHT, seed="x", more="a b"), tmp_path)[-1].startswith("more settings: ")
    assert problems(replace(RIGHT, more="a = " + "[" * 100_000), tmp_path)[-1].startswith("more settings: ")


@pytest.mark.parametrize(
    "name", ["..", ".", ".hidden", "a/b", "/absolute", "../beside", "a\\b", "line\nbreak", "\0", "x" * 300]
)
def test_a_name_stays_in_the_folder(tmp_path, name):
    runs = tmp_path / "runs"
    runs.mkdir()
    assert len(problems(replace(RIGHT, name=name), runs)) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["runs"]


def test_a_name_that_is_taken_is_refused_even_by_a_link_that_leads_elsewhere(tmp_path):
    runs, elsewhere = tmp_path / "runs", tmp_path / "elsewhere"
    runs.mkdir()
    elsewhere.mkdir()
    (runs / "link").symlink_to(elsewhere)
    (runs / "dangling").symlink_to(tmp_path / "nowhere")
    (runs / "empty").mkdir()
    for name in ("link", "dangling", "empty"):
        with pytest.raises(ConfigError, match=f"there already is '{name}'"):
            replace(RIGHT, name=name).begin(runs)
    assert not list(elsewhere.iterdir()) and not (tmp_path / "nowhere").exists()


def test_no_file_is_opened_and_no_module_imported(tmp_path, monkeypatch):
    (tmp_path / "evil_module.py").write_text("raise SystemExit('imported')")
    secret = tmp_path / "secret"
    secret.write_text("secret")
    monkeypatch.syspath_prepend(tmp_path)
    runs = tmp_path / "runs"
    runs.mkdir()
    for more, name in (
        (f"user = 'script={secret}'", "user"),
        (f"user = ' script={secret}'", "user"),
        ("env = 'evil_module:mo-hopper-v5'", "env"),
        ("env = 'evil_module:mo-hopper-v5,physics=planar'", "env"),
        ("method = 'evil_module:interactive'", "method"),
        ("env = 5", "env"),
        ("user = ['script=x']", "user"),
    ):
        told = problems(replace(RIGHT, more=SMALL + more), runs)
        assert [problem.partition(":")[0] for problem in told] == [name], more
        assert "secret" not in "".join(told).replace(str(secret), "")
    assert "evil_module" not in sys.modules


def test_an_environment_of_a_module_that_is_imported_can_be_taken(tmp_path):
    with replace(RIGHT, env=f"tests.registered:{ThreeWays.id}").begin(tmp_path).folder as folder:
        assert folder.config.env == f"tests.registered:{ThreeWays.id}"


def test_only_these_settings_name_files_or_modules():
    """A new setting that is a text may name a file, too: see that the form looks at it."""
    texts_of = {name for name, field in Config.model_fields.items() if field.annotation is str}
    assert texts_of == {"env", "method", "user"}


def test_the_environments_are_those_that_any_process_knows_and_the_one_that_is_open():
    assert environments()["mo-hopper-v5"] == ("speed", "height", "energy") and ThreeWays.id not in environments()
    name = f"tests.registered:{ThreeWays.id}"
    assert environments(name)[name] == ("north", "east", "west")
    assert list(environments("mo-hopper-v5")) == list(environments())
    assert Form().env in environments() and Form().preset in PRESETS


def test_every_way_of_asking_has_words():
    fields = Config.model_fields
    assert set(words.ASK) == set(fields["ask"].annotation.__args__)
    assert set(words.QUESTION) == set(fields["question"].annotation.__args__)

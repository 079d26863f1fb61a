"""Settings: every problem is named at once, every setting matters, and a config survives its own file."""

import re
from pathlib import Path

import pytest

from jmorl.config import Config, ConfigError, Section, resolve
from jmorl.config_format import WITHOUT_EFFECT


def fields(section, prefix=""):
    """Every setting as (dotted name, default)."""
    for name, field in section.model_fields.items():
        if isinstance(field.annotation, type) and issubclass(field.annotation, Section):
            yield from fields(field.annotation, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", field.default


SETTINGS = dict(fields(Config))

# A valid value other than the default for each setting; a new setting without one fails the test below.
OTHER = {
    "env": "mo-halfcheetah-v5",
    "method": "pgmorl",
    "user": "B",
    "ask": "always",
    "question": "few",
    "seed": 2,
    "population.agents": 4,
    "population.warmup_iterations": 5,
    "population.iterations": 5,
    "population.weights": (1.0, 0.0, 3.0, 1.0, 0.5, 0.5, 0.0, 1.0, 1.0, 2.0, 1.0, 1.0),
    "ppo.environments": 8,
    "ppo.rollout_steps": 2000,
    "ppo.epochs": 5,
    "ppo.minibatches": 16,
    "ppo.learning_rate": 2e-3,
    "ppo.final_learning_rate": 1e-4,
    "ppo.adam_epsilon": 1e-8,
    "ppo.discount": 0.98,
    "ppo.gae_lambda": 0.9,
    "ppo.clip": 0.1,
    "ppo.value_coefficient": 1.0,
    "ppo.entropy_coefficient": 0.01,
    "ppo.action_bound_coefficient": 0.5,
    "ppo.max_gradient_norm": 1.0,
    "ppo.initial_log_std": -0.5,
    "ppo.noise_correlation": 0.2,
    "ppo.hidden_sizes": (32,),
    "ppo.weights_on": "scaled",
    "evaluation.episodes": 8,
    "evaluation.actions": "sampled",
    "evaluation.units": "paper",
    "evaluation.scale_discount": 0.99,
    "evaluation.confirmation_episodes": 32,
    "search.delta": 0.3,
    "search.least_slack": 0.05,
    "search.least_within": 4,
    "search.outside_share": 0.5,
    "search.optimism": 0.5,
    "search.final_blends": 4,
    "search.bounds_scale": "one",
    "search.gain_within": "front",
    "search.value_scale": "none",
    "search.sparsity_weight": 0.5,
    "search.weight_divisions": 5,
    "search.buffer_bins": 50,
    "search.buffer_size": 2,
    "checkpoints.keep": 3,
    "steps": 5_000_000,
    "reference_point": (-500.0, -500.0),
}


def nested(name, value):
    for part in reversed(name.split(".")):
        value = {part: value}
    return value


def test_every_setting_has_another_value_here():
    assert set(SETTINGS) == set(OTHER)


@pytest.mark.parametrize("name", OTHER)
def test_every_setting_that_changes_results_changes_the_identity_and_survives_the_file(name, tmp_path):
    changed = resolve().replace(**nested(name, OTHER[name]))
    assert (changed.identity() == resolve().identity()) == (name in WITHOUT_EFFECT)
    file = tmp_path / "config.toml"
    file.write_text(changed.to_toml())
    assert resolve(file=file) == changed


@pytest.mark.parametrize("name", SETTINGS)
def test_every_setting_is_used_outside_the_config(name):
    """The authors' `gamma` never reached their agents."""
    attribute = name.rpartition(".")[2]
    sources = [path for path in Path("jmorl").rglob("*.py") if path.name != "config.py"]
    used = re.compile(rf"(config|search|ppo|population|evaluation|checkpoints)\.{attribute}\b")
    budget = {"steps": "iteration_budget", "ppo.final_learning_rate": r"config\.learning_rate\("}
    used = re.compile(budget[name]) if name in budget else used
    assert any(used.search(path.read_text()) for path in sources)


def test_all_problems_are_named_at_once():
    overrides = {
        "env": "mo-nowhere-v0",
        "method": "magic",
        "user": "Z",
        "seed": "-1",
        "population": {"agents": "0", "iterations": "2.5"},
        "ppo": {"environments": "3", "rollout_steps": "7", "minibatches": "32", "discount": "1.5", "epochs": "many"},
        "search": {"unheard_of": "1"},
        "steps": "-5",
    }
    with pytest.raises(ConfigError) as error:
        resolve("fancy", overrides=overrides)
    problems = error.value.problems
    for expected in (
        "preset: unknown preset 'fancy'; known: default, paper",
        "env: unknown environment 'mo-nowhere-v0'; known: mo-",
        "method: ",
        "user: unknown user 'Z'",
        "seed: ",
        "population.agents: ",
        "population.iterations: ",
        "ppo.minibatches: 32 minibatches do not divide a batch of E*T = 21 steps",
        "ppo.discount: ",
        "ppo.epochs: ",
        "search.unheard_of: ",
        "steps: ",
    ):
        assert [problem for problem in problems if problem.startswith(expected)], expected
    assert len(problems) == 12


@pytest.mark.parametrize(
    ("overrides", "problem"),
    [
        ({"user": "target=1,2,3"}, "user: target must have one number for each of 2 objectives, not 3"),
        ({"user": "weights=1"}, "user: weights must have one number for each of 2 objectives, not 1"),
        ({"reference_point": "1,2,3"}, "reference_point: 3 values for 2 objectives"),
        ({"steps": "240000"}, "steps: 240000 steps end within the warm-up; a first generation starts at 264000"),
        ({"ppo": {"learning_rate": "nan"}}, "ppo.learning_rate: "),
        ({"ppo": {"hidden_sizes": "32,-1"}}, "ppo.hidden_sizes.1: "),
    ],
)
def test_one_problem_one_sentence(overrides, problem):
    with pytest.raises(ConfigError, match=re.escape(problem)) as error:
        resolve(overrides=overrides)
    assert len(error.value.problems) == 1


def test_flags_override_the_file_and_the_file_the_preset(tmp_path):
    file = tmp_path / "config.toml"
    file.write_text('user = "B"\n[ppo]\nepochs = 3\nenvironments = 8\n')
    config = resolve("paper", file, {"ppo": {"epochs": "4"}})
    assert (config.user, config.ppo.epochs, config.ppo.environments) == ("B", 4, 8)
    assert config.ppo.discount == resolve("paper").ppo.discount


@pytest.mark.parametrize("content", ["not toml at all [", None])
def test_a_config_file_that_cannot_be_read_is_named(tmp_path, content):
    file = tmp_path / "config.toml"
    if content is not None:
        file.write_text(content)
    with pytest.raises(ConfigError, match=f"config: cannot read {re.escape(str(file))}"):
        resolve(file=file)


def test_the_paper_preset_has_the_papers_sizes():
    config = resolve("paper")
    assert (config.population.agents, config.ppo.environments, config.ppo.rollout_steps) == (6, 4, 1000)
    assert (config.population.warmup_iterations, config.population.iterations) == (10, 10)
    assert config.steps_per_iteration * config.population.iterations == 240_000
    assert config.iteration_budget == 104  # so 2.5 M steps end after 2.64 M
    assert (config.ppo.discount, config.ppo.gae_lambda, config.search.delta) == (0.995, 0.95, 0.1)


def test_the_learning_rate_falls_with_the_share_of_the_budget_that_is_used():
    config = resolve().replace(ppo={"learning_rate": 1e-3, "final_learning_rate": 1e-4})
    budget = config.iteration_budget
    assert [config.learning_rate(done) for done in (0, budget // 2, budget, budget + 10)] == pytest.approx(
        [1e-3, 5.5e-4, 1e-4, 1e-4]
    )


def test_a_config_cannot_be_changed_in_place():
    with pytest.raises(ValueError, match="frozen"):
        Config().seed = 3


@pytest.mark.parametrize(
    ("overrides", "problem"),
    [
        ({"agents": 4}, "agents: there is no such setting; did you mean 'population.agents'?"),
        ({"ppo": {"epoch": 4}}, "ppo.epoch: there is no such setting; did you mean 'ppo.epochs'?"),
        ({"usr": "A"}, "usr: there is no such setting; did you mean 'user'?"),
        ({"xyz": 1}, "xyz: there is no such setting"),
        ({"method": "interactve"}, "; did you mean 'interactive'?"),
        ({"evaluation": {"units": "papr"}}, "must be 'raw' or 'paper', not 'papr'; did you mean 'paper'?"),
        ({"env": "mo-mountaincar-v0"}, "; did you mean 'mo-mountaincarcontinuous-v0'?"),
        ({"user": "weight=1,2"}, "terminal; script=FILE; did you mean 'weights'?"),
        ({"user": "b"}, "script=FILE; did you mean 'B'?"),
        ({"ppo": {"epochs": "9" * 20}}, "ppo.epochs: must be at most 2147483647, not"),
        ({"ppo": {"clip": 1e300}}, "ppo.clip: must be at most 3.4028234663852886e+38, not 1e+300"),
        ({"ppo": {"epochs": "x"}}, "ppo.epochs: must be a whole number, not 'x'"),
        ({"ppo": {"epochs": 1.5}}, "ppo.epochs: must be a whole number, not 1.5"),
        ({"ppo": {"clip": "nan"}}, "ppo.clip: must be a finite number, not 'nan'"),
        ({"ppo": {"hidden_sizes": "0"}}, "ppo.hidden_sizes.0: must be at least 1, not '0'"),
        ({"ppo": {"hidden_sizes": ""}}, "ppo.hidden_sizes: must be 1 number or more, not []"),
        ({"ppo": 3}, "ppo: must be a section, with settings of its own, not 3"),
    ],
)
def test_what_is_unknown_or_too_large_says_what_would_do(overrides, problem):
    with pytest.raises(ConfigError, match=re.escape(problem)) as error:
        resolve(overrides=overrides)
    assert len(error.value.problems) == 1


def test_settings_may_be_named_by_section(tmp_path):
    file = tmp_path / "config.toml"
    file.write_text('"ppo.rollout-steps" = 64\n[ppo]\nepochs = 3\n', encoding="utf-8")
    config = resolve(file=file, overrides={"population.agents": 2, "ppo": {"clip": 0.3}})
    assert (config.population.agents, config.ppo.epochs, config.ppo.rollout_steps, config.ppo.clip) == (2, 3, 64, 0.3)
    with pytest.raises(ConfigError, match="epochs is given twice"):
        resolve(overrides={"ppo.epochs": 2, "ppo": {"epochs": 3}})


def test_a_file_in_another_encoding_is_named(tmp_path):
    file = tmp_path / "config.toml"
    file.write_bytes("# größer".encode("latin-1"))
    with pytest.raises(ConfigError, match="config.toml: it is not a text in UTF-8, as TOML has to be"):
        resolve(file=file)


def test_an_unknown_preset_names_the_nearest():
    with pytest.raises(ConfigError, match="known: default, paper; did you mean 'paper'?"):
        resolve("papr")


def test_a_budget_of_steps_may_be_larger_than_what_programs_count():
    assert resolve(overrides={"steps": str(10**11)}).steps == 10**11


@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
def test_a_file_may_begin_with_a_byte_order_mark_and_write_settings_as_flags_are(tmp_path, mark):
    file = tmp_path / "config.toml"
    file.write_bytes(mark + b"[population]\nwarmup-iterations = 3\n[ppo]\nrollout-steps = 64\nlearning_rate = 0.5\n")
    config = resolve(file=file)
    assert (config.population.warmup_iterations, config.ppo.rollout_steps, config.ppo.learning_rate) == (3, 64, 0.5)


def test_a_setting_that_is_written_in_both_ways_is_refused(tmp_path):
    file = tmp_path / "config.toml"
    file.write_text("[population]\nwarmup-iterations = 3\nwarmup_iterations = 4\n")
    with pytest.raises(ConfigError, match="cannot read .*: warmup_iterations is given twice"):
        resolve(file=file)

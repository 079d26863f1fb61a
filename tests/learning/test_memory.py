"""The estimate of memory against real shapes and compiled programs, and what is refused for it."""

import jax
import pytest

from jmorl.cli import main
from jmorl.config import Config
from jmorl.learning import memory
from jmorl.learning.memory import DoesNotFit, check_memory, machine_memory, needed_memory
from jmorl.learning.moppo import MOPPO
from jmorl.learning.programs import Programs
from tests.probes import ThreeWays

SMALL = {
    "population": {"agents": 2},
    "ppo": {"environments": 2, "rollout_steps": 16, "minibatches": 2, "epochs": 1, "hidden_sizes": (8,)},
    "evaluation": {"episodes": 2},
    "steps": 10**9,
}


def config(**sections):
    return Config(**SMALL).replace(**sections).learning


@pytest.mark.parametrize("hidden", [(8,), (30, 20), (5, 5, 5)])
def test_the_state_is_counted_to_the_last_few_numbers(hidden):
    settings = config(ppo={"hidden_sizes": hidden}, population={"agents": 3})
    state = jax.eval_shape(MOPPO(ThreeWays(), settings.ppo).initial_train_state, jax.random.key(0))
    real = 3 * sum(leaf.size * leaf.dtype.itemsize for leaf in jax.tree.leaves(state))
    needed = needed_memory(ThreeWays(), settings).state
    assert 0 < real - needed < 3 * 200  # log-std, running statistics and a counter are left out


@pytest.mark.slow
@pytest.mark.parametrize(
    "large",
    [
        {"ppo": {"hidden_sizes": (400, 400)}},
        {"ppo": {"rollout_steps": 20_000}},
        {"evaluation": {"episodes": 20_000}},
        {"evaluation": {"episodes": 20_000, "units": "paper", "actions": "sampled"}},
    ],
)
def test_the_compiled_programs_need_what_is_estimated_and_less_than_eight_times_that(large):
    settings = config(**large)
    programs = Programs(ThreeWays(), settings)
    programs.compile()
    real = max(
        programs.devices * (use.argument_size_in_bytes + use.output_size_in_bytes + use.temp_size_in_bytes)
        for use in (programs._train.memory_analysis(), programs._evaluate.memory_analysis())
    )
    estimate = needed_memory(ThreeWays(), settings).on_devices
    assert estimate <= real <= 8 * estimate


def test_two_runs_in_a_program_need_twice_as_much():
    once, twice = (needed_memory(ThreeWays(), config(), runs) for runs in (1, 2))
    assert (twice.on_devices, twice.on_host) == (2 * once.on_devices, 2 * once.on_host)


@pytest.mark.parametrize(
    ("large", "named", "others"),
    [
        ({"ppo": {"hidden_sizes": (10**6, 10**6)}}, "population.agents, ppo.hidden_sizes", "evaluation.episodes"),
        ({"ppo": {"rollout_steps": 2 * 10**9}, "steps": 10**12}, "ppo.environments, ppo.rollout_steps", "hidden_sizes"),
        ({"evaluation": {"episodes": 2 * 10**9}}, "evaluation.episodes", "hidden_sizes"),
    ],
)
def test_what_cannot_fit_is_refused_with_the_settings_that_make_it_large(large, named, others):
    with pytest.raises(DoesNotFit) as error:
        check_memory(ThreeWays(), config(**large))
    assert named in str(error.value) and others not in str(error.value)
    assert f"there are {machine_memory() / 1e9:,.1f} GB on this machine" in str(error.value)


def test_a_run_fits_into_just_what_it_needs(monkeypatch):
    needed = needed_memory(ThreeWays(), config())
    whole = needed.on_devices + needed.on_host - needed.state
    monkeypatch.setattr(memory, "machine_memory", lambda: whole)
    check_memory(ThreeWays(), config())
    monkeypatch.setattr(memory, "machine_memory", lambda: whole - 1)
    with pytest.raises(DoesNotFit):
        check_memory(ThreeWays(), config())


@pytest.mark.parametrize("sizes", ["200000,200000", "2000000000,2000000000"])
def test_a_run_that_cannot_fit_makes_nothing(sizes, tmp_path, capsys):
    out = tmp_path / "run"
    arguments = ["train", "--env", "tests.registered:probe-three-ways", "--user", "weights=1,1,1"]
    assert main([*arguments, "--ppo.hidden-sizes", sizes, "--out", str(out)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("jmorl: the run needs ") and "ppo.hidden_sizes" in line
    assert not out.exists()


def test_limits_of_control_groups_of_both_versions_and_all_levels_count(tmp_path):
    groups, mounted = tmp_path / "cgroup", tmp_path / "fs"
    groups.write_text("4:cpu,memory:/one\n3:cpu:/one\n0::/two/three\n")
    files = {"memory/one/memory.limit_in_bytes": "900\n", "two/three/memory.max": "max\n", "two/memory.max": "700\n"}
    for name, text in files.items():
        (mounted / name).parent.mkdir(parents=True, exist_ok=True)
        (mounted / name).write_text(text)
    assert sorted(memory._group_limits(groups, mounted)) == [700, 900]
    assert not list(memory._group_limits(tmp_path / "nowhere", mounted))

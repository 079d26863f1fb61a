"""Brax's own environments. Compiling one takes a minute, so all but messages are tested with the slow ones."""

import subprocess
import sys

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import envs
from envs.adapted import Adapted, their_way
from envs.brax import GROUPS
from envs.checks import check_environment
from jmorl.cli import main

BACKENDS = {"ant": "spring", "pusher": "positional", "humanoid": "spring"}  # which compile fastest
SMALL = ["--population.agents", "2", "--population.warmup-iterations", "2", "--population.iterations", "1"]
SMALL += ["--ppo.environments", "4", "--ppo.rollout-steps", "64", "--evaluation.episodes", "2"]


@pytest.mark.parametrize(
    ("id", "message"),
    [
        ("brax:antt", "Brax has no 'antt'; it has ant, .*walker2d; did you mean 'ant'?"),
        (
            "brax:halfcheetah,objectives=reward_ctr/x",
            "no term 'reward_ctr'; did you mean 'reward_ctrl'.*'x'.*reward_run",
        ),
        (
            "brax:ant,colour=red",
            "there is no option 'colour'; the options there are: objectives, time_limit, backend, .*healthy_reward",
        ),
        ("brax:ant,backend=magic", "Brax refuses it: ValueError: backend should be in"),
        ("brax:ant,time_limit=0", "time_limit must be a whole number above zero, not '0'"),
        ("brax:ant,name=x", "there is no option 'name'.*; the options"),
        ("brax:ant,healthy_z_range=(0.2,1.0),colour=red", "there is no option 'colour'"),
        ("brax:reacher,n_frames=0", "a step must take some time"),
        ("brax:fast", "Brax has no 'fast'"),
        ("brax:", "Brax has no ''; it has ant"),
    ],
)
def test_what_is_wrong_is_named(id, message):
    with pytest.raises(ValueError, match=message):
        envs.make(id)


def test_all_that_is_wrong_is_named_at_once():
    with pytest.raises(ValueError) as error:
        envs.make("brax:ant,backnd=spring,colour=red,time_limit=0,objectives=reward_ctr/reward_forward")
    for said in (
        "'backnd'; did you mean 'backend'?",
        "no option 'colour'",
        "time_limit must be",
        "no term 'reward_ctr'",
    ):
        assert said in str(error.value)


def test_an_environment_is_made_once_and_takes_options_of_theirs():
    id = "brax:reacher,time_limit=50,backend=spring"
    environment = envs.make(id)
    assert isinstance(environment, Adapted)
    assert envs.make(id) is environment and environment.id == "brax:reacher"
    assert environment.time_limit == 50 and environment.theirs.backend == "spring"
    assert [objective.name for objective in environment.objectives] == ["distance", "energy"]


def test_importing_ours_does_not_import_theirs():
    code = "import envs, sys; [envs.make(id) for id in envs.ids()]; print(*{'brax', 'mujoco'} & set(sys.modules))"
    finished = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (finished.returncode, finished.stdout) == (0, "\n"), finished.stderr


@pytest.mark.slow
@pytest.mark.parametrize("name", GROUPS)
def test_the_default_groups_add_up_to_their_reward(name):
    backend = BACKENDS.get(name, "generalized")
    environment = envs.make(f"brax:{name},backend={backend}")
    assert isinstance(environment, Adapted)
    theirs = environment.theirs

    def step(state, action):
        found = environment.transition(state, action)
        return found.state, (found.reward, found.state.reward)

    @jax.jit
    def steps(key):
        actions = jax.random.uniform(key, (5, environment.action_size), minval=-1.0)
        return jax.lax.scan(step, theirs.reset(key), actions)[1]

    with their_way():
        ours, whole = steps(jax.random.PRNGKey(0))
    assert np.isfinite(ours).all() and np.abs(ours).max() > 0
    np.testing.assert_allclose(ours.sum(axis=1), whole, rtol=1e-5, atol=1e-5)


@pytest.mark.slow
def test_it_keeps_the_contract():
    environment = envs.make("brax:reacher,backend=spring,time_limit=3")
    check_environment(environment, envs.make_anew("brax:reacher,backend=spring,time_limit=3"))
    keys = jax.random.split(jax.random.key(0), 4)
    state, first = jax.vmap(environment.reset)(keys)
    assert len(np.unique(first, axis=0)) > 1
    step = jax.jit(jax.vmap(environment.step))
    for number in range(1, 5):
        state, result = step(keys, state, jnp.ones((4, environment.action_size)))
        assert result.reward.shape == (4, 2) and result.reward.dtype == result.observation.dtype == jnp.float32
        np.testing.assert_array_equal(result.truncated, [number == 3] * 4)
        np.testing.assert_array_equal(state.elapsed_steps, [number % 3] * 4)


@pytest.mark.slow
def test_an_ant_trains_from_the_command_line(tmp_path, capsys):
    id = "brax:ant,backend=spring,time_limit=50,objectives=forward_reward+reward_survive/reward_ctrl"
    out = str(tmp_path / "ant")
    assert main(["train", "--env", id, *SMALL, "--steps", "2048", "--out", out, "--quiet"]) == 0
    assert main(["show", out]) == 0
    shown = capsys.readouterr().out
    assert "forward_reward+survive" in shown and "ctrl" in shown
    assert main(["evaluate", out, "--episodes", "2"]) == 0

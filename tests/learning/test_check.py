"""What would stop a run's programs is said before anything is made."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import envs
from envs import NotAsDeclared
from jmorl.cli import main
from jmorl.learning.check import check_run
from jmorl.storage.run_folder import RunFolder
from tests.probes import Ending, OneStep, ThreeWays


class Outside(ThreeWays):
    """Each of its functions can be traced alone; a batch of them cannot."""

    id = "outside-v0"

    def observe(self, state):
        return jax.pure_callback(np.asarray, jax.ShapeDtypeStruct((2,), np.float32), state)


class Chance(ThreeWays):
    id = "chance-v0"

    def initial_state(self, key):
        return jnp.asarray(np.random.normal(size=2), jnp.float32)  # noqa: NPY002


class Drawn(ThreeWays):
    id = "drawn-v0"

    def __init__(self):
        self.shift = np.random.default_rng().normal()

    def observe(self, state):
        return state + self.shift


class Halfway(ThreeWays):
    id = "halfway-v0"

    def transition(self, state, action):
        result = super().transition(state, action)
        return result._replace(reward=[*result.reward])


class Keeping(ThreeWays):
    """Keeps what it computed while it was traced."""

    id = "keeping-v0"

    def transition(self, state, action):
        self.kept = state + action
        return super().transition(state, action)


def check(environment, config):
    check_run(environment, config.learning, envs.make_anew(config.env))


@pytest.fixture
def registered(monkeypatch, small_config):
    """Registers an environment for the test; gives a small config of it."""

    def register(factory, id=None):
        id = id or factory.id
        monkeypatch.setitem(envs.registry, id, factory)
        objectives = len(envs.make(id).objectives)
        weights = ",".join(["1"] * objectives)
        return small_config.replace(env=id, user=f"weights={weights}")

    return register


@pytest.mark.parametrize("kind", [OneStep, ThreeWays])
def test_what_can_be_trained_passes(registered, kind):
    check(kind(), registered(kind))


def test_what_stops_the_programs_is_named(registered):
    with pytest.raises(NotAsDeclared, match="^the program for training in environment outside-v0 cannot be built: "):
        check(Outside(), registered(Outside))
    envs.check_environment(Outside())


def test_an_environment_is_traced_once_for_equal_settings(registered, monkeypatch):
    config, environment, calls = registered(OneStep), OneStep(), []
    monkeypatch.setattr(OneStep, "observe", lambda self, state: calls.append(self) or state[None])
    check(environment, config)
    first = len(calls)
    check(environment, config.replace(seed=7))
    assert len(calls) == first
    check(environment, config.replace(ppo={"epochs": 1}))
    assert len(calls) > first


def test_one_that_is_drawn_anew_when_it_is_made_is_named(registered):
    with pytest.raises(NotAsDeclared, match="drawn-v0 is another one each time it is made: observe differs"):
        check(Drawn(), registered(Drawn))


@pytest.mark.parametrize(
    ("evaluation", "numbers"),
    [({"units": "paper"}, 2), ({"actions": "sampled"}, 1), ({"units": "paper", "actions": "sampled"}, 3)],
)
def test_what_must_be_kept_of_every_step_up_to_the_limit_is_refused_by_its_size(registered, evaluation, numbers):
    config = registered(Ending).replace(evaluation=evaluation)
    check(Ending("1000000"), config)
    gigabytes = 4 * numbers * 10**9 * 2 * 4 / 2**30  # two episodes of each of four agents
    with pytest.raises(NotAsDeclared, match=f"up to 1,000,000,000 steps for each of 4 agents take {gigabytes:.0f} GiB"):
        check(Ending("1000000000"), config)
    check(Ending("1000000000"), registered(Ending))  # of which nothing is kept


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        (Outside, "the program for training in environment outside-v0 cannot be built"),
        (Chance, "environment chance-v0 is not pure: initial_state"),
        (Halfway, "environment halfway-v0 is not as it declares: reward is a list of 3"),
    ],
)
def test_a_run_that_cannot_begin_makes_nothing(registered, tmp_path, capsys, kind, message):
    config = registered(kind)
    with pytest.raises(NotAsDeclared, match=message):
        RunFolder.create(tmp_path / "made", config, kind())
    assert main(["train", "--env", kind.id, "--user", config.user, "--out", str(tmp_path / "trained")]) == 2
    printed = capsys.readouterr().err
    assert printed.startswith(f"jmorl: {message}") and printed.count("\n") == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("id", envs.ids())
def test_nothing_of_a_trace_outlives_it(id, small_config):
    with jax.checking_leaks():
        check_run(envs.make_anew(id), small_config.learning)


def test_what_outlives_a_trace_would_be_found(small_config):
    with jax.checking_leaks(), pytest.raises(NotAsDeclared, match="Leaked"):
        check_run(Keeping(), small_config.learning)

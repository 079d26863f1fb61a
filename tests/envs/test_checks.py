"""Environments that break the contract are told everything that is wrong with them, before they are used."""

import jax.numpy as jnp
import pytest

import envs
from envs import NotAsDeclared, Transition, check_environment
from tests.probes import OneStep, ThreeWays, objectives


class Otherwise(ThreeWays):
    """Nothing is as declared."""

    def initial_state(self, key):
        return {"at": jnp.zeros(2), "steps": jnp.zeros((), jnp.int32)}

    def observe(self, state):
        return jnp.zeros(3)

    def transition(self, state, action):
        return Transition({"at": jnp.zeros(1), "steps": state["steps"] + 1.0}, jnp.zeros(2), jnp.zeros(1))


class Growing(ThreeWays):
    def transition(self, state, action):
        return super().transition(state, action)._replace(state=(state, state))


class Crashing(ThreeWays):
    def transition(self, state, action):
        return super().transition(state @ state.missing, action)


class Counting(OneStep):
    """A state that begins as a Python number takes the type that it is given."""

    def initial_state(self, key):
        return 0

    def observe(self, state):
        return jnp.asarray(state, jnp.float32)[None]

    def transition(self, state, action):
        return super().transition(state + jnp.float32(1), action)


@pytest.mark.parametrize("id", envs.ids())
def test_the_environments_here_are_as_they_declare(id):
    check_environment(envs.make(id))


def test_an_environment_is_traced_once(monkeypatch):
    traced = []
    monkeypatch.setattr(ThreeWays, "observe", lambda self, state: traced.append(self) or state)
    first, second = ThreeWays(), ThreeWays()
    for environment in (first, first, second):
        check_environment(environment)
    assert traced == [first, second]


def test_a_state_may_begin_as_a_number():
    check_environment(Counting())


def test_everything_that_is_not_as_declared_is_named_at_once():
    with pytest.raises(NotAsDeclared) as error:
        check_environment(Otherwise())
    assert str(error.value) == (
        "environment probe-three-ways is not as it declares: observation has shape (3,), not (2,); reward has shape "
        "(2,), not (3,); terminated has shape (1,), not (); terminated is float32, not bool; state['at'] has shape "
        "(1,) after a step, not (2,); state['steps'] is float32 after a step, not int32"
    )


def test_a_state_of_other_parts_is_named():
    with pytest.raises(NotAsDeclared, match="the state after a step has other parts than that of a reset"):
        check_environment(Growing())


def test_what_an_environment_raises_is_named_with_its_line():
    with pytest.raises(NotAsDeclared, match=r"breaks down: AttributeError: .*missing.*\(test_checks.py, line \d+\)"):
        check_environment(Crashing())


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"objectives": objectives("alone")}, "there must be 2 objectives or more, not 1"),
        ({"objectives": objectives("twin", "twin")}, "two objectives have the same name"),
        ({"objectives": ("time", "fuel")}, "objectives are not all of the kind envs.Objective"),
        ({"action_size": None, "time_limit": 0}, "action_size is None, .* above zero; time_limit is 0, not a whole"),
    ],
)
def test_a_declaration_that_cannot_be_is_refused_when_it_is_made(monkeypatch, changes, message):
    made = type("Made", (ThreeWays,), {"id": "made-v0", **changes})
    monkeypatch.setattr(envs, "_registry", {"made-v0": made})
    with pytest.raises(NotAsDeclared, match=f"environment made-v0 declares what cannot be: .*{message}"):
        envs.make("made-v0")
    with pytest.raises(NotAsDeclared, match=message):
        check_environment(made())

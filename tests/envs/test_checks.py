"""Environments that break the contract are told everything that is wrong with them, before they are used."""

import random
import sys

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import envs
from envs import NotAsDeclared, Transition, check_environment
from tests.probes import OneStep, ThreeWays, UnevenBox, objectives


class Otherwise(ThreeWays):
    """Nothing is as declared."""

    def initial_state(self, key):
        return {"at": jnp.zeros(2), "steps": jnp.zeros((), jnp.int32)}

    def observe(self, state):
        return jnp.zeros(3)

    def transition(self, state, action):
        return Transition({"at": jnp.zeros(1), "steps": jnp.float32(state["steps"]) + 1.0}, jnp.zeros(2), jnp.zeros(1))


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


def test_an_environment_is_checked_once(monkeypatch):
    traced = []
    monkeypatch.setattr(ThreeWays, "observe", lambda self, state: traced.append(self) or state)
    first, second = ThreeWays(), ThreeWays()
    for environment in (first, first, second):
        check_environment(environment)
    assert traced == [first, first, second, second]


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


class Giving(ThreeWays):
    """Gives what it is told to, in one of three places."""

    def __init__(self, **gives):
        self.gives = gives

    def observe(self, state):
        return self.gives.get("observation", super().observe)(state)

    def transition(self, state, action):
        result = super().transition(state, action)
        fields = {name: give(getattr(result, name)) for name, give in self.gives.items() if hasattr(result, name)}
        return self.gives.get("transition", lambda result: result)(result._replace(**fields))


KINDS = [np.int32, np.int8, np.bool_, np.float16, jnp.bfloat16]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("where", ["observation", "reward"])
def test_numbers_of_any_kind_become_float32(where, kind):
    numbers = {"observation": [0, 1], "reward": [1, 0, 1]}[where]
    environment = Giving(**{where: lambda _: jnp.array(numbers, kind)})
    check_environment(environment)
    state, first = environment.reset(jax.random.key(0))
    _, step = environment.advance(state, jnp.zeros(2))
    for array in (first, step.observation) if where == "observation" else (step.reward,):
        assert array.dtype == jnp.float32 and not array.weak_type
        np.testing.assert_array_equal(array, numbers)


@pytest.mark.parametrize("terminated", [True, False, np.True_, np.array(False), jnp.array(True)])
def test_terminated_may_be_pythons_numpys_or_jaxs(terminated):
    environment = Giving(terminated=lambda _: terminated)
    check_environment(environment)
    _, step = environment.advance(environment.reset(jax.random.key(0))[0], jnp.zeros(2))
    assert step.terminated.dtype == step.truncated.dtype == bool
    assert (bool(step.terminated), bool(step.truncated)) == (bool(terminated), False)


def test_sizes_may_be_numpys():
    sizes = {"observation_size": np.prod((1, 2)), "action_size": np.int64(2), "time_limit": np.uint16(9)}
    environment = type("Sized", (ThreeWays,), sizes)()
    check_environment(environment)
    assert environment.action_box.low.shape == (2,)


def test_bounds_may_differ_from_component_to_component():
    check_environment(UnevenBox())


@pytest.mark.parametrize(
    ("gives", "message"),
    [
        ({"observation": lambda x: {"at": x}}, r"observation is a dict, not one array of shape \(2,\): concatenate"),
        ({"observation": lambda x: (x, x)}, r"observation is a tuple of 2, not one array of shape \(2,\)"),
        ({"observation": lambda x: x.astype(jnp.complex64)}, "observation is complex64, not real numbers"),
        ({"reward": list}, r"reward is a list of 3, not one array of shape \(3,\): stack the objectives"),
        ({"reward": lambda r: {"north": r[0]}}, r"reward is a dict, not one array of shape \(3,\)"),
        ({"reward": lambda r: None}, r"reward is None, not one array of shape \(3,\)"),
        ({"reward": lambda r: r[:, None]}, r"reward has shape \(3, 1\), not \(3,\)"),
        ({"reward": lambda r: r.sum()}, r"reward has shape \(\), not \(3,\)"),
        ({"terminated": lambda _: jnp.zeros(())}, "terminated is float32, not bool"),
        ({"terminated": lambda _: 1}, "terminated is int32, not bool"),
        ({"terminated": lambda _: None}, "terminated is None, not True or False"),
        (
            {"transition": lambda r: (r.state, r.reward, r.terminated, {})},
            r"transition gives a tuple of 4, not Transition\(state, reward, terminated\)",
        ),
        ({"transition": lambda r: (*r, False, {})}, "transition gives a tuple of 5, not Transition"),
        ({"transition": lambda r: r.state}, "transition gives an array, not Transition"),
        ({"transition": lambda r: r._asdict()}, "transition gives a dict, not Transition"),
    ],
)
def test_what_is_of_another_kind_is_named_with_what_it_should_be(gives, message):
    with pytest.raises(NotAsDeclared, match=f"^environment probe-three-ways is not as it declares: {message}"):
        check_environment(Giving(**gives))


class KeepsTheGoal(ThreeWays):
    def initial_state(self, key):
        self.goal = jax.random.uniform(key, (2,))
        return super().initial_state(key)

    def observe(self, state):
        return state - self.goal


class KeepsTheLastState(ThreeWays):
    def observe(self, state):
        return state + self.memory["last"] if hasattr(self, "memory") else state

    def transition(self, state, action):
        self.memory = {"last": state}
        return super().transition(state, action)


class CountsItsCalls(ThreeWays):
    calls = 0

    def transition(self, state, action):
        self.calls += 1
        result = super().transition(state, action)
        return result._replace(reward=result.reward * self.calls)


class StartsByNumpysChance(ThreeWays):
    def initial_state(self, key):
        return jnp.asarray(np.random.uniform(-1, 1, 2), jnp.float32)  # noqa: NPY002


class LooksAskew(ThreeWays):
    """What changes is within a function of JAX, and too long to be printed."""

    def observe(self, state):
        noise = np.full(3000, random.random(), np.float32)
        return jax.lax.fori_loop(0, 3, lambda _, seen: seen + noise.sum(), state)


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        (KeepsTheGoal, "initial_state keeps a number in self.goal; .* belongs in `state`, .* comes from `key`$"),
        (KeepsTheLastState, "transition keeps a number in self.memory; "),
        (CountsItsCalls, "transition computes something else each time it is called; randomness comes from `key`, and"),
        (StartsByNumpysChance, "initial_state computes something else each time it is called"),
        (LooksAskew, "observe computes something else each time it is called"),
    ],
)
def test_a_function_that_is_not_pure_is_named(kind, message):
    with pytest.raises(NotAsDeclared, match=f"^environment probe-three-ways is not pure: {message}"):
        check_environment(kind())


def test_numbers_that_never_change_may_be_kept():
    class Prepared(ThreeWays):
        def __init__(self):
            self.table = np.random.default_rng(0).normal(size=3000).astype(np.float32)

        def observe(self, state):
            if not hasattr(self, "mean"):
                self.mean = float(self.table.mean())  # made when it is first needed
            return jax.nn.relu(state) + self.mean + self.table[:2]

    check_environment(Prepared(), Prepared())


def test_an_environment_that_is_another_one_when_it_is_made_again_is_named():
    class Drawn(ThreeWays):
        def __init__(self):
            self.corner = random.random()

        def observe(self, state):
            return state - self.corner

    check_environment(Drawn())
    with pytest.raises(NotAsDeclared, match="probe-three-ways is another one each time it is made: observe differs"):
        check_environment(Drawn(), Drawn())


@pytest.mark.parametrize(
    ("breaks", "message"),
    [
        (lambda x: np.sin(x), "TracerArrayConversionError: .*; use jax.numpy in place of numpy"),
        (lambda x: x if x[0] > 0 else -x, "TracerBoolConversionError: .*; use jnp.where in place of a condition"),
        (lambda x: sys.exit(0), "SystemExit: 0; it ends the program"),
        (lambda x: 1 / 0, "ZeroDivisionError: division by zero"),
    ],
)
def test_what_a_function_raises_is_one_line_with_advice_and_place(breaks, message):
    with pytest.raises(NotAsDeclared, match=rf"breaks down: {message} \(test_checks.py, line \d+\)$") as error:
        check_environment(Giving(observation=breaks))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"objectives": objectives("alone")}, "there must be 2 objectives or more, not 1"),
        ({"objectives": objectives("twin", "twin")}, "two objectives have the same name"),
        ({"objectives": ("time", "fuel")}, "objectives are not all of the kind envs.Objective"),
        ({"objectives": 2}, "objectives are 2, not a tuple"),
        ({"objectives": (envs.Objective("a", 1, "u"), envs.Objective("b", "b", "u"))}, "are not all texts"),
        ({"action_size": None, "time_limit": 0}, "action_size is None, .* above zero; time_limit is 0, not a whole"),
        ({"action_size": True}, "action_size is True, not a whole number"),
        ({"time_limit": 3_000_000_000}, "time_limit is 3000000000, more than 2147483647"),
        ({"time_limit": 1e3}, "time_limit is 1000.0, not a whole number"),
        ({"action_low": 1.0, "action_high": -1.0}, "action_low 1 is not below action_high -1 in component 0"),
        ({"action_low": 1.0}, "action_low 1 is not below action_high 1 in component 0"),
        ({"action_high": float("nan")}, r"action_high is not a number \(NaN\)"),
        ({"time_limit": 0, "action_low": 1.0}, "time_limit is 0, .*; action_low 1 is not below action_high 1"),
    ],
)
def test_a_declaration_that_cannot_be_is_refused_when_it_is_made(monkeypatch, changes, message):
    made = type("Made", (ThreeWays,), {"id": "made-v0", **changes})
    monkeypatch.setitem(envs.registry, "made-v0", made)
    with pytest.raises(NotAsDeclared, match=f"environment made-v0 declares what cannot be: .*{message}"):
        envs.make("made-v0")
    with pytest.raises(NotAsDeclared, match=message):
        check_environment(made())

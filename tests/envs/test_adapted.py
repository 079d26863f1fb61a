"""Terms of a reward as objectives, with an environment of Brax's form that is quick to compile."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from flax import struct

import envs
from envs.adapted import STARTS, adapt, literal, starts
from envs.checks import check_environment
from jmorl.cli import main


@struct.dataclass
class State:
    obs: dict[str, jax.Array]
    reward: jax.Array
    done: jax.Array
    metrics: dict[str, jax.Array]
    info: dict[str, jax.Array]


class Cart:
    """Writes into the dictionaries that it is given, counts in Python's numbers, and keeps a key: as theirs do."""

    action_size = 1
    dt = 0.1

    def reset(self, rng):
        rng, place_key = jax.random.split(rng)
        place = jax.random.uniform(place_key)
        zero = jnp.zeros(())
        metrics = {"reward/near": zero, "reward/effort": zero, "place": zero}
        return State({"state": place[None], "teacher": zero}, zero, zero, metrics, {"rng": rng, "place": place})

    def step(self, state, action):
        place = state.info["place"] + action[0]
        state.info["place"] = place
        state.metrics.update({"reward/near": -abs(place), "reward/effort": -(action[0] ** 2), "place": place})
        reward = state.metrics["reward/near"] + 0.5 * state.metrics["reward/effort"]
        return state.replace(obs={"state": place[None], "teacher": place}, reward=reward, done=1.0 * (place > 2))


DEFAULT = (("near:near", "-m·steps", 0.0), ("effort:0.5*effort", "-N²·steps", 0.0))


def cart(written=None, theirs=None):
    return adapt("library:cart", "A library", theirs or Cart(), written, DEFAULT, 7, [])


def stepped(environment, actions):
    state, _ = environment.reset(jax.random.key(0))
    advance = jax.jit(environment.advance)
    steps = []
    for action in actions:
        state, step = advance(state, jnp.array([action]))
        steps.append(step)
    return state, steps


def test_the_default_groups_add_up_to_their_reward():
    environment = cart()
    assert [objective.name for objective in environment.objectives] == ["near", "effort"]
    assert [objective.highest for objective in environment.objectives] == [0.0, 0.0]
    state, steps = stepped(environment, [0.5, -0.25])
    assert steps[1].reward.sum() == pytest.approx(float(state.physics.reward))
    np.testing.assert_allclose(steps[1].reward[1], -0.5 * 0.25**2)


def test_it_declares_what_it_is_and_keeps_the_contract():
    environment = cart()
    check_environment(environment, cart())
    assert (environment.id, environment.family) == ("library:cart", "A library")
    assert (environment.observation_size, environment.action_size, environment.time_limit) == (1, 1, 7)
    assert environment.step_seconds == 0.1


def test_groups_as_written():
    environment = cart("near+2*place/work:control/reward")
    names = [objective.name for objective in environment.objectives]
    assert names == ["near+place", "work", "reward"]
    assert all(objective.highest == math.inf for objective in environment.objectives)
    state, [step] = stepped(environment, [0.5])
    place = float(state.physics.info["place"])
    np.testing.assert_allclose(step.reward, [-abs(place) + 2 * place, -0.25, state.physics.reward], rtol=1e-6)


def test_it_ends_where_theirs_does_and_at_our_time_limit():
    _, steps = stepped(cart(), [1.0, 1.0, 1.0])
    assert [bool(step.terminated) for step in steps][-1]
    _, steps = stepped(cart(), [0.0] * 7)
    assert [bool(step.truncated) for step in steps] == [False] * 6 + [True]


def test_episodes_start_from_states_drawn_once():
    theirs = Cart()
    first, second = cart(theirs=theirs), cart("near/effort", theirs)
    keys = jax.random.split(jax.random.key(1), 5000)
    _, observations = jax.vmap(first.reset)(keys)
    assert len(starts(theirs).reward) == STARTS
    np.testing.assert_array_equal(np.unique(observations), np.unique(starts(theirs).info["place"]))
    np.testing.assert_array_equal(observations, jax.vmap(second.reset)(keys)[1])


def test_every_episode_draws_with_a_key_of_its_own():
    keys = jax.random.split(jax.random.key(1), 2000)
    states, _ = jax.vmap(cart().reset)(keys)
    own = states.physics.info["rng"]
    assert own.dtype == starts(Cart()).info["rng"].dtype and len(np.unique(own, axis=0)) == len(keys)


def test_terms_with_a_slash_can_be_written_and_ours_are_not_hidden():
    class Falling(Cart):
        def reset(self, rng):
            state = super().reset(rng)
            more = {"reward": state.reward, "termination/fall": state.reward}
            return state.replace(metrics=state.metrics | more)

    environment = cart("termination_fall/reward", Falling())
    assert [objective.name for objective in environment.objectives] == ["termination_fall", "reward"]
    state, [step] = stepped(environment, [0.5])
    assert step.reward[1] == pytest.approx(float(state.physics.reward)) != 0


def test_what_makes_no_sense_is_refused():
    with pytest.raises(ValueError, match="'0[*]near' has a term without a name or a factor"):
        cart("0*near/effort")
    with pytest.raises(ValueError, match="there is one objective; write objectives="):
        cart(("near", "effort"))
    still = Cart()
    still.dt = 0.0
    with pytest.raises(ValueError, match="earlier; a step must take some time.*; time_limit must be a whole number"):
        adapt("library:cart", "A library", still, None, DEFAULT, 0, ["earlier"])


def test_all_that_is_wrong_with_groups_is_named_at_once():
    with pytest.raises(ValueError) as error:
        cart("a:nea+x*effort/a:place/:effort/near+")
    said = str(error.value)
    assert said.endswith("the terms there are: effort, near, place, reward, control")
    assert "there is no term 'nea'; did you mean 'near'?" in said
    assert "'a:nea+x*effort' has a term without a name or a factor" in said
    assert "two objectives are called 'a'" in said
    assert "':effort' has a term without a name" in said and "'near+' has a term without a name" in said


@pytest.mark.parametrize("written", ["near", "near+effort", "near:near"])
def test_one_objective_is_too_few(written):
    with pytest.raises(ValueError, match="there is one objective; write objectives=TERM"):
        cart(written)


@pytest.mark.parametrize(("text", "value"), [("0.5", 0.5), ("True", True), ("(1, 2)", (1, 2)), ("spring", "spring")])
def test_options_of_theirs_are_numbers_where_they_look_so(text, value):
    assert literal(text) == value


def test_a_library_that_is_missing_is_named(monkeypatch, capsys):
    monkeypatch.setitem(envs.LIBRARIES, "playground", "no_such_package")
    envs._of_library.cache_clear()
    assert main(["envs", "playground:CheetahRun"]) == 2
    said = capsys.readouterr().err
    assert said == (
        "jmorl: environment 'playground:CheetahRun' needs no_such_package: pip install 'jmorl[playground]'\n"
    )

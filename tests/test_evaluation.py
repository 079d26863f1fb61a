"""Policies in MO-Gymnasium's own environment, beside ours."""

import json
import sys

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from envs.gymnasium import original
from envs.mountain_car import CarState, MountainCar
from jmorl.cli import main
from jmorl.evaluation import difference_in_errors, evaluate_in_gymnasium
from tests.probes import ThreeWays
from tests.stored import stored_linear_policy

CAR, CHEETAH = "mo-mountaincarcontinuous-v0", "mo-halfcheetah-v5"


@pytest.fixture
def policy(tmp_path):
    return stored_linear_policy(tmp_path / "car.npz", CAR, [[0.0, 1000.0]])


def test_returns_there_are_ours_from_the_same_starts(policy):
    returns = evaluate_in_gymnasium(policy, 3, seed=5)
    there = original(CAR)
    car = MountainCar()
    transition = jax.jit(car.transition)
    for index, expected in enumerate(returns):
        observation, _ = there.reset(seed=5 if index == 0 else None)
        state, total, ended = CarState(*map(jnp.float32, observation)), np.zeros(2), False
        while not ended:
            state, reward, ended = transition(state, policy(np.array([state.position, state.velocity])))
            total += reward
        np.testing.assert_allclose(expected, total, rtol=1e-3)
    assert len(set(map(tuple, returns))) == 3  # each episode starts elsewhere


def test_the_difference_is_that_of_a_z_test():
    generator = np.random.default_rng(0)
    ours, theirs = generator.normal([0, 5], [1, 2], (400, 2)), generator.normal([0.5, 5], [1, 2], (100, 2))
    z = difference_in_errors(ours, theirs)
    assert z[0] == pytest.approx(0.5 / np.sqrt(1 / 400 + 1 / 100), abs=3)
    assert abs(z[1]) < 4
    np.testing.assert_allclose(difference_in_errors(theirs, ours), -z)
    np.testing.assert_allclose(difference_in_errors(10 * ours, 10 * theirs), z)


def test_without_any_spread_there_is_no_difference_in_errors():
    constant = np.full((5, 1), 2.0)
    assert np.isnan(difference_in_errors(constant, constant)).all()
    assert np.isnan(difference_in_errors(constant[:1], constant)).all()


def test_null_differences_of_samples_of_one_distribution_have_unit_spread():
    generator = np.random.default_rng(1)
    z = np.stack([difference_in_errors(*generator.normal(3, 2, (2, 50, 1))) for _ in range(2000)])
    assert z.std() == pytest.approx(1, abs=0.06) and abs(z.mean()) < 0.1


@pytest.mark.parametrize("name", [CAR, CHEETAH])
def test_evaluate_prints_both_side_by_side(tmp_path, monkeypatch, capfd, name):
    folder = tmp_path / "here"
    folder.mkdir()
    monkeypatch.chdir(folder)
    gain = {CAR: [[0.0, 1000.0]], CHEETAH: np.zeros((6, 17))}[name]
    stored_linear_policy(tmp_path / "policy.npz", name, gain)
    command = ["evaluate", str(tmp_path / "policy.npz"), "--in", "gymnasium", "--episodes", "2"]
    assert main([*command, "--json"]) == 0
    printed = json.loads(capfd.readouterr().out)
    ours, theirs = printed["returns"], printed["gymnasium"]["returns"]
    assert np.shape(ours) == np.shape(theirs) == (2, 2)
    assert len(printed["gymnasium"]["difference_in_standard_errors"]) == 2
    assert main(command) == 0
    assert "MO-Gym." in capfd.readouterr().out
    assert not list(folder.iterdir())


def test_what_cannot_be_compared_is_one_clear_message(tmp_path, monkeypatch, capsys):
    stored_linear_policy(tmp_path / "probe.npz", ThreeWays.id, np.ones((2, 2)))
    command = ["evaluate", str(tmp_path / "probe.npz"), "--in", "gymnasium"]
    assert main(command) == 2
    assert f"MO-Gymnasium has no environment '{ThreeWays.id}'" in capsys.readouterr().err
    monkeypatch.setitem(sys.modules, "gymnasium", None)
    monkeypatch.delitem(sys.modules, "envs.gymnasium")
    assert main(command) == 2
    assert "pip install 'jmorl[gymnasium]'" in capsys.readouterr().err


def test_a_seed_that_gymnasium_would_refuse_is_refused(policy, tmp_path, capsys):
    for command in ("evaluate", "--in", "gymnasium"), ("play", "--out", str(tmp_path / "car.gif")):
        with pytest.raises(SystemExit) as ended:
            main([command[0], str(tmp_path / "car.npz"), *command[1:], "--seed", "-1"])
        assert ended.value.code == 2
        assert "argument --seed: must be from 0 to 4294967295, not -1" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["evaluate", "play"])
def test_an_environment_that_is_not_here_is_named(policy, tmp_path, capsys, name):
    path = tmp_path / "elsewhere.npz"
    with np.load(tmp_path / "car.npz") as file:
        arrays = dict(file)
    header = json.loads(str(arrays["header"])) | {"environment": "not_here:boat-v0"}
    np.savez(path, **arrays | {"header": np.array(json.dumps(header))})
    assert main([name, str(path), *(["--out", str(tmp_path / "boat.gif")] if name == "play" else [])]) == 2
    printed = capsys.readouterr().err
    assert printed.startswith("jmorl: the policy needs environment 'not_here:boat-v0': ")
    assert "cannot import 'not_here'" in printed and not (tmp_path / "boat.gif").exists()


def test_another_number_of_objectives_there_is_refused(policy):
    policy.header["objectives"].append(policy.header["objectives"][0])
    with pytest.raises(ValueError, match="2 objectives in MO-Gymnasium, and 3 here"):
        evaluate_in_gymnasium(policy, 1, seed=0)

"""Recorded episodes, and `jmorl play`: the episode that is scored, drawn into a file or refused."""

import subprocess
import sys

import jax
import numpy as np
import pytest
from PIL import Image, ImageSequence

import envs
from envs.mountain_car import CarState
from jmorl.cli import main
from jmorl.evaluation import evaluate_stored
from jmorl.playback import record
from tests.probes import Ending, Share, ThreeWays
from tests.stored import stored_linear_policy

CAR = "mo-mountaincarcontinuous-v0"


@pytest.fixture(scope="module")
def policy_path(tmp_path_factory):
    """A car that pushes the way it rolls, which reaches the flag."""
    path = tmp_path_factory.mktemp("policies") / "car.npz"
    stored_linear_policy(path, CAR, [[0.0, 1000.0]])
    return path


@pytest.fixture(scope="module")
def policy(policy_path):
    return stored_linear_policy(policy_path, CAR, [[0.0, 1000.0]])


def first_key(seed):
    return jax.random.split(jax.random.key(seed), 1)[0]


@pytest.mark.parametrize("seed", [0, 5])
def test_the_recorded_episode_is_the_first_that_evaluation_scores(policy, seed):
    recording = record(policy, first_key(seed))
    returns = evaluate_stored(policy, jax.random.split(jax.random.key(seed), 4))
    np.testing.assert_allclose(recording.totals[-1], returns.undiscounted[0], rtol=1e-5)
    assert recording.steps == returns.length[0] < 999


def test_states_follow_each_other_by_the_dynamics(policy):
    recording = record(policy, first_key(1))
    position, velocity = recording.states.position, recording.states.velocity
    assert len(position) == recording.steps + 1 == len(recording.totals)
    assert -0.6 <= position[0] <= -0.4 and velocity[0] == 0
    assert position[-1] >= 0.45 > position[:-1].max()
    environment = recording.environment
    for step in (0, recording.steps // 2, recording.steps - 1):
        action = policy(np.array([position[step], velocity[step]]))
        after, reward, _ = environment.transition(CarState(position[step], velocity[step]), action)
        np.testing.assert_allclose([after.position, after.velocity], [position[step + 1], velocity[step + 1]], 1e-5)
        np.testing.assert_allclose(reward, recording.totals[step + 1] - recording.totals[step], atol=1e-5)


def test_a_recording_may_stop_before_the_end(policy):
    whole, part = record(policy, first_key(2)), record(policy, first_key(2), 10)
    assert part.steps == 10
    np.testing.assert_allclose(part.totals, whole.totals[:11], rtol=1e-5)


@pytest.fixture
def ending(monkeypatch, tmp_path):
    """A policy where episodes end after 1 to 2500 steps, and the limit is too far to be computed."""
    monkeypatch.setitem(envs.registry, Ending.id, Ending)
    return stored_linear_policy(tmp_path / "ending.npz", f"{Ending.id},limit=2000000000,most=2500", [[0.5]])


def test_a_recording_ends_with_its_episode_however_far_the_limit_is(ending):
    returns = evaluate_stored(ending, jax.random.split(jax.random.key(0), 8))
    assert returns.length.min() < 1000 < 2000 < returns.length.max()
    for index, key in enumerate(jax.random.split(jax.random.key(0), 8)):
        recording = record(ending, key)
        assert recording.steps == returns.length[index]
        np.testing.assert_allclose(recording.totals[-1], returns.undiscounted[index], rtol=1e-4)
        np.testing.assert_array_equal(recording.states[:, 0], np.arange(recording.steps + 1))
    longest = jax.random.split(jax.random.key(0), 8)[int(returns.length.argmax())]
    assert record(ending, longest, 1500).steps == 1500


def test_recording_and_score_use_the_policys_own_box(monkeypatch, tmp_path):
    monkeypatch.setitem(envs.registry, Share.id, Share)
    policy = stored_linear_policy(tmp_path / "share.npz", f"{Share.id},low=5,high=35", [[0.0]])
    assert policy([0.0]) == 20
    expected = [-(0.25**2), -0.025]  # the middle, for one step
    np.testing.assert_allclose(record(policy, first_key(0)).totals[-1], expected, rtol=1e-5)
    np.testing.assert_allclose(evaluate_stored(policy, first_key(0)[None]).undiscounted, [expected], rtol=1e-5)


def test_play_makes_an_animation_with_a_picture_for_each_step(policy_path, tmp_path, capsys):
    out = tmp_path / "car.gif"
    assert main(["play", str(policy_path), "--out", str(out), "--steps", "12", "--size", "200"]) == 0
    assert "12 steps of policy 17" in capsys.readouterr().out
    with Image.open(out) as film:
        assert film.size[0] == 200
        durations = []
        for frame in ImageSequence.Iterator(film):
            durations.append(frame.info["duration"])
    assert len(durations) == 13
    assert set(durations[:-1]) == {30} and durations[-1] == 30 * 30  # the last stays for a second


def test_play_makes_a_strip_of_poses(policy_path, tmp_path):
    out = tmp_path / "car.png"
    assert main(["play", str(policy_path), "--out", str(out), "--size", "400"]) == 0
    with Image.open(out) as strip:
        assert strip.size[0] == 400


def test_play_makes_a_film(policy_path, tmp_path):
    import imageio_ffmpeg

    out = tmp_path / "car.mp4"
    assert main(["play", str(policy_path), "--out", str(out), "--steps", "20", "--size", "161"]) == 0
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-i", str(out), "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    decoded = subprocess.run(command, capture_output=True, check=True)
    assert b"160x" in decoded.stderr and b"yuv420p" in decoded.stderr
    height = int(decoded.stderr.split(b"160x")[1][:3].rstrip(b" ,["))
    frames = len(decoded.stdout) / (160 * height * 3)
    assert frames == 20 + 30  # and the last for a second


def test_without_the_encoder_play_says_what_to_install(policy_path, tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    assert main(["play", str(policy_path), "--out", str(tmp_path / "car.mp4")]) == 2
    assert "pip install 'jmorl[video]'" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_file_is_overwritten_only_by_force(policy_path, tmp_path, capsys):
    out = tmp_path / "car.png"
    out.write_text("dear")
    arguments = ["play", str(policy_path), "--out", str(out), "--steps", "3", "--size", "200"]
    assert main(arguments) == 2
    assert "already exists" in capsys.readouterr().err and out.read_text() == "dear"
    assert main([*arguments, "--force"]) == 0
    assert out.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("out", "message"), [("car.jpg", "must end in .gif, .mp4, .png"), ("nowhere/car.gif", "there is no folder")]
)
def test_what_cannot_be_written_is_refused_before_playing(policy_path, tmp_path, capsys, out, message):
    assert main(["play", str(policy_path), "--out", str(tmp_path / out)]) == 2
    assert message in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_an_environment_without_a_drawing_is_named(tmp_path, capsys):
    stored_linear_policy(tmp_path / "probe.npz", ThreeWays.id, np.ones((2, 2)))
    assert main(["play", str(tmp_path / "probe.npz"), "--out", str(tmp_path / "probe.gif")]) == 2
    assert capsys.readouterr().err == f"jmorl: environment '{ThreeWays.id}' has no drawing\n"
    assert [path.name for path in tmp_path.iterdir()] == ["probe.npz"]


def test_a_policy_of_a_run_is_its_choice_or_named(tmp_path, capsys):
    (tmp_path / "run" / "policies").mkdir(parents=True)
    stored_linear_policy(tmp_path / "run" / "policies" / "00004.npz", CAR, [[0.0, 1000.0]])
    stored_linear_policy(tmp_path / "run" / "chosen.npz", CAR, [[0.0, 0.0]])
    arguments = ["evaluate", str(tmp_path / "run"), "--episodes", "2"]
    assert main([*arguments, "--json"]) == 0
    assert '"returns": [[-999.0, ' in capsys.readouterr().out
    assert main([*arguments, "--json", "--policy", "4"]) == 0
    assert "-999.0" not in capsys.readouterr().out
    assert main([*arguments, "--policy", "5"]) == 2
    assert "run has no policy 5" in capsys.readouterr().err
    (tmp_path / "run" / "chosen.npz").unlink()
    assert main(arguments) == 2
    assert "has no chosen policy; name one by its id" in capsys.readouterr().err
    assert main(["evaluate", str(tmp_path / "run" / "policies" / "00004.npz"), "--policy", "4"]) == 2
    assert "is no run folder" in capsys.readouterr().err

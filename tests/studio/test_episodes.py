"""What the player is given is the episode."""

import jax
import numpy as np
import pytest

from envs.drawing import NoDrawing
from jmorl.playback import record
from jmorl.studio.episodes import episode_json
from tests.probes import ThreeWays
from tests.stored import stored_linear_policy

CAR = "mo-mountaincarcontinuous-v0"


def test_an_episode_has_every_step_and_says_once_what_does_not_move(tmp_path):
    recording = record(stored_linear_policy(tmp_path / "car.npz", CAR, [[0.0, 1000.0]]), jax.random.key(0))
    episode = episode_json(recording)
    assert [frame["step"] for frame in episode["frames"]] == list(range(recording.steps + 1))
    assert 0 < episode["seconds"] <= 0.05
    for frame in (episode["frames"][0], episode["frames"][-1]):
        scene = recording.scene(frame["step"]).to_json()
        assert len(episode["still"]) + len(frame["shapes"]) == len(scene["shapes"])
        kinds = [shape["kind"] for shape in (*episode["still"], *frame["shapes"])]
        assert kinds == [shape["kind"] for shape in scene["shapes"]]
        # Steps and fuel, of which people say how many: less is better.
        np.testing.assert_allclose(frame["totals"], -recording.totals[frame["step"]], atol=1e-4)
    assert episode["still"] and len(episode["frames"][0]["shapes"]) == 3  # the car


def test_an_environment_without_a_drawing_says_so(tmp_path):
    recording = record(stored_linear_policy(tmp_path / "p.npz", ThreeWays.id, np.zeros((2, 2))), jax.random.key(0))
    with pytest.raises(NoDrawing):
        episode_json(recording)

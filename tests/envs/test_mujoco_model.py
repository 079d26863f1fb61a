"""MuJoCo's models: loaded without a trace on the screen or the disk, and drawn where MuJoCo has them."""

import subprocess
import sys

import mujoco
import numpy as np
import pytest

from envs.mujoco_model import load_model, planar_capsules, quiet_mujoco

UNAWARE = "import envs, sys; envs.ids(); [envs.make(id) for id in envs.ids()]; assert 'mujoco' not in sys.modules"
LOADING = "import envs; environment = envs.make('mo-halfcheetah-v5'); environment.model"
PEER = "from envs.gymnasium import original; original('mo-halfcheetah-v5').reset(seed=0)"
MJX = "import envs; envs.make('mo-halfcheetah-v5,physics=mjx').physics"


@pytest.mark.parametrize("program", [UNAWARE, LOADING, PEER, MJX])
def test_nothing_is_printed_and_no_log_is_left(program, tmp_path):
    finished = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True)
    assert (finished.returncode, finished.stdout, finished.stderr) == (0, "", "")
    assert not list(tmp_path.iterdir())


def test_the_handler_of_warnings_is_put_back():
    heard = []
    mujoco.set_mju_user_warning(heard.append)
    try:
        with pytest.raises(KeyError), quiet_mujoco():
            raise KeyError
        load_model("half_cheetah")
        assert not heard
        assert mujoco.get_mju_user_warning() == heard.append
    finally:
        mujoco.set_mju_user_warning(None)


def test_capsules_are_where_the_joints_put_them():
    """The torso lies along x, 1 m long and 0.7 m up; turned a quarter about +y its head end points down."""
    model = load_model("half_cheetah")
    capsules = {each.name: each for each in planar_capsules(model, np.zeros(9))}
    assert list(capsules) == ["torso", "head", "bthigh", "bshin", "bfoot", "fthigh", "fshin", "ffoot"]
    ends = sorted([capsules["torso"].start.tolist(), capsules["torso"].end.tolist()])
    np.testing.assert_allclose(ends, [[-0.5, 0.7], [0.5, 0.7]], atol=1e-12)
    assert capsules["torso"].radius == pytest.approx(0.046)
    turned = planar_capsules(model, np.array([3.0, 0.5, np.pi / 2, 0, 0, 0, 0, 0, 0]))
    ends = sorted([turned[0].start.tolist(), turned[0].end.tolist()])
    np.testing.assert_allclose(ends, [[3.0, 0.7], [3.0, 1.7]], atol=1e-12)
    assert turned[1].end[1] < 0.7 and turned[1].start[1] < 0.75


def test_a_leg_folds_about_its_own_hinges():
    """Turning the hind shin moves shin and foot about the knee, and nothing else."""
    model = load_model("half_cheetah")
    bent = np.zeros(9)
    bent[4] = 0.3
    straight, folded = planar_capsules(model, np.zeros(9)), planar_capsules(model, bent)
    knee = np.array([-0.5 + 0.16, 0.7 - 0.25])
    turn = np.array([[np.cos(0.3), np.sin(0.3)], [-np.sin(0.3), np.cos(0.3)]])
    for before, after in zip(straight, folded, strict=True):
        moved = before.name in ("bshin", "bfoot")
        for old, new in ((before.start, after.start), (before.end, after.end)):
            np.testing.assert_allclose(new, knee + turn @ (old - knee) if moved else old, atol=1e-12)

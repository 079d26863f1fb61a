"""A policy as a file: it describes itself, and acts without this project."""

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import jax
import numpy as np
import pytest

from jmorl.learning.moppo import MOPPO
from jmorl.storage import files
from jmorl.storage.policy_file import FORMAT, PolicyFileError, export_policy, holds, load_policy, save_policy
from jmorl.storage.versions import NewerFormat
from tests.probes import ThreeWays, UnevenBox

STORED = Path(__file__).parent / "format_1"


@pytest.fixture
def saved(make_policy, environment, small_config, tmp_path):
    """A run folder with one policy that is also its choice, and the train state in it."""
    return saved_in(environment, make_policy, small_config, tmp_path)


def saved_in(environment, make_policy, small_config, tmp_path):
    policy = make_policy(17)
    (tmp_path / "run" / "policies").mkdir(parents=True)
    train_state: Any = MOPPO(environment, small_config.ppo).initial_train_state(jax.random.key(3))
    statistics = train_state.observation_statistics.replace(mean=np.float32([1, -2]), variance=np.float32([4, 0.25]))
    train_state = jax.device_get(train_state.replace(observation_statistics=statistics))
    policy = policy.__class__(**{**vars(policy), "snapshot": train_state})
    for name in ("chosen.npz", "policies/00017.npz"):
        save_policy(tmp_path / "run" / name, policy, environment, small_config, "run-id")
    return tmp_path / "run", policy


def rewritten(path, change):
    with np.load(path) as file:
        arrays = dict(file)
    header = json.loads(str(arrays["header"]))
    change(header)
    np.savez(path, **arrays | {"header": np.array(json.dumps(header))})


@pytest.mark.parametrize("observation", [-0.5, [0.1], np.zeros((3, 9))])
def test_an_observation_of_another_size_is_refused(saved, observation):
    with pytest.raises(ValueError, match="an observation has"):
        load_policy(saved[0] / "chosen.npz")(observation)


def test_the_header_says_what_the_policy_is(saved, environment, small_config):
    folder, policy = saved
    header = load_policy(folder / "chosen.npz").header
    assert header["environment"] == small_config.env
    assert header["objectives"] == [
        {"name": each.name, "label": each.label, "unit": each.unit} for each in environment.objectives
    ]
    assert header["values"] == policy.raw.tolist()
    assert (header["score"], header["std"]) == (policy.values.tolist(), policy.std.tolist())
    assert header["weights"] == policy.weights.tolist()
    assert header["network"]["sizes"] == [2, 64, 64, 2] and header["network"]["activation"] == "tanh"
    assert header["run"] == {"id": "run-id", "config": small_config.identity(), "method": "interactive", "seed": 1}
    assert (header["id"], header["generation"], header["parent"]) == (17, 4, 13)
    assert header["format"] == FORMAT and header["jmorl"]


@pytest.mark.parametrize("boxed", [ThreeWays(), UnevenBox()], ids=["unit", "uneven"])
def test_the_readmes_lines_act_as_the_policy_does_with_numpy_alone(boxed, make_policy, small_config, tmp_path):
    folder, policy = saved_in(boxed, make_policy, small_config, tmp_path)
    readme = Path(__file__).parents[2].joinpath("README.md").read_text()
    lines = re.search(r"```python\n(import json.*?policy\.npz.*?)```", readme, re.DOTALL)[1]
    export_policy(folder, None, tmp_path / "policy.npz")
    observations = np.random.default_rng(0).normal(scale=30, size=(50, 2)).round(3)
    program = f"{lines}\nimport sys\nfor each in {observations.tolist()}:\n    print(act(each).tolist())\n"
    program += "assert not {'jax', 'jmorl', 'envs', 'flax'} & set(sys.modules)\n"
    printed = subprocess.run(
        [sys.executable, "-I", "-c", program], cwd=tmp_path, capture_output=True, text=True, check=True
    ).stdout
    actions = np.array([json.loads(line) for line in printed.splitlines()])
    acting = MOPPO(boxed, small_config.ppo).policy(policy.snapshot)
    means = np.array([acting(each.astype(np.float32))[0] for each in observations])
    middle, half_width = ([0, 0], [1, 1]) if type(boxed) is ThreeWays else ([20, 0], [15, 1])
    expected = np.clip(middle + half_width * means, boxed.action_low, boxed.action_high)
    np.testing.assert_allclose(actions, expected, atol=1e-4)
    np.testing.assert_allclose(load_policy(folder / "chosen.npz")(observations), expected, atol=1e-4)
    assert np.ptp(expected, axis=0).min() > 1e-3


@pytest.mark.parametrize(("policy_id", "source"), [(None, "chosen.npz"), (17, "policies/00017.npz")])
def test_an_exported_policy_is_the_runs_file(saved, tmp_path, policy_id, source):
    folder, _ = saved
    assert export_policy(folder, policy_id, tmp_path / "out.npz").header["id"] == 17
    assert (tmp_path / "out.npz").read_bytes() == (folder / source).read_bytes()


def test_an_export_overwrites_nothing_unless_told(saved, tmp_path):
    folder, _ = saved
    target = tmp_path / "out.npz"
    target.write_text("dear")
    with pytest.raises(PolicyFileError, match="out.npz exists; choose another file, or overwrite it with --force"):
        export_policy(folder, None, target)
    assert target.read_text() == "dear"
    export_policy(folder, None, target, force=True)
    assert load_policy(target).header["id"] == 17
    with pytest.raises(PolicyFileError, match="is a folder; name a file"):
        export_policy(folder, None, tmp_path, force=True)


@pytest.mark.parametrize(
    ("policy_id", "target", "message"),
    [(5, "out.npz", "has no policy 5"), (17, "nowhere/out.npz", "cannot be written: No such file")],
)
def test_what_cannot_be_exported_says_why_and_leaves_nothing(saved, tmp_path, policy_id, target, message):
    with pytest.raises(PolicyFileError, match=message):
        export_policy(saved[0], policy_id, tmp_path / target)
    assert [path.name for path in tmp_path.iterdir()] == ["run"]


def test_a_damaged_file_is_not_exported(saved, tmp_path):
    path = saved[0] / "policies" / "00017.npz"
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    with pytest.raises(PolicyFileError, match="00017.npz is not a policy file"):
        export_policy(saved[0], 17, tmp_path / "out.npz")


def test_a_newer_format_is_refused_with_the_version_that_wrote_it(saved):
    path = saved[0] / "chosen.npz"
    rewritten(path, lambda header: header.update(format=FORMAT + 1, jmorl="8.8"))
    with pytest.raises(NewerFormat, match=f"format {FORMAT + 1}, written by jmorl 8.8"):
        load_policy(path)


def test_a_file_of_before_networks_were_described_acts_the_same(saved):
    path = saved[0] / "chosen.npz"
    observations = np.random.default_rng(0).normal(size=(9, 2))
    actions = load_policy(path)(observations)
    rewritten(path, lambda header: header.pop("network"))
    np.testing.assert_array_equal(load_policy(path)(observations), actions)


def test_no_flipped_bit_passes_for_a_policy(saved):
    """NumPy alone reads past some, in the head of an array for instance."""
    folder, policy = saved
    path = folder / "policies" / "00017.npz"
    content, generator = path.read_bytes(), np.random.default_rng(0)
    passed = 0
    for place in [*range(0, 400, 4), *generator.integers(len(content), size=200)]:
        changed = bytearray(content)
        changed[place] ^= 1 << int(generator.integers(8))
        path.write_bytes(changed)
        try:
            loaded = load_policy(path)
        except (PolicyFileError, NewerFormat):
            assert not holds(path, policy)
        else:  # a time or an attribute in the list of contents, which nobody reads
            passed += 1
            assert holds(path, policy) and loaded.header["id"] == 17
    assert passed < 150
    path.write_bytes(content)
    assert holds(path, policy)


def test_a_file_of_the_first_version_has_its_deviation_by_todays_name(saved):
    path = saved[0] / "chosen.npz"
    std = load_policy(path).header["std"]
    rewritten(path, lambda header: header.update(spread=header.pop("std")))
    header = load_policy(path).header
    assert header["std"] == std and "spread" not in header


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda header: header.pop("environment"), "environment is missing"),
        (lambda header: header.update(id="17", values=None), "id: input should be a valid integer; values: "),
        (lambda header: header.update(values=[1.0]), "1 values for 3 objectives"),
        (lambda header: header.update(format=1, action_limits=[1]), "not enough values to unpack"),
        (lambda header: header["network"].pop("clip"), "network.clip is missing"),
        (lambda header: header.pop("format"), "format is missing"),
    ],
)
def test_a_header_that_does_not_say_what_is_needed_is_refused(saved, change, message):
    path = saved[0] / "chosen.npz"
    rewritten(path, change)
    with pytest.raises(PolicyFileError, match=f"chosen.npz is not a policy file: .*{message}"):
        load_policy(path)


def test_layers_that_do_not_fit_each_other_are_refused(saved):
    path = saved[0] / "chosen.npz"
    with np.load(path) as file:
        arrays = dict(file)
    np.savez(path, **arrays | {"layer_1_kernel": arrays["layer_1_kernel"][:-1]})
    with pytest.raises(PolicyFileError, match="chosen.npz is not a policy file"):
        load_policy(path)


def test_a_file_is_on_the_disk_before_it_is_visible(saved, environment, small_config, monkeypatch):
    """Its content first, then its name."""
    folder, policy = saved
    path, done = folder / "policies" / "00018.npz", []
    sync = files.sync

    def noted(place):
        done.append((place.name, path.exists()))
        sync(place)

    monkeypatch.setattr(files, "sync", noted)
    save_policy(path, policy, environment, small_config)
    assert done == [(".00018.npz.partial", False), ("policies", True)]


def test_files_of_format_1_act_as_they_did():
    observations = np.random.default_rng(0).normal(size=(9, 2)).astype(np.float32)
    paths = sorted(STORED.rglob("*.npz"))
    for path in paths:
        with np.load(path) as file:
            header = json.loads(str(file["header"]))
            x = (observations - file["observation_mean"]) / np.sqrt(file["observation_variance"] + 1e-8)
            x = np.clip(x, -10, 10)
            for layer in range(len(header["network"]["sizes"]) - 1):
                x = (np.tanh(x) if layer else x) @ file[f"layer_{layer}_kernel"] + file[f"layer_{layer}_bias"]
        assert header["format"] == 1
        np.testing.assert_array_equal(load_policy(path)(observations), np.clip(x, *header["action_limits"]))
    assert len(paths) > 3


def test_a_file_of_format_1_only_clips_whatever_its_limits(saved):
    path = saved[0] / "chosen.npz"
    actions = load_policy(path).action(np.zeros((1, 2), np.float32))
    rewritten(path, lambda header: header.update(format=1, action_limits=[-0.05, 35.0]))
    with np.load(path) as file:
        kept = {name: file[name] for name in file.files if not name.startswith("action_")}
    np.savez(path, **kept)
    np.testing.assert_array_equal(load_policy(path)(np.zeros((1, 2))), np.maximum(actions, -0.05))

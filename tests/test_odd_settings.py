"""Odd values for any setting: the command line makes a run of it, or says what is wrong and makes nothing."""

import random
import signal

import pytest

from jmorl.cli import main
from jmorl.signals import Interrupted
from jmorl.storage.resume import Continued
from tests.test_config import SETTINGS

ODD = (
    *("0", "1", "2", "3", "-1", "7", "64", "1000", "2147483647", "2147483648", "4294967295", "99999999999999999999"),
    *("0.0", "1.0", "0.5", "1e-300", "1e300", "-1e200", "1e999", "nan", "inf", "-inf", "1_000", "0x10", " 3 ", "３"),
    *("", ",", "1,2", "200000,200000", "64,,64", "-1e200,-1e200", "nan,0,1", "0,0,0", "1,2,3", "None", "true", "é\n"),
    *("raw", "paper", "sampled", "range", "one", "bounds", "front", "weights=1,1,1", "weights=0,0,0", "target=1,2,3"),
)
BASE = {
    "env": "tests.registered:probe-three-ways",
    "user": "weights=1,1,1",
    "population.agents": "2",
    "population.warmup_iterations": "1",
    "population.iterations": "1",
    "ppo.environments": "2",
    "ppo.rollout_steps": "4",
    "ppo.minibatches": "1",
    "ppo.hidden_sizes": "4",
    "steps": "64",
}


def arguments(seed):
    """A small run with one to three settings at odd values."""
    generator = random.Random(seed)
    odd = {name: generator.choice(ODD) for name in generator.sample(sorted(SETTINGS), generator.randint(1, 3))}
    return [f"--{name.replace('_', '-')}={value}" for name, value in (BASE | odd).items()]


def check(seed, folder, monkeypatch, capsys):
    out = folder / str(seed)
    given = arguments(seed)

    def interrupted(continued, **options):
        raise Interrupted(signal.SIGTERM)

    monkeypatch.setattr(Continued, "events", interrupted)
    code = main(["train", "--quiet", *given, "--out", str(out)])
    said = capsys.readouterr().err
    assert code in (143, 2), (given, said)
    assert out.exists() == (code == 143), (given, said)
    assert said and all(line.startswith("jmorl: ") for line in said.splitlines()), (given, said)


@pytest.mark.parametrize("seed", range(12))
def test_odd_settings_begin_a_run_or_are_explained(seed, tmp_path, monkeypatch, capsys):
    check(seed, tmp_path, monkeypatch, capsys)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12, 300))
def test_many_odd_settings_begin_a_run_or_are_explained(seed, tmp_path, monkeypatch, capsys):
    check(seed, tmp_path, monkeypatch, capsys)

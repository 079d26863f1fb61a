"""The command line's own words: help that is true, values that can be written, mistakes that are explained."""

import re

import pytest

from jmorl.arguments import parse
from jmorl.config import PRESETS, resolve
from tests.test_config import SETTINGS


@pytest.fixture
def told(capsys):
    """Each setting's lines in the help of `train`."""
    with pytest.raises(SystemExit):
        parse(["train", "--help"])
    blocks = re.findall(r"^  --(\S+) [A-Z]\S+ *((?:(?!^  --|^$).*\n)*)", capsys.readouterr().out, re.M)
    texts = {flag.replace("-", "_"): [line.strip() for line in block.strip().splitlines()] for flag, block in blocks}
    return {name: texts[name] for name in SETTINGS}


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("env", PRESETS["default"].environments)
def test_the_help_tells_the_values_that_a_run_gets(told, env, preset):
    for name, (description, *lines) in told.items():
        value = resolve(preset, None, {"env": env}).model_dump()
        for part in name.split("."):
            value = value[part]
        written = ",".join(f"{each:g}" for each in value) if isinstance(value, tuple) else str(value)
        everywhere = dict(line.removeprefix("in preset ").split() for line in lines if line.startswith("in preset "))
        mentions = [line.removeprefix(f"{env}: ").split(", in preset ") for line in lines if line.startswith(env)]
        if name == "env":
            written = SETTINGS["env"]  # which the parentheses are about
        if mentions:
            usual, *others = mentions[0]
            assert dict(other.split() for other in others).get(preset, usual) == written, name
        elif preset in everywhere:
            assert everywhere[preset] == written, name
        else:
            assert description.endswith(f" ({written})") or not written, name


def test_a_value_may_begin_with_a_minus_sign():
    written = ("-999,-999", "-.5,3", "-1e3,-2")
    for value in written:
        for arguments in (["--reference-point", value, "--quiet"], [f"--reference-point={value}", "--quiet"]):
            options = parse(["train", *arguments])
            assert vars(options)["setting.reference_point"] == value and options.quiet
    for arguments in (["--reference-point", "--quiet"], ["--reference-point", "-x"]):
        with pytest.raises(SystemExit):
            parse(["train", *arguments])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["evaluate", "run", "--episodes", "2.5"], "argument --episodes: must be a whole number, not '2.5'"),
        (["evaluate", "run", "--episodes", "-1"], "argument --episodes: must be from 1 to 2147483647, not -1"),
        (
            ["evaluate", "run", "--episodes", "99999999999999999999"],
            "argument --episodes: must be from 1 to 2147483647, not 99999999999999999999",
        ),
        (["evaluate", "run", "--seed", "4294967296"], "argument --seed: must be from 0 to 4294967295, not 4294967296"),
        (["play", "run", "--out", "a.gif", "--size", "big"], "argument --size: must be a whole number, not 'big'"),
        (["play", "run", "--out", "a.gif", "--size", "20"], "argument --size: must be from 160 to 4096, not 20"),
        (["studio", "--port", "http"], "argument --port: must be a whole number, not 'http'"),
        (["paper", "--seeds", "1,x"], "argument --seeds: must be a whole number, not 'x'"),
        (
            ["branch", "run", "--generation", "last", "--out", "a"],
            "argument --round/--generation: must be a whole number, not 'la",
        ),
        (["export", "run", "--policy", "best", "--to", "a"], "argument --policy: must be a whole number, not 'best'"),
    ],
)
def test_a_number_that_is_none_is_explained(capsys, arguments, message):
    with pytest.raises(SystemExit) as left:
        parse(arguments)
    assert left.value.code == 2
    assert message in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["show", "run", "--quite"], "there is no flag --quite (jmorl show --help says what there is)"),
        (["train", "--quite"], "there is no flag --quite; did you mean '--quiet'?"),
        (["train", "--agnts", "4"], "there is no flag --agnts; did you mean '--population.agents'?"),
        (["train", "--popultion.agents=4"], "there is no flag --popultion.agents; did you mean '--population.agents'?"),
        (["show", "run", "other"], "too many arguments: other"),
    ],
)
def test_an_unknown_flag_names_the_nearest_in_one_line(capsys, arguments, message):
    with pytest.raises(SystemExit) as left:
        parse(arguments)
    error = capsys.readouterr().err
    assert left.value.code == 2 and error.startswith(f"jmorl: {message}") and error.count("\n") == 1

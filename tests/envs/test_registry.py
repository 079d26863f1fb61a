"""The registry, and the README's environment as its reader would write it."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

import envs
from envs.mountain_car import MountainCar

JMORL = Path(sys.executable).with_name("jmorl")
README = Path(__file__).parents[2] / "README.md"


def test_an_unknown_environment_names_the_known_ones():
    with pytest.raises(ValueError, match="unknown environment 'mo-nowhere-v0'; known: .*mo-mountaincarcontinuous-v0"):
        envs.make("mo-nowhere-v0")
    with pytest.raises(ValueError, match="unknown environment 'brax'; known: .*, brax:NAME, playground:NAME"):
        envs.make("brax")


def test_a_module_that_is_not_there_is_named():
    with pytest.raises(ValueError, match="environment 'no_such_module:x': cannot import 'no_such_module'"):
        envs.make("no_such_module:x")


@pytest.mark.parametrize(
    ("id", "message"),
    [
        ("mo-halfcheetah-v5,gravity=1", "'mo-halfcheetah-v5' has no option 'gravity'; known: physics"),
        ("mo-mountaincarcontinuous-v0,a=1", "has no option 'a'; known: none"),
        ("mo-halfcheetah-v5,physics", "an option is written name=value"),
        ("mo-halfcheetah-v5,=mjx", "an option is written name=value"),
        ("mo-halfcheetah-v5,", "an option is written name=value"),
        ("mo-halfcheetah-v5,physics=planar,physics=mjx", "option physics is given more than once"),
        ("mo-halfcheetah-v5,physics=planar,physics=planar", "option physics is given more than once"),
    ],
)
def test_an_option_that_is_not_there_or_not_written_so_is_refused(id, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        envs.make(id)


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("import envs\n\nenvs.regster('x')", r"AttributeError: .* no attribute 'regster'.*\(broken_envs.py, line 3\)"),
        ("def (:", r"SyntaxError: .*\(broken_envs.py, line 1\)$"),
        ("import numpy\nnumpy.zeros(-1)", r"ValueError: .*\(broken_envs.py, line 2\)$"),
        ("import no_such_module", "No module named 'no_such_module'$"),
        ("import sys\nsys.exit(0)", r"SystemExit: 0; it ends the program \(broken_envs.py, line 2\)$"),
        ("raise SystemExit", r"SystemExit; it ends the program \(broken_envs.py, line 1\)$"),
    ],
)
def test_a_module_that_breaks_down_is_named_with_the_line(tmp_path, monkeypatch, source, message):
    (tmp_path / "broken_envs.py").write_text(source)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(ValueError, match=f"environment 'broken_envs:x': cannot import 'broken_envs': {message}"):
        envs.make("broken_envs:x")


def made(id, **options):
    """Return the options that reached an environment of these tests."""
    return vars(envs.make(id, **options))["made"]


def test_options_that_an_environment_needs_are_named(monkeypatch):
    class Sized(MountainCar):
        def __init__(self, size, colour, wind="none"):
            self.made = size, colour, wind

    monkeypatch.setitem(envs.registry, "sized", Sized)
    with pytest.raises(ValueError, match="environment 'sized' needs size, colour: write sized,size=VALUE,colour=VALUE"):
        envs.make("sized")
    with pytest.raises(ValueError, match="environment 'sized' needs colour"):
        envs.make("sized,size=3")
    assert made("sized,size=3,colour=blue") == ("3", "blue", "none")


def test_an_environment_that_cannot_be_made_is_named(monkeypatch):
    class Unfinished(envs.Environment):
        id = "unfinished"

    monkeypatch.setitem(envs.registry, "unfinished", Unfinished)
    with pytest.raises(ValueError, match="environment 'unfinished' cannot be made: TypeError: .*abstract.*transition"):
        envs.make("unfinished")


def test_an_environment_that_ends_the_program_when_it_is_made_is_named(monkeypatch):
    monkeypatch.setitem(envs.registry, "ending", lambda: sys.exit("no licence"))
    with pytest.raises(ValueError, match="environment 'ending' cannot be made: SystemExit: no licence; it ends the"):
        envs.make("ending")


def test_options_reach_the_factory_from_the_id_and_from_the_call(monkeypatch):
    class Sized(MountainCar):
        def __init__(self, size="1", colour="red"):
            self.made = size, colour

    monkeypatch.setitem(envs.registry, "sized", Sized)
    assert made("sized") == ("1", "red")
    assert made("tests:sized,size=3") == ("3", "red")
    assert made("sized,size=3,colour=blue", size="4") == ("4", "blue")


@pytest.mark.parametrize("id", ["a-v0", "module.sub:a-v0", "a-v0,x=1", "module:a-v0,x=1,y=m:2"])
def test_the_plain_id_is_without_module_and_options(id):
    assert envs.plain_id(id) == "a-v0"


@pytest.mark.parametrize(
    ("id", "module"),
    [("a-v0", ""), ("a-v0,b=c:d", ""), ("brax:ant,backend=spring", ""), ("x.y:a-v0", "x.y"), ("x:a-v0,b=c", "x")],
)
def test_the_module_that_is_imported_is_known_beforehand(id, module):
    assert envs.module_of(id) == module


def test_an_id_is_taken_once():
    envs.register(MountainCar.id, MountainCar)  # the same again is fine
    with pytest.raises(ValueError, match="already registered"):
        envs.register(MountainCar.id, lambda: MountainCar())


def test_the_readmes_environment_trains_from_the_command_line(tmp_path):
    (source,) = re.findall(r"```python\n(# my_envs.py\n.*?)```", README.read_text(), re.DOTALL)
    (tmp_path / "my_envs.py").write_text(source)
    sizes = ["--population.agents", "2", "--population.warmup-iterations", "1", "--population.iterations", "1"]
    sizes += ["--ppo.environments", "2", "--ppo.rollout-steps", "64", "--evaluation.episodes", "2", "--steps", "512"]
    command = [JMORL, "train", "--env", "my_envs:harbour-v0", "--out", "run", *sizes]
    finished = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert finished.returncode == 0, finished.stderr
    assert (tmp_path / "run" / "chosen.npz").exists()
    show = [JMORL, "show", "run"]
    shown = subprocess.run(show, cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert shown.returncode == 0 and "rudder" in shown.stdout, shown.stderr
    evaluate = [JMORL, "evaluate", "run", "--episodes", "3"]
    evaluated = subprocess.run(evaluate, cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert evaluated.returncode == 0, evaluated.stderr


def test_what_is_meant_is_named():
    with pytest.raises(ValueError, match="did you mean 'mo-halfcheetah-v5'?"):
        envs.make("mo-halfchetah-v5")
    with pytest.raises(ValueError, match="known: physics; did you mean 'physics'?"):
        envs.make("mo-halfcheetah-v5,physic=mjx")


@pytest.mark.parametrize(
    ("id", "factory", "message"),
    [
        ("car", MountainCar(), r"'car' cannot be made by MountainCar: register the class itself, without \(\)"),
        ("car", 5, "'car' cannot be made by int"),
        (None, MountainCar, "a text without spaces, commas and colons, not None"),
        ("a,b", MountainCar, "a text without spaces, commas and colons, not 'a,b'"),
        ("a:b", MountainCar, "a text without spaces, commas and colons, not 'a:b'"),
    ],
)
def test_what_could_never_be_made_is_not_registered(id, factory, message):
    before = dict(envs.registry)
    with pytest.raises(ValueError, match=message):
        envs.register(id, factory)
    assert envs.registry == before


def test_a_factory_that_returns_no_environment_is_named(monkeypatch):
    monkeypatch.setitem(envs.registry, "nothing", lambda: None)
    with pytest.raises(ValueError, match=r"'nothing' cannot be made: what is registered returns None, not an"):
        envs.make("nothing")


def test_a_class_is_no_environment():
    with pytest.raises(envs.NotAsDeclared, match="MountainCar'> is no environment: it must be an instance"):
        envs.check_environment(MountainCar)

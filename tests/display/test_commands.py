"""Commands that people paste into a shell."""

import shlex
from pathlib import Path

import pytest

from jmorl.display.commands import command


@pytest.mark.parametrize("name", ["runs/one", "with space/b", "it's", "a[1]", "$HOME", "a;b", ""])
def test_a_shell_takes_a_command_as_it_is_meant(name):
    assert shlex.split(command("resume", name)) == ["jmorl", "resume", name]


def test_what_needs_no_quotes_has_none():
    assert command("show", Path("runs/20260101-120000")) == "jmorl show runs/20260101-120000"

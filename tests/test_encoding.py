"""Files are UTF-8 on every machine, and every text can be printed on every terminal."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
SOURCES = sorted(path for name in ("jmorl", "envs", "benchmarks") for path in (ROOT / name).rglob("*.py"))


def calls(path):
    return [node for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))) if isinstance(node, ast.Call)]


def leaves_encoding_to_the_machine(call):
    """Whether a call reads or writes text in the encoding of whatever machine it runs on."""
    name, given = ast.unparse(call.func), {keyword.arg: keyword.value for keyword in call.keywords}
    method = name.rpartition(".")[2]
    if "encoding" in given or name == "os.open":
        return False
    if given.keys() & {"text", "universal_newlines"} or ("." in name and method in ("read_text", "write_text")):
        return True
    if method != "open":
        return False
    texts = [each.value for each in [*call.args, *given.values()] if isinstance(each, ast.Constant)]
    modes = [text for text in texts if isinstance(text, str) and re.fullmatch("[rwaxbt+]{1,3}", text)]
    opens_a_file = name == "open" or modes or "newline" in given  # else a dialog, an archive, or a run
    return bool(opens_a_file) and not any("b" in mode for mode in modes)


@pytest.mark.parametrize(
    ("source", "found"),
    [
        ("path.read_text()", True),
        ("path.write_text(text)", True),
        ("open(path)", True),
        ("open(path, 'w')", True),
        ("path.open('w')", True),
        ("path.open(newline='')", True),
        ("subprocess.run(command, text=True)", True),
        ("path.read_text(encoding='utf-8')", False),
        ("open(path, 'rb')", False),
        ("path.open('ab')", False),
        ("os.open(path, os.O_RDWR | os.O_CREAT, 0o644)", False),
        ("dialog.open()", False),
        ("write_text(path, text)", False),
    ],
)
def test_such_calls_are_found(source, found):
    assert leaves_encoding_to_the_machine(ast.parse(source).body[0].value) is found


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_file_is_read_and_written_as_utf8(path):
    assert [call.lineno for call in calls(path) if leaves_encoding_to_the_machine(call)] == []


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_everything_is_printed_on_a_console_without_markup(path):
    made = [call.lineno for call in calls(path) if ast.unparse(call.func) in ("Console", "rich.print")]
    assert made == []

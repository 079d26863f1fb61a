"""What becomes of characters that an encoding lacks."""

import io
import os
import subprocess
import sys
from pathlib import Path

import pytest

from jmorl.display.characters import shown, substitute_in, to_path, unicode_argument

TEXT = "bounds ≥ 3 ±1 × größer m/s² 能"


@pytest.mark.parametrize(
    ("encoding", "text"),
    [
        ("utf-8", TEXT),
        ("latin-1", "bounds >= 3 ±1 × größer m/s² ?"),
        ("cp1252", "bounds >= 3 ±1 × größer m/s² ?"),
        ("ascii", "bounds >= 3 +-1 x grosser m/s^2 ?"),
    ],
)
def test_a_text_keeps_what_the_encoding_has(encoding, text):
    assert shown(TEXT, encoding) == text
    raw = io.BytesIO()
    stream = io.TextIOWrapper(raw, encoding=encoding)
    substitute_in(stream, None, io.StringIO())
    stream.write(TEXT)
    stream.flush()
    assert raw.getvalue().decode(encoding) == text


@pytest.mark.parametrize("encoding", ["utf-8", "latin-1", "ascii"])
def test_a_file_name_that_is_no_text_is_written_with_its_own_bytes(encoding):
    raw = io.BytesIO()
    stream = io.TextIOWrapper(raw, encoding=encoding)
    substitute_in(stream)
    stream.write(os.fsdecode(b"runs/\xff\xe9"))
    stream.flush()
    assert raw.getvalue() == b"runs/\xff\xe9"


def test_arguments_and_paths_are_themselves_where_the_locale_knows_them():
    assert unicode_argument("é") == "é" and to_path("é") == Path("é")
    assert unicode_argument("\udce9") == "\udce9" and to_path("\udce9") == Path("\udce9")


def test_arguments_and_paths_are_utf8_where_the_locale_does_not_know_them(tmp_path):
    (tmp_path / "é").touch()
    program = (
        "import sys\n"
        "from jmorl.display.characters import to_path, unicode_argument\n"
        "assert sys.getfilesystemencoding() == 'ascii'\n"
        "assert unicode_argument(sys.argv[1]) == '\\xe9'\n"
        "assert to_path('\\xe9').exists()\n"
    )
    plain = {**os.environ, "LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONPATH": str(Path(__file__).parents[2])}
    subprocess.run([sys.executable, "-c", program, "é"], cwd=tmp_path, env=plain, check=True)

"""Characters that the machine's encoding lacks: substitutes for people, UTF-8 for file names."""

import codecs
import io
import os
import unicodedata
from pathlib import Path
from typing import TextIO

SUBSTITUTES = {"≥": ">=", "≤": "<=", "±": "+-", "×": "x", "·": "*", "–": "-", "—": "-", "²": "^2", "³": "^3", "ß": "ss"}
HANDLER = "jmorl.substitute"  # of errors in encoding, as `open` and `str.encode` take it


def shown(text: str, encoding: str) -> str:
    """Return the text with a substitute for each character that the encoding lacks: `>=` for `≥`, `e` for `é`."""
    return text.encode(encoding, HANDLER).decode(encoding, "surrogateescape")


def substitute_in(*streams: TextIO | None) -> None:
    """Let these streams write substitutes where they would raise UnicodeEncodeError."""
    for stream in streams:
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors=HANDLER)


def unicode_argument(argument: str) -> str:
    """Return an argument of the command line as it was written: in UTF-8, where the locale could not read it."""
    try:
        argument.encode()
        return argument
    except UnicodeEncodeError:  # it has bytes that Python has left as they are
        return os.fsencode(argument).decode(errors="surrogateescape")


def to_path(text: str) -> Path:
    """Return the path with this name, which is UTF-8 on the disk where the locale cannot write it."""
    try:
        os.fsencode(text)
    except UnicodeEncodeError:
        return Path(os.fsdecode(text.encode(errors="surrogateescape")))
    return Path(text)


def _substitute(error: UnicodeError) -> tuple[str | bytes, int]:
    """Replace one character. A byte of a file name that is no text stays the byte it is."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    character, following = error.object[error.start], error.start + 1
    if "\udc80" <= character <= "\udcff":
        return character.encode("utf-8", "surrogateescape"), following
    plain = SUBSTITUTES.get(character) or unicodedata.normalize("NFKD", character).encode("ascii", "ignore").decode()
    return plain or "?", following


codecs.register_error(HANDLER, _substitute)

"""CSV files of a run: logs that grow, and rows read back, whatever version wrote them."""

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from jmorl.storage.files import append_text, write_text

Row = Mapping[str, Any]

RENAMED = {"spread": "std"}  # what columns of older versions began with -> what they begin with now


class CsvLog:
    """A CSV file that only grows, and its text."""

    def __init__(self, path: Path):
        self.path = path
        self.text = ""

    def append(self, rows: Sequence[Row]) -> None:
        """Add rows, after a header line if they are the first.

        A file of another version is written anew once: with the columns of these rows, which are empty where the file
        does not have them, and behind them those that only the file has.
        """
        if not rows:
            return
        header = _header(self.text)
        names = list(rows[0])
        columns = [*names, *(name for name in map(current_name, header) if name not in names)]
        if header and header != columns:
            self.restore(csv_text(parsed_rows(self.text, str(self.path)), columns))
        added = csv_text(rows, columns, header=not header)
        append_text(self.path, added)
        self.text += added

    def restore(self, text: str) -> None:
        """Take the file back to what it was."""
        self.text = text
        if text:
            write_text(self.path, text)
        else:
            self.path.unlink(missing_ok=True)


def csv_text(rows: Sequence[Row], columns: Sequence[str], header: bool = True) -> str:
    """Return rows as CSV; a column that a row does not have is empty."""
    file = io.StringIO(newline="")
    writer = csv.DictWriter(file, columns, restval="")
    if header:
        writer.writeheader()
    writer.writerows(rows)
    return file.getvalue()


def read_rows(path: Path) -> list[dict[str, str]]:
    """Read a CSV file, its columns by today's names. Raises OSError, and ValueError naming the file."""
    return parsed_rows(path.read_bytes().decode(), str(path))


def parsed_rows(text: str, name: str) -> list[dict[str, str]]:
    """Return the rows of a CSV text called `name`, its columns by today's names. Raises ValueError."""
    try:
        rows = list(csv.DictReader(io.StringIO(text, newline="")))
    except csv.Error as error:
        raise ValueError(f"{name} is not a CSV file: {error}") from None
    for number, row in enumerate(rows, start=2):
        if None in row.values():
            raise ValueError(f"{name}, line {number} ends too early")
        if None in row:
            raise ValueError(f"{name}, line {number} has more cells than the header")
    return [{current_name(column): cell for column, cell in row.items()} for row in rows]


def current_name(column: str) -> str:
    """Return today's name of a column that an older version wrote."""
    first, underscore, rest = column.partition("_")
    return RENAMED.get(first, first) + underscore + rest if underscore else column


def _header(text: str) -> list[str]:
    """Return the columns of a CSV text; none of an empty one."""
    return next(csv.reader(io.StringIO(text, newline="")), [])

"""Tables in text, for screens of any width."""

from collections.abc import Iterator, Sequence

from rich import box
from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, JustifyMethod, RenderResult
from rich.table import Table

from jmorl.display.characters import shown

GAP = 2  # columns of the screen between two of a table
ASCII_HEAD = box.Box("    \n    \n -- \n    \n    \n    \n    \n    \n", ascii=True)  # SIMPLE_HEAD, for any encoding


class PlainTable:
    """A table without vertical lines, as narrow as its content.

    The cells of a column are numbers, which start right and are never broken over two lines, or words, which start
    left and may be. A table that is too wide for the screen is continued below, with its first column again. Columns
    of notes have no heading; their cells are words, and so are those of columns listed in `words`.
    """

    def __init__(self, *headings: str, title: str | None = None, words: Sequence[str] = ()):
        self.headings = headings
        self.title = title
        self.caption: str | None = None
        self.words = {index for index, heading in enumerate(headings) if not heading or heading in words}
        self.rows: list[tuple[Sequence[str], str | None]] = []

    def add_row(self, *cells: str, style: str | None = None) -> None:
        """Add a row with a cell for each heading."""
        self.rows.append((cells, style))

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        parts = list(self._parts(options.max_width, console.encoding))
        for index, widths in enumerate(parts):
            if index:
                yield ""
            table = self._part(widths, box.SIMPLE_HEAD if console.encoding.startswith("utf") else ASCII_HEAD)
            table.title = None if index else self.title
            table.caption = self.caption if index == len(parts) - 1 else None
            yield table

    def _parts(self, width: int, encoding: str) -> Iterator[dict[int, int]]:
        """Yield the columns of each part with their widths, so that a part fits into the width.

        Empty ones are left out.
        """
        columns = [[heading, *(cells[index] for cells, _ in self.rows)] for index, heading in enumerate(self.headings)]
        columns = [[shown(text, encoding) for text in column] for column in columns]
        most = [max(map(_line_width, column)) for column in columns]
        least = [self._least_width(index, column) for index, column in enumerate(columns)]
        part = [0]
        for index in range(1, len(columns)):
            if not most[index]:
                continue
            if len(part) > 1 and _total([least[each] for each in (*part, index)]) > width:
                yield _spread(part, least, most, width)
                part = [0]
            part.append(index)
        yield _spread(part, least, most, width)

    def _least_width(self, index: int, column: Sequence[str]) -> int:
        """Of a column that has its heading first: no number, and no word, is broken."""
        heading, *cells = column
        broken = (_word_width(cell) if index in self.words else _line_width(cell) for cell in cells)
        return max(_word_width(heading), *broken, 1)

    def _part(self, widths: dict[int, int], lines: box.Box) -> Table:
        table = Table(
            title_justify="left",
            title_style="bold",
            caption_justify="left",
            box=lines,
            show_edge=False,
            padding=(0, GAP - 1, 0, 0),
            pad_edge=False,
        )
        for index, width in widths.items():
            justify: JustifyMethod = "left" if index in self.words else "right"
            table.add_column(self.headings[index], justify=justify, header_style="", width=width, overflow="fold")
        for cells, style in self.rows:
            table.add_row(*(cells[index] for index in widths), style=style)
        return table


def _spread(part: Sequence[int], least: Sequence[int], most: Sequence[int], width: int) -> dict[int, int]:
    """Return each column's width: what it needs, and, from the first column on, as much of the rest as it may use."""
    left = max(width - _total([least[index] for index in part]), 0)
    widths = {}
    for index in part:
        more = min(most[index] - least[index], left)
        widths[index] = least[index] + more
        left -= more
    return widths


def _total(widths: Sequence[int]) -> int:
    return sum(widths) + GAP * (len(widths) - 1)


def _line_width(text: str) -> int:
    return max(map(cell_len, text.split("\n")))


def _word_width(text: str) -> int:
    return max(map(cell_len, text.split()), default=0)

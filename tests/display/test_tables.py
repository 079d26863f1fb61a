"""Tables fit on every screen, and no number is ever broken over two lines."""

import io

import pytest

from jmorl.display.console import PlainConsole
from jmorl.display.tables import PlainTable

ROWS = [
    ("0", "6600.7", "-0.0001", "1234567", "chosen"),
    ("1", "-12.5", "-0.0020", "1", "outside the bounds"),
]


def table():
    made = PlainTable("gen", "speed of the\ncart [m/s]", "energy", "steps", "", title="Policies")
    made.caption = "That is all."
    for row in ROWS:
        made.add_row(*row)
    return made


def printed(width, encoding="utf-8", made=None):
    raw = io.BytesIO()
    file = io.TextIOWrapper(raw, encoding=encoding)
    PlainConsole(file=file, width=width).print(made or table())
    file.flush()
    return [line.rstrip() for line in raw.getvalue().decode(encoding).split("\n")[:-1]]


def test_a_wide_screen_has_it_all_side_by_side():
    assert printed(80) == [
        "Policies",
        "     speed of the",
        "gen    cart [m/s]   energy    steps",
        "───────────────────────────────────────────────────────",
        "  0        6600.7  -0.0001  1234567  chosen",
        "  1         -12.5  -0.0020        1  outside the bounds",
        "That is all.",
    ]


def test_a_narrow_screen_wraps_words_and_has_the_rest_below_with_the_first_column_again():
    assert printed(25) == [
        "Policies",
        "        speed of",
        "             the",
        "gen   cart [m/s]   energy",
        "─────────────────────────",
        "  0       6600.7  -0.0001",
        "  1        -12.5  -0.0020",
        "",
        "gen    steps",
        "─────────────────────────",
        "  0  1234567  chosen",
        "  1        1  outside the",
        "              bounds",
        "That is all.",
    ]


@pytest.mark.parametrize("width", range(14, 90))
def test_every_number_is_whole_and_within_the_screen(width):
    lines = printed(width)
    words = [word for line in lines for word in line.split()]
    for row in ROWS:
        assert all(cell in words for cell in row[:4])
    assert max(map(len, lines)) <= width


def test_labels_are_no_markup():
    made = PlainTable("energy [/kWh]", "[red]speed[/red]")
    made.add_row("[bold]1", ":car: 2")
    assert printed(80, made=made)[0].split("  ") == ["energy [/kWh]", "[red]speed[/red]"]
    assert printed(80, made=made)[2].split() == ["[bold]1", ":car:", "2"]


@pytest.mark.parametrize(
    ("encoding", "line"),
    [("utf-8", "66.0 ±0.5  80 m²"), ("latin-1", "66.0 ±0.5  80 m²"), ("ascii", "66.0 +-0.5  80 m^2")],
)
def test_columns_are_as_wide_as_what_is_shown(encoding, line):
    made = PlainTable("größer", "area")
    made.add_row("66.0 ±0.5", "80 m²")
    heading, rule, row = printed(80, encoding, made)
    assert row == line and len(heading) == len(row) == len(rule)

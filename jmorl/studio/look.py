"""The look that all pages of the studio have."""

from pathlib import Path
from typing import Literal

from nicegui import ui

from jmorl.studio.access import Tone
from jmorl.studio.charts.chart_style import BLUE

STYLE = Path(__file__).parent / "studio.css"
DARK_RED = "#B34700"  # enough contrast for text
KINDS: dict[Tone, Literal["warning", "negative"] | None] = {"hint": None, "warning": "warning", "failure": "negative"}


def dress() -> None:
    """Give the page that is being built the studio's style and colours; it is light or dark as the browser is."""
    ui.add_css(STYLE)
    ui.colors(primary=BLUE, negative=DARK_RED)
    ui.dark_mode(None)

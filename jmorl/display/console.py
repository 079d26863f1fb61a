"""Where people read: a console that takes every text as it is."""

from typing import IO, Any

from rich.console import Console
from rich.text import Text

from jmorl.display.characters import shown


class PlainConsole(Console):
    """A console on which nobody's text is markup, and that has a substitute for each character it cannot show.

    A label such as `energy [/kWh]` or a folder `sweep[lr=1e-3]` would otherwise be read as rich's markup.
    """

    def __init__(self, file: IO[str] | None = None, **options: Any):
        super().__init__(file=file, markup=False, emoji=False, highlight=False, **options)

    def render_str(self, text: str, **options: Any) -> Text:
        """Return the text as it is, with substitutes for what the terminal lacks."""
        return super().render_str(shown(text, self.encoding), **options)

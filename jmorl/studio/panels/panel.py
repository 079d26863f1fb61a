"""The protocol of a panel, and the memory by which it knows whether to draw anew."""

from typing import Protocol


class Panel(Protocol):
    """A part of the page, made for one tab at the place where it is constructed."""

    def show(self) -> None:
        """Show what the tab holds now. The page calls it many times a second: with nothing new it must do nothing."""


class Shown:
    """A memory of what a panel has shown last.

    Records (view, selection, dialogue, question) are replaced as a whole, so they are told apart by identity; numbers
    and text are told apart by value.
    """

    def __init__(self) -> None:
        self._last: tuple[object, ...] | None = None

    def is_new(self, *things: object) -> bool:
        """Return whether anything differs from what was shown last, and remember all of it as shown."""
        last, self._last = self._last, things
        return last is None or not all(_same(old, new) for old, new in zip(last, things, strict=True))


def _same(old: object, new: object) -> bool:
    return old is new or (isinstance(old, int | str) and old == new)

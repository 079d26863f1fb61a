"""A state as 2-D shapes: plain data, made on the host, for pictures, films and web pages.

Coordinates are those of the environment's own plane: x to the right, z upwards, the same scale on both axes. Shapes
are drawn in their order, later ones over earlier ones. What a shape looks like is up to who draws it; `part` says what
it is.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import ceil, floor
from typing import Any, Literal

Point = tuple[float, float]  # x, z
LABEL_MARGIN = 0.3  # metres, half of a label's width and some more
Part = Literal[
    "ground",  # what is stood on
    "stripe",  # every other stretch of it, so that motion shows
    "mark",  # an annotation, or something fixed that does not matter
    "body",
    "hind",  # limbs, or wheels
    "fore",
    "goal",
]


class NoDrawing(ValueError):
    """An environment that does not say what its states look like."""


@dataclass(frozen=True)
class Capsule:
    """All points within `radius` of the segment from `start` to `end`."""

    start: Point
    end: Point
    radius: float
    part: Part


@dataclass(frozen=True)
class Disk:
    """A filled circle."""

    centre: Point
    radius: float
    part: Part


@dataclass(frozen=True)
class Polyline:
    """A thin line through the points."""

    points: tuple[Point, ...]
    part: Part


@dataclass(frozen=True)
class Polygon:
    """The filled area within the points."""

    points: tuple[Point, ...]
    part: Part


@dataclass(frozen=True)
class Label:
    """A short text, centred at a point."""

    centre: Point
    text: str
    part: Part


Shape = Capsule | Disk | Polyline | Polygon | Label


@dataclass(frozen=True)
class Window:
    """The part of the plane to look at."""

    x: tuple[float, float]
    z: tuple[float, float]


@dataclass(frozen=True)
class Scene:
    """One picture. Shapes may reach beyond the window."""

    shapes: tuple[Shape, ...]
    window: Window

    def to_json(self) -> dict[str, Any]:
        """Return the scene as JSON's types; every shape with its `kind`, its class in lower case."""
        shapes = [{"kind": type(shape).__name__.lower(), **vars(shape)} for shape in self.shapes]
        return {"shapes": shapes, "window": dict(vars(self.window))}


def level_ground(window: Window) -> Iterator[Shape]:
    """Flat ground at z = 0, with every other metre striped and every metre labelled, as far as the window sees."""
    (left, right), bottom = window.x, window.z[0]
    yield _below(left, right, bottom, "ground")
    for x in range(floor(left), ceil(right) + 1):
        if x % 2 and x < right:
            yield _below(max(x, left), min(x + 1, right), bottom, "stripe")
        if left + LABEL_MARGIN < x < right - LABEL_MARGIN:  # a label is shown whole or not at all
            yield Label((x, bottom / 2), f"{x} m", "mark")
    yield Polyline(((left, 0.0), (right, 0.0)), "mark")


def _below(left: float, right: float, bottom: float, part: Part) -> Polygon:
    return Polygon(((left, 0.0), (right, 0.0), (right, bottom), (left, bottom)), part)

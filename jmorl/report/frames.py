"""Pictures of a recorded episode: the scene, and above it the time and the objectives so far.

Drawn with Pillow: a frame takes milliseconds, where a plotting library takes a tenth of a second.
"""

from collections.abc import Sequence
from functools import cache
from math import ceil
from pathlib import Path

import matplotlib
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from envs.drawing import Capsule, Disk, Label, Point, Polygon, Polyline, Scene, Shape
from jmorl.display.readings import reading_label
from jmorl.display.text import number_format
from jmorl.playback import Recording
from jmorl.report.style import BLUE, GREY, INK, ORANGE, RED
from jmorl.storage.policy_file import policy_name

OVERSAMPLING = 4  # shapes are drawn so many times larger, and their edges averaged
COLOURS = {  # of the parts; the limbs differ in lightness, too
    "ground": "#eceef0",
    "stripe": "#d9dde1",
    "mark": GREY,
    "body": "#3c3c3c",
    "hind": BLUE,
    "fore": ORANGE,
    "goal": RED,
}
LINE, OUTLINE = 1.5, 1.2  # pixels
MOST_COLUMNS = 3  # of objectives beside each other
POSES = 8


def film_frame(recording: Recording, step: int, width: int) -> Image.Image:
    """Return the picture after so many steps, `width` pixels wide; its height is even, as films want it."""
    environment, size = recording.environment, width / 42
    columns = min(len(environment.objectives), MOST_COLUMNS)
    rows = ceil(len(environment.objectives) / columns)
    scene = draw_scene(recording.scene(step), width, size)
    head = round(size * (2.6 + 3.1 * rows))
    frame = Image.new("RGB", (width, (head + scene.height) // 2 * 2), "white")
    frame.paste(scene, (0, head))
    draw, margin = ImageDraw.Draw(frame), size
    draw.text((margin, 0.8 * size), _title(recording), GREY, _font(size))
    draw.text((width - margin, 0.8 * size), _time(recording, step), INK, _font(size), anchor="ra")
    totals = zip(environment.objectives, _totals(recording, step), strict=True)
    for index, (objective, total) in enumerate(totals):
        row, column = divmod(index, columns)
        x, y = margin + column * (width - 2 * margin) / columns, size * (2.7 + 3.1 * row)
        draw.text((x, y), reading_label(objective), GREY, _font(size))
        draw.text((x, y + 1.2 * size), total, INK, _font(1.4 * size, bold=True))
    return frame


def strip(recording: Recording, width: int) -> Image.Image:
    """Poses evenly in time from the start to the end, in rows, with the objectives so far at each."""
    size, columns = width / 96, 4
    steps = np.unique(np.linspace(0, recording.steps, POSES).round().astype(int))
    gap = round(size)
    panels = [_pose(recording, int(step), (width - (columns + 1) * gap) // columns, size) for step in steps]
    head, height = round(3.2 * size), panels[0].height + gap
    picture = Image.new("RGB", (width, head + ceil(len(panels) / columns) * height), "white")
    for index, panel in enumerate(panels):
        row, column = divmod(index, columns)
        picture.paste(panel, (gap + column * (panel.width + gap), head + row * height))
    draw = ImageDraw.Draw(picture)
    draw.text((gap, size), _title(recording), INK, _font(1.2 * size, bold=True))
    units = ", ".join(map(reading_label, recording.environment.objectives))
    draw.text((width - gap, size), f"so far: {units}", GREY, _font(size), anchor="ra")
    return picture


def draw_scene(scene: Scene, width: int, size: float) -> Image.Image:
    """Return a scene `width` pixels wide, with labels of `size` pixels."""
    (left, right), (bottom, top) = scene.window.x, scene.window.z
    scale = width / (right - left)
    height = round(scale * (top - bottom))
    large = Image.new("RGB", (width * OVERSAMPLING, height * OVERSAMPLING), "white")
    canvas = _Canvas(ImageDraw.Draw(large), (left, top), scale * OVERSAMPLING)
    for shape in scene.shapes:
        canvas.add(shape)
    image = large.reduce(OVERSAMPLING)
    draw = ImageDraw.Draw(image)
    for shape in scene.shapes:
        if isinstance(shape, Label):
            place = scale * (shape.centre[0] - left), scale * (top - shape.centre[1])
            draw.text(place, shape.text, COLOURS[shape.part], _font(0.9 * size), anchor="mm")
    return image


class _Canvas:
    """Draws shapes, but no text, in the enlarged picture."""

    def __init__(self, draw: ImageDraw.ImageDraw, origin: Point, scale: float):
        self.draw = draw
        self.origin = origin  # of the pixels, in the scene's coordinates
        self.scale = scale  # pixels for a unit of the scene

    def add(self, shape: Shape) -> None:
        match shape:
            case Polygon(points, part):
                self.draw.polygon(self._pixels(points), COLOURS[part])
            case Polyline(points, part):
                self.draw.line(self._pixels(points), COLOURS[part], round(LINE * OVERSAMPLING), joint="curve")
            case Disk(centre, radius, part):
                self._rounded(centre, centre, radius, COLOURS[part])
            case Capsule(start, end, radius, part):
                self._rounded(start, end, radius, COLOURS[part])

    def _pixels(self, points: Sequence[Point]) -> list[tuple[float, float]]:
        left, top = self.origin
        return [(self.scale * (x - left), self.scale * (top - z)) for x, z in points]

    def _rounded(self, start: Point, end: Point, radius: float, colour: str) -> None:
        """Return a capsule with a white edge, to set it off from what is below."""
        pixels, inner = np.array(self._pixels([start, end])), radius * self.scale
        along = pixels[1] - pixels[0]
        across = np.array([-along[1], along[0]]) / max(float(np.hypot(*along)), 1e-9)
        for reach, fill in ((inner + OUTLINE * OVERSAMPLING, "white"), (inner, colour)):
            sides = [pixels[0] + reach * across, pixels[1] + reach * across]
            sides += [pixels[1] - reach * across, pixels[0] - reach * across]
            self.draw.polygon([tuple(side) for side in sides], fill)
            for x, y in pixels:
                self.draw.ellipse((x - reach, y - reach, x + reach, y + reach), fill)


def _pose(recording: Recording, step: int, width: int, size: float) -> Image.Image:
    """One picture of a strip."""
    scene = draw_scene(recording.scene(step), width, 0.9 * size)
    head = round(2.9 * size)
    panel = Image.new("RGB", (width, head + scene.height), "white")
    panel.paste(scene, (0, head))
    draw = ImageDraw.Draw(panel)
    draw.text((0, 0), _time(recording, step), GREY, _font(0.9 * size))
    objectives = recording.environment.objectives
    totals = zip(objectives, _totals(recording, step), strict=True)
    draw.text((0, 1.3 * size), "   ".join(f"{each.label} {total}" for each, total in totals), INK, _font(size))
    return panel


def _title(recording: Recording) -> str:
    header = recording.policy.header
    return f"{header['environment']}, {policy_name(header)}"


def _time(recording: Recording, step: int) -> str:
    seconds = recording.environment.step_seconds
    return f"step {step}" if seconds is None else f"{step * seconds:.2f} s, step {step}"


def _totals(recording: Recording, step: int) -> list[str]:
    """Return the objectives so far as people say them, in the same format throughout the episode, and never -0."""
    return [f"{column[step]:z{number_format(column)}}" for column in recording.readings.T]


@cache
def _font(size: float, bold: bool = False) -> ImageFont.FreeTypeFont:
    """Return the plots' font, which comes with matplotlib."""
    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    return ImageFont.truetype(Path(matplotlib.get_data_path()) / "fonts" / "ttf" / name, round(size))

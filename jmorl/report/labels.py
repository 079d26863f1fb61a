"""Labels beside points, where they cover neither points nor each other."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.transforms import Bbox

from jmorl.report.style import DOTS_PER_INCH, INK

FONT_SIZE = 8.0
ANGLES = np.radians([45, 20, 70, 0, 90, -25, 115, -50, 140, -80, 180, 210, 240])  # the free side of a front first
DISTANCES = (13.0, 21.0, 31.0, 43.0, 57.0)  # points
CLEARANCE = 3.5  # points that a label keeps from points of the plot


def place_labels(axes: Axes, points: np.ndarray, texts: Sequence[str], avoid: np.ndarray) -> None:
    """Write a text beside each of the points [K, 2], with a thin line to it; keep clear of the points [N, 2].

    One after the other, each at the first free place; with none left, at the nearest. The figure's layout must be
    settled.
    """
    scale = DOTS_PER_INCH / 72
    frame = axes.get_window_extent()
    obstacles = axes.transData.transform(avoid)
    taken: list[Bbox] = []
    for point, text in zip(points, texts, strict=True):
        half = np.array([0.33 * len(text) + 0.35, 0.75]) * FONT_SIZE * scale
        anchor = axes.transData.transform(point)
        offsets = [d * scale * np.array([np.cos(a), np.sin(a)]) for d in DISTANCES for a in ANGLES]
        boxes = [Bbox([anchor + offset - half, anchor + offset + half]) for offset in offsets]
        free = [index for index, box in enumerate(boxes) if _is_free(box, frame, taken, obstacles, CLEARANCE * scale)]
        index = free[0] if free else 0
        taken.append(boxes[index])
        label = axes.annotate(
            text,
            point,
            (offsets[index][0] / scale, offsets[index][1] / scale),
            textcoords="offset points",
            ha="center",
            va="center",
            fontsize=FONT_SIZE,
            color=INK,
            arrowprops={"arrowstyle": "-", "color": INK, "linewidth": 0.6, "shrinkA": 0, "shrinkB": 4},
            bbox={"boxstyle": "round,pad=0.25", "facecolor": "white", "edgecolor": INK, "linewidth": 0.6},
            zorder=8,
        )
        label.set_in_layout(False)


def _is_free(box: Bbox, frame: Bbox, taken: Sequence[Bbox], obstacles: np.ndarray, clearance: float) -> bool:
    within_frame = frame.x0 <= box.x0 and box.x1 <= frame.x1 and frame.y0 <= box.y0 and box.y1 <= frame.y1
    return (
        within_frame
        and not any(box.overlaps(other) for other in taken)
        and not box.padded(clearance).count_contains(obstacles)
    )

"""How every plot looks: fonts, colours, sizes, and the way to a file. No global state, and no window."""

import textwrap
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import Formatter, MaxNLocator

from envs.core import Objective
from jmorl.display.text import minus
from jmorl.storage.files import written_whole

DOTS_PER_INCH = 150
TITLE_CHARACTERS = 10.5  # of a title in an inch
# Okabe and Ito's colours, which colour-blind people can tell apart.
BLUE, ORANGE, GREEN, RED = "#0072B2", "#E69F00", "#009E73", "#D55E00"
INK, GREY, PALE = "#222222", "#767676", "#b8b8b8"
MOST_PLACES, LARGE = 7, 1e7  # of a tick: more decimals, and larger numbers, are written with an exponent
SETTINGS: dict[Any, Any] = {
    "figure.dpi": DOTS_PER_INCH,
    "savefig.dpi": DOTS_PER_INCH,
    "svg.hashsalt": "jmorl",  # the same figure gives the same file
    "figure.facecolor": "white",
    "font.family": "DejaVu Sans",
    "font.size": 10,
    "text.usetex": False,
    "text.parse_math": False,
    "axes.titlesize": 11,
    "axes.titlelocation": "left",
    "axes.labelsize": 10,
    "axes.edgecolor": GREY,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#ececec",
    "xtick.color": GREY,
    "xtick.labelcolor": INK,
    "ytick.color": GREY,
    "ytick.labelcolor": INK,
    "legend.frameon": False,
    "legend.fontsize": 9,
    "lines.linewidth": 1.6,
}

Colour = tuple[float, float, float, float]


@contextmanager
def style() -> Iterator[None]:
    """Draw in the project's style within this block; whatever was set before is back after it.

    Characters that the font lacks are drawn as boxes, without a warning for each.
    """
    with matplotlib.rc_context(SETTINGS), warnings.catch_warnings():
        warnings.filterwarnings("ignore", r"Glyph .* missing from font", UserWarning)
        yield


def new_figure(width: float, height: float, title: str) -> Figure:
    """Return an empty figure, in inches, whose layout keeps everything apart."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    lines = textwrap.wrap(title, int(TITLE_CHARACTERS * width))
    figure.suptitle("\n".join(lines), x=0.01, ha="left", fontsize=11, fontweight="bold", color=INK)
    return figure


def save(figure: Figure, path: Path) -> Path:
    """Write the figure as a PNG file."""
    with written_whole(path) as temporary:
        figure.savefig(temporary, format="png")
    return path


def generation_colour(generation: int, last: int) -> Colour:
    """From early, bright, to late, dark, for the generations 0 to `last`; safe for colour-blind people."""
    red, green, blue, alpha = _generations(last).to_rgba(np.array([generation]))[0]
    return float(red), float(green), float(blue), float(alpha)


def generation_bar(figure: Figure, axes: Sequence[Axes], last: int) -> None:
    """Draw the key of `generation_colour`, beside the axes; nothing with just the warm-up."""
    if last:
        ticks = MaxNLocator(6, integer=True)
        bar = figure.colorbar(_generations(last), ax=list(axes), shrink=0.7, aspect=30, pad=0.015, ticks=ticks)
        bar.set_label("generation (0: warm-up)")
        bar.outline.set_visible(False)


def legend_below(figure: Figure, handles: Sequence[Artist], columns: int) -> None:
    """Draw the legend of all axes, below them; in so many columns, or as many as there is room for."""
    for count in range(columns, 0, -1):
        legend = figure.legend(handles=handles, loc="outside lower center", ncols=count)
        if legend.get_window_extent().width <= figure.bbox.width or count == 1:
            return
        legend.remove()


def label_axes(axes: Axes, x: Objective, y: Objective) -> None:
    """Label both axes of returns as people say them: quantity, unit, numbers. The better stays to the right and up."""
    for axis, objective in ((axes.xaxis, x), (axes.yaxis, y)):
        axis.set_label_text(axis_label(objective))
        axis.set_major_formatter(ReadingFormatter(objective))


def axis_label(objective: Objective) -> str:
    """Return the quantity, its unit, and that less is better where an axis runs from the larger to the smaller."""
    less = ", less is better" if objective.read.less_is_better else ""
    return f"{objective.label} ({objective.read.unit}{less})"


class ReadingFormatter(Formatter):
    """Writes the ticks of an axis of returns as people say them, with as many decimals as tell them apart."""

    def __init__(self, objective: Objective):
        self.objective = objective

    def format_ticks(self, values: Sequence[float]) -> list[str]:
        """Return a text for each tick."""
        numbers = self.objective.read.of(values)
        enough = (
            count for count in range(MOST_PLACES) if np.allclose(numbers, numbers.round(count), rtol=0, atol=1e-9)
        )
        places = next(enough, None) if np.abs(numbers).max(initial=0.0) < LARGE else None
        return [minus(f"{number:z.5g}" if places is None else f"{number:z.{places}f}") for number in numbers]

    def __call__(self, value: float, position: int | None = None) -> str:
        """Return the text of one tick."""
        return self.format_ticks([value])[0]


def note(axes: Axes, text: str) -> None:
    """Write a small remark above the axes, at their right end."""
    axes.set_title(text, loc="right", fontsize=8, color=GREY)


def _generations(last: int) -> ScalarMappable:
    viridis = matplotlib.colormaps["viridis_r"]
    without_yellow = ListedColormap(viridis(np.linspace(0.12, 1.0, 256)))  # hard to see on white
    return ScalarMappable(Normalize(min(last - 1, 0), last), without_yellow)

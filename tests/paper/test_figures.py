"""Pictures hide nothing: equal seeds are apart, and what is cut is said."""

import numpy as np

from jmorl.experiments.targets import target_row
from jmorl.paper.figures import curves_figure, finals_figure, stacked, targets_figure
from jmorl.paper.plan import ITEMS
from jmorl.paper.results import Curves
from tests.experiments.made import ITERATION, record

SEEDS = (1, 7, 10)


def texts(figure):
    return [text.get_text() for axes in figure.axes for text in axes.texts]


def test_equal_values_are_stacked_around_their_line():
    assert stacked([5.0, 3.0, 5.0, 5.0]) == [-0.2, 0.0, 0.0, 0.2]
    assert stacked([1.0, 2.0]) == [0.0, 0.0]


def test_every_seed_has_a_place_of_its_own():
    records = [record([[(-70.0, -40.0)]]) for _ in SEEDS]
    rows = [
        target_row("A", (-80.0, -50.0), method, SEEDS, records, 50 * ITERATION) for method in ("interactive", "pgmorl")
    ]
    axes = targets_figure(rows, "title").axes[0]
    places = [
        (line.get_xdata()[0], round(float(line.get_ydata()[0]), 6)) for line in axes.lines if len(line.get_xdata()) == 1
    ]
    assert len(places) == len(set(places)) == 6


def test_what_a_picture_of_curves_cuts_is_said():
    steps = np.arange(8) * 240_000
    course = np.array([-900.0, -90, -60, -55, -54, -54, -53, -53])
    rows = [Curves("A", method, SEEDS, steps, np.stack([course] * 3)) for method in ("interactive", "pgmorl")]
    assert texts(curves_figure(rows, ITEMS["fig5"], "raw", "title")) == ["not shown: the beginning, down to -900"]
    flat = [Curves("A", "pgmorl", SEEDS, steps, np.stack([course[1:4].repeat(3)[:8]] * 3))]
    assert texts(curves_figure(flat, ITEMS["fig5"], "raw", "title")) == []


def test_what_a_picture_of_final_policies_cuts_is_said():
    from jmorl.paper.analysis import finals

    front = [(-70.0 - x, -60.0 + x) for x in range(9)] + [(-900.0, -1.0)]
    found = finals([record([[(-71.0, -58.0)]])], [record([front])], (0.5, 0.5), 10 * ITERATION)
    (text,) = texts(finals_figure({"A": found}, ITEMS["fig9"], "raw", "title"))
    assert text == "not shown: far policies of the pooled front, 1"

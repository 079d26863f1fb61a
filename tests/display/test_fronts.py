"""A front as a table and as a plot in text."""

import io

import numpy as np
import pytest

from envs.core import Objective
from jmorl.display.console import PlainConsole
from jmorl.display.fronts import front_scatter, front_table
from jmorl.search.policy import Policy

OBJECTIVES = (Objective("time", "time", "-steps"), Objective("fuel", "fuel", "-litres"))
VALUES = np.array([[-70.0, -40.0], [-66.25, -57.0], [-100.0, -20.0]])


def policies(values, std=0.5):
    return [
        Policy(10 + index, index, None, np.array([0.3, 0.7]), value, np.full(2, std), value, None)
        for index, value in enumerate(np.asarray(values, float))
    ]


def printed(renderable, width=80, **terminal):
    file = io.StringIO()
    PlainConsole(file=file, width=width, **terminal).print(renderable)
    return file.getvalue()


def rows(table):
    return [line.split() for line in printed(table).splitlines()]


@pytest.mark.parametrize(("by", "order"), [(0, ["11", "10", "12"]), (1, ["12", "10", "11"])])
def test_rows_are_sorted_by_an_objective_the_best_first(by, order):
    assert [row[0] for row in rows(front_table(policies(VALUES), OBJECTIVES, by=by))[3:]] == order


def test_a_row_says_all_about_a_policy():
    table = front_table(policies(VALUES), OBJECTIVES, chosen_id=12, previous_id=11)
    head, units, _, best, _, last = rows(table)
    assert head == ["time", "fuel"]
    assert units == ["policy", "(-steps)", "(-litres)", "weights", "round"]
    assert best == ["11", "-66.2", "±0.5", "-57.0", "±0.5", "0.3", "0.7", "1", "last", "choice"]
    assert last == ["12", "-100.0", "±0.5", "-20.0", "±0.5", "0.3", "0.7", "2", "chosen"]


def test_numbers_stand_under_each_other():
    one, other = front_table(policies([[-1.5, -5], [-100, -4]]), OBJECTIVES), policies([[-1.5, -5], [-100, -4]], 12.5)
    for table in (one, front_table([policies([[-1.5, -5]])[0], other[1]], OBJECTIVES)):
        lines = printed(table).splitlines()[3:]
        for text in (("-1.5", "-100.0"), ("-5.00", "-4.00")):
            ends = [line.index(number) + len(number) for line, number in zip(lines, text, strict=True)]
            assert ends[0] == ends[1]


def test_policies_outside_the_bounds_are_dim():
    table = front_table(policies(VALUES), OBJECTIVES, bounds=np.array([-80.0, -np.inf]))
    assert [row[-1] for row in rows(table)[3:]] == ["1", "0", "bounds"]
    lines = printed(table, force_terminal=True, color_system="standard").splitlines()[3:]
    assert ["\x1b[2m" in line for line in lines] == [False, False, True]


@pytest.mark.parametrize("width", [40, 80, 100])
@pytest.mark.parametrize("label", ["time", "riding comfort"])
def test_a_plot_keeps_to_its_size_in_plain_characters(width, label):
    objectives = (Objective("x", label, "-steps"), OBJECTIVES[1])
    values = np.random.default_rng(0).normal(-500, 100, (12, 2))
    values[0] = -9000  # far out
    lines = front_scatter(objectives, values, {"x": values[3]}, width, 18).plain.split("\n")
    assert max(map(len, lines)) <= width and len(lines) == 18
    assert all(line.isascii() for line in lines)


def test_a_plot_has_its_points_where_they_belong():
    text = front_scatter(OBJECTIVES, VALUES, {"x": VALUES[0]}, 60, 16).plain
    marks = [
        (column, line, character)
        for line, content in enumerate(text.split("\n")[1:-3])
        for column, character in enumerate(content[13:])
        if character in "ox"
    ]
    # The front falls from the left to the right; lines are counted from the top.
    assert [character for _, _, character in sorted(marks)] == ["o", "x", "o"]
    assert [line for _, line, _ in sorted(marks)] == sorted(line for _, line, _ in marks)


def test_a_plot_leaves_out_what_is_far_out_unless_it_is_marked():
    values = np.array([[-70.0, -40], [-72, -39], [-75, -38], [-77, -37], [-80, -36], [-999, 0]])
    near = front_scatter(OBJECTIVES, values, {}, 70, 18).plain
    assert "\n(1 policy far out)" in near
    assert near.split("\n-----")[0].count("o") == 5
    marked = front_scatter(OBJECTIVES, values, {"x": values[5]}, 70, 18).plain
    assert marked.count("x") == 1 and "far out" not in marked
    assert min(float(word) for word in marked.split("\n")[-1].replace("|", "").split()) < -900

"""A front as a table and as a plot in text."""

import io

import numpy as np
import pytest
from rich.console import Console

from envs.core import Objective
from jmorl.report.fronts import front_scatter, front_table
from jmorl.search.policy import Policy

OBJECTIVES = (Objective("time", "time", "-steps"), Objective("fuel", "fuel", "-litres"))
VALUES = np.array([[-70.0, -40.0], [-66.25, -57.0], [-100.0, -20.0]])


def policies(values, spread=0.5):
    return [
        Policy(10 + index, index, None, np.array([0.3, 0.7]), value, np.full(2, spread), value, None)
        for index, value in enumerate(np.asarray(values, float))
    ]


def printed(renderable, width=80, **terminal):
    file = io.StringIO()
    Console(file=file, width=width, **terminal).print(renderable)
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
    assert units == ["policy", "(-steps)", "(-litres)", "weights", "gen"]
    assert best == ["11", "-66.2", "±0.5", "-57.0", "±0.5", "0.3", "0.7", "1", "last", "choice"]
    assert last == ["12", "-100.0", "±0.5", "-20.0", "±0.5", "0.3", "0.7", "2", "chosen"]


def test_numbers_stand_under_each_other():
    lines = printed(front_table(policies([[-1.0, -5], [-100, -4]], spread=12.5), OBJECTIVES)).splitlines()[3:]
    assert lines[0].index("±") == lines[1].index("±")
    assert lines[0].index("-1 ") + 1 == lines[1].index("-100 ") + 3


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
    marks = {
        (column, line)
        for line, content in enumerate(text.split("\n")[:12])
        for column, character in enumerate(content[13:])
        if character in "ox"
    }
    by_time = sorted(marks)
    assert len(by_time) == 3
    # The front falls from the left to the right, where lines are counted from the top.
    assert [line for _, line in by_time] == sorted(line for _, line in marks)
    assert text.count("x") == 1


def test_a_plot_leaves_out_what_is_far_out_unless_it_is_marked():
    values = np.array([[-70.0, -40], [-72, -39], [-75, -38], [-77, -37], [-80, -36], [-999, 0]])
    near = front_scatter(OBJECTIVES, values, {}, 70, 18).plain
    assert near.count("o") == 5 and "(1 policy far out)" in near and "-999" not in near
    marked = front_scatter(OBJECTIVES, values, {"x": values[5]}, 70, 18).plain
    assert marked.count("x") == 1
    assert min(float(word) for word in marked.split("\n")[-2].replace("|", "").split()) < -900

"""Branches beside each other: what is read of them, and what the chart shows."""

import json
import shutil

import numpy as np
import pytest

import envs
from jmorl.storage.notes_file import change_note
from jmorl.storage.resume import branch
from jmorl.storage.stored_run import StoredRunError, read_front, read_run
from jmorl.studio import comparison
from jmorl.studio.charts.comparison_chart import COLOURS, SYMBOLS, comparison_options
from jmorl.studio.comparison import read_fronts
from jmorl.studio.history import read_tree
from jmorl.studio.view import stored_view


@pytest.fixture
def runs(whole, tmp_path):
    """Copy a run that has ended; make a branch of it, with a name."""
    shutil.copytree(whole, tmp_path / "first")
    branch(tmp_path / "first", 1, tmp_path / "second").folder.close()
    change_note(tmp_path / "second", None, name="<b>slow</b>")
    return tmp_path


@pytest.fixture
def objectives(small_config):
    return envs.make(small_config.env).objectives


def compared(runs, objectives):
    return read_fronts(read_tree(runs / "first"), objectives)


def ids(series):
    return [point["value"][0] if isinstance(point, dict) else point[0] for point in series["data"]]


def test_the_front_and_the_result_are_read_alone(runs, objectives):
    run, front = read_run(runs / "first"), read_front(runs / "first", objectives)
    assert front.ids == tuple(policy.id for policy in run.front) and front.result[0] == run.chosen.id
    np.testing.assert_array_equal(front.values, [policy.values for policy in run.front])
    np.testing.assert_array_equal(front.result[1], run.chosen.values)
    for file in ("metrics.csv", "policies.csv"):
        (runs / "first" / file).unlink()
    shutil.rmtree(runs / "first" / "policies")  # no network is looked at
    assert read_front(runs / "first", objectives).ids == front.ids
    assert read_front(runs / "second", objectives).result is None


@pytest.mark.parametrize(("file", "text"), [("front.csv", "policy\n1\n"), ("result.json", "{}")])
def test_a_front_that_cannot_be_read_is_told_of_and_the_others_are_shown(runs, objectives, file, text):
    (runs / "first" / file).write_text(text)
    with pytest.raises(StoredRunError, match=file):
        read_front(runs / "first", objectives)
    found = compared(runs, objectives)
    assert [each.branch.name for each in found.fronts] == ["second"] and found.fronts[0].place == 1
    assert len(found.problems) == 1 and file in found.problems[0]


def test_what_has_not_changed_is_not_read_again(runs, objectives, monkeypatch):
    read = []

    def noting(path, objectives):
        read.append(path.name)
        return read_front(path, objectives)

    monkeypatch.setattr(comparison, "read_front", noting)
    compared(runs, objectives)
    compared(runs, objectives)
    assert sorted(read) == ["first", "second"]
    result = runs / "first" / "result.json"
    fields = json.loads(result.read_text())
    fields["chosen"]["value_north"] = 123.0
    result.unlink()
    result.write_text(json.dumps(fields))
    changed = compared(runs, objectives).fronts[0].front
    assert sorted(read) == ["first", "first", "second"] and changed.result[1][0] == 123.0
    (runs / "second" / "front.csv").unlink()
    assert [each.branch.name for each in compared(runs, objectives).fronts] == ["first"]


def test_each_branch_has_points_of_its_own_and_a_star_for_its_result(runs, objectives):
    found, view = compared(runs, objectives), stored_view(runs / "second")
    everything = {each.branch.run for each in found.fronts}
    options = comparison_options(view, (2, 0), found, everything)
    first, second = options["series"]
    assert options["legend"]["data"] == [first["name"], second["name"]] == ["first", 'second "<b>slow</b>"']
    assert first["symbol"] != second["symbol"] and first["itemStyle"] != second["itemStyle"]
    front = found.fronts[0].front
    *points, star = first["data"]
    assert ids(first) == [*front.ids, front.result[0]] and star["symbol"].startswith("path://")
    assert "the result\nfirst" in star["value"] and all(not isinstance(point, dict) for point in second["data"])
    for point, values in zip(points, front.values, strict=True):
        assert [point[first["encode"][axis]] for axis in "xy"] == [values[2], values[0]]
        np.testing.assert_allclose(point[1:4], values, rtol=1e-6)
    assert "west" in options["xAxis"]["name"] and "north" in options["yAxis"]["name"]
    assert options["tooltip"]["renderMode"] == "richText"
    json.dumps(options, allow_nan=False)


def test_a_branch_that_is_left_out_leaves_the_looks_of_the_others(runs, objectives):
    found, view = compared(runs, objectives), stored_view(runs / "first")
    runs_of = [each.branch.run for each in found.fronts]
    both = comparison_options(view, (0, 1), found, set(runs_of))
    one = comparison_options(view, (0, 1), found, {runs_of[1]})
    assert [each["id"] for each in one["series"]] == runs_of and not one["series"][0]["data"]
    assert one["legend"]["data"] == ['second "<b>slow</b>"']
    for name in ("symbol", "itemStyle"):
        assert one["series"][1][name] == both["series"][1][name]
    none = comparison_options(view, (0, 1), found, set())
    assert all(not each["data"] for each in none["series"])
    json.dumps(none, allow_nan=False)


def test_what_is_far_out_stands_at_the_edge(runs, objectives):
    found, view = compared(runs, objectives), stored_view(runs / "first")
    front = found.fronts[1].front
    values = np.concatenate([front.values[0] + np.random.default_rng(0).normal(size=(20, 3)), [[-1e6, 0.0, 0.0]]])
    stray = type(front)(tuple(range(21)), values, None)
    fronts = (type(found.fronts[0])(found.fronts[1].branch, 1, stray),)
    options = comparison_options(view, (0, 1), type(found)(fronts, ()), {fronts[0].branch.run})
    point = options["series"][0]["data"][-1]
    assert point[1] == -1e6 and point[options["series"][0]["encode"]["x"]] == options["xAxis"]["min"] > -1e5
    assert "far out" in point[4] and not options["series"][0]["clip"]


def test_many_branches_can_be_told_apart():
    assert len({(COLOURS[place % len(COLOURS)], SYMBOLS[place % len(SYMBOLS)]) for place in range(30)}) == 30

"""What the charts and the sentences say, against a view made by hand."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from envs.core import Objective, Reading
from jmorl.config import resolve
from jmorl.decision.protocol import Question
from jmorl.report.timeline import Timeline
from jmorl.search.policy import Confirmation, Policy
from jmorl.search.prospect import Prospect
from jmorl.storage.notes_file import Note, Notes
from jmorl.studio import dialogue, texts
from jmorl.studio.charts.curves import curve_options
from jmorl.studio.charts.front_chart import front_marks, front_options
from jmorl.studio.charts.parallel_chart import parallel_marks, parallel_options
from jmorl.studio.selection import Selection, wanted
from jmorl.studio.view import Generation, View

VALUES = {4: (-80.0, -20.0), 9: (-70.0, -40.0), 2: (-60.0, -60.0), 5: (-90.0, -10.0)}


def policy(number, values):
    vectors = {name: np.array(values) for name in ("values", "discounted")}
    return Policy(number, 1, None, np.array([0.5, 0.5]), std=np.array([0.5, 2.0]), snapshot=None, **vectors)


@pytest.fixture
def view():
    """Return a view with four policies, the bounds of a choice, and a question."""
    front = tuple(policy(number, values) for number, values in VALUES.items())
    objectives = (Objective("time", "time", "-steps"), Objective("fuel", "<b>fuel</b>", "-J"))
    bounds = np.array([-82.0, -45.0])
    before = Generation(0, np.array([[-99.0, -50.0]]), 1000, 3.5, None)
    now = Generation(1, np.array(list(VALUES.values())), 2000, 4.5, None)
    config = resolve()
    question = Question("steer", 2, objectives, front, bounds, 4)
    timeline = Timeline(config, since=0.0, phase="question", generation=2)
    choices = ((1, front[0].values),)
    return View(
        *(Path("run"), "id", config, objectives, (before, now), front, bounds, front[0], choices, timeline),
        question=question,
    )


def series(options):
    return {each["name"]: each for each in options["series"]}


def test_numbers_are_as_people_say_them(view):
    """Points stay where their returns are, so that the better is to the right and above; only the numbers differ."""
    time = replace(view.objectives[0], reading=Reading("steps", less_is_better=True))
    height = replace(view.objectives[1], reading=Reading("m", mean_over=10))
    read = replace(view, objectives=(time, height))
    values = np.array([*VALUES.values()])
    options, plain_options = (front_options(each, (0, 1), None) for each in (read, view))
    assert series(options)["within the bounds"]["data"] == series(plain_options)["within the bounds"]["data"]
    assert options["xAxis"]["name"] == "time (steps), better →" and options["xAxis"]["max"] > -60
    ticks = [options[axis]["axisLabel"][":formatter"] for axis in ("xAxis", "yAxis")]
    assert "[-1.0, 0]" in ticks[0] and "[0.1, 0]" in ticks[1]  # scale, and decimals
    assert texts.score_of_each(read, view.front[0])[0] == f"{-VALUES[view.front[0].id][0]:.1f} ±0.5 steps"
    assert texts.ranges(read)[0] == f"{-values[:, 0].min():.1f} to {-values[:, 0].max():.1f}"
    assert texts.heading(replace(read, question=None, timeline=None, result=view.front[0]), Selection()).endswith(
        texts.end_with(read, Selection(), view.front[0]).split(": ")[1]
    )


def test_a_point_is_where_its_values_are_and_on_the_right_side_of_the_bounds(view):
    shown = series(front_options(view, (1, 0), None))
    inside, outside = shown["within the bounds"], shown["outside the bounds"]
    assert {point[0] for point in inside["data"]} == {4, 9} and {point[0] for point in outside["data"]} == {2, 5}
    for point in (*inside["data"], *outside["data"]):
        assert tuple(point[1:3]) == VALUES[point[0]]
    assert inside["encode"] == {"x": 2, "y": 1}
    options = front_options(view, (1, 0), None)
    assert shown["bounds"]["markArea"]["data"] == [
        [{"coord": [-45.0, -82.0]}, {"coord": [options["xAxis"]["max"], options["yAxis"]["max"]]}]
    ]
    assert shown["earlier fronts"]["data"] == [[0, -99.0, -50.0, ""]] and shown["earlier fronts"]["silent"]


def test_axes_hold_the_front_the_bounds_and_the_choice(view):
    options = front_options(replace(view, bounds=np.array([-200.0, -45.0])), (0, 1), None)
    assert options["xAxis"]["min"] < -200 and options["xAxis"]["max"] > -60
    assert options["yAxis"]["min"] < -60 and options["yAxis"]["max"] > -10
    assert "time (-steps)" in options["xAxis"]["name"] and "better" in options["xAxis"]["name"]


def test_what_is_far_out_is_at_the_edge_with_an_arrow_and_its_value(view):
    assert series(front_options(view, (0, 1), None))["far out"]["data"] == []
    with_stray = replace(view, front=(*view.front, policy(6, (-75.0, -30.0)), policy(7, (-900.0, -25.0))))
    for axes, edge, turned in (((0, 1), "x", 90), ((1, 0), "y", 180)):
        options = front_options(with_stray, axes, None)
        low = options["xAxis" if edge == "x" else "yAxis"]["min"]
        assert low > -200
        drawn = series(options)["far out"]
        (arrow,) = drawn["data"]
        number, *values, note = arrow["value"][:4]
        assert (number, values, note) == (7, [-900.0, -25.0], "far out")
        assert arrow["value"][drawn["encode"][edge]] == low and arrow["symbolRotate"] == turned
        assert arrow["label"]["formatter"] == "time −900.0" and not drawn["clip"]
        assert 7 not in [
            point[0] for name in ("within", "outside") for point in series(options)[f"{name} the bounds"]["data"]
        ]
        laid_out = series(front_marks(with_stray, Selection().with_policy(7), axes, None))["laid out"]
        assert laid_out["data"][0]["value"][laid_out["encode"][edge]] == low


def test_nothing_in_a_chart_is_html_and_all_of_it_is_json(view):
    asked = dialogue.begin(view.front, view.objectives, 1, 3, 2).question
    empty = replace(view, front=(), generations=(), previous=None, choices=(), bounds=np.full(2, -np.inf))
    for shown in (view, empty):
        for options in (
            front_options(shown, (0, 1), asked),
            parallel_options(shown),
            curve_options(shown),
        ):
            assert options["tooltip"]["renderMode"] == "richText"
            assert all("renderMode" not in each.get("tooltip", {}) for each in options["series"])
            json.dumps(options, allow_nan=False)
        selection = Selection().with_policy(9)
        for marks in (front_marks(shown, selection, (0, 1), asked), parallel_marks(shown, selection)):
            assert all(each["silent"] and "tooltip" not in each for each in marks["series"])
            json.dumps(marks, allow_nan=False)


def test_marks_lie_exactly_over_the_chart(view):
    """Whatever the labels are, which the marks' chart has not: it has the same room for them."""
    long = replace(view, front=(*view.front, policy(8, (-1234567.0, -1e7))))
    for shown_view in (view, long):
        selection = Selection().with_policy(9)
        chart, marks = front_options(shown_view, (1, 0), None), front_marks(shown_view, selection, (1, 0), None)
        for axis in ("xAxis", "yAxis"):
            assert [chart[axis][end] for end in ("min", "max")] == [marks[axis][end] for end in ("min", "max")]
            assert chart[axis]["show"] and not marks[axis]["show"]
        assert chart["grid"] == marks["grid"] and chart["grid"]["outerBoundsMode"] == "none"
    lines, marked = parallel_options(view), parallel_marks(view, Selection().with_policy(9))
    for shown, hidden in zip(lines["parallelAxis"], marked["parallelAxis"], strict=True):
        assert (shown["min"], shown["max"]) == (hidden["min"], hidden["max"]) and not hidden["name"]
    assert all(lines["parallel"][side] == marked["parallel"][side] for side in ("left", "right", "top", "bottom"))


def test_charts_have_the_same_series_whatever_there_is_to_see(view):
    """The browser's chart merges what it is sent into what it has."""
    asked = dialogue.begin(view.front, view.objectives, 1, 3, 2).question
    empty = replace(view, front=(), generations=(), previous=None, choices=(), bounds=np.full(2, -np.inf))
    for much, little in (
        (front_options(view, (0, 1), asked), front_options(empty, (0, 1), None)),
        (front_marks(view, Selection().with_policy(9), (0, 1), asked), front_marks(empty, Selection(), (0, 1), None)),
        (parallel_options(view), parallel_options(empty)),
        (parallel_marks(view, Selection().with_policy(9)), parallel_marks(empty, Selection())),
        (curve_options(view), curve_options(empty)),
    ):
        assert list(series(much)) == list(series(little))


def test_what_cannot_be_chosen_says_why(view):
    gone = policy(77, (-99.0, -99.0))
    final = replace(view, question=replace(view.question, purpose="final", front=view.front[:2]))
    for each in (view, final):
        assert "cannot be chosen" in texts.remark(replace(each, previous=gone), gone)


def test_the_last_question_says_how_far_scores_can_be_trusted(view):
    """Every policy of the front can be the result, with a word where it lies outside, or may be lucky."""
    sure = replace(view.front[0], confirmation=Confirmation(view.front[0].values, view.front[0].std, 128, np.ones(2)))
    front = sure, *view.front[1:]
    question = replace(view.question, purpose="final", front=front[:2], others=front[2:])
    final = replace(view, question=question, front=front)
    assert texts.remark(final, sure) == "Scores from 128 fresh episodes."
    assert texts.remark(final, front[1]).startswith("Scores from the search")
    assert texts.remark(final, front[2]).startswith("Outside the search area. Scores from the search")
    assert all(final.choosable(policy.id) for policy in front)


def test_the_axes_hold_the_choices_and_what_enautilus_shows(view):
    first = np.array([-130.0, -70.0])
    options = front_options(replace(view, choices=((1, first), *view.choices)), (0, 1), None)
    assert options["xAxis"]["min"] < -130 and options["yAxis"]["min"] < -70
    asked = dialogue.begin(view.front, view.objectives, 1, 3, 2).question
    options = front_options(replace(view, bounds=np.full(2, -np.inf)), (0, 1), asked)
    you = series(front_marks(view, Selection(), (0, 1), asked))["points of E-NAUTILUS"]["data"][0]["value"][1:3]
    assert options["xAxis"]["min"] < you[0] and options["yAxis"]["min"] < you[1]


def test_the_journey_ends_with_the_end(view):
    choices = ((2, view.front[0].values), (3, view.front[1].values))
    ended = replace(view, choices=choices, result=view.front[1], question=None)
    generations = (*view.generations, replace(view.generations[-1], number=2))
    labels = [
        each["label"]["formatter"]
        for each in series(front_options(replace(ended, generations=generations), (0, 1), None))["choices"]["data"]
    ]
    assert labels == ["2", "end"]


def test_scores_in_other_units_have_the_raw_returns_beside_them(view):
    assert texts.raw_returns(view, view.front[0]) == ""
    scored = replace(view.front[0], raw=np.array([-812.0, -20.5]))
    assert texts.raw_returns(view, scored) == "raw returns: time −812, <b>fuel</b> −20.5"


def test_lines_say_which_policy_they_are(view):
    formatter = series(parallel_options(view))["within the bounds"]["tooltip"][":formatter"]
    assert '[["time (-steps)", 1.0], ["<b>fuel</b> (-J)", 1.0]]' in formatter
    assert "p.data[objectives.length]" in formatter


def test_tooltips_have_the_names_that_policies_were_given(view):
    noted = Notes(policies={9: Note("careful one"), 2: Note("</b>"), 5: Note(favourite=True)})
    named = replace(view, noted=noted, front=(*view.front, policy(6, (-75.0, -30.0)), policy(7, (-900.0, -25.0))))
    shown = series(
        front_options(replace(named, noted=replace(noted, policies={**noted.policies, 7: Note("stray")})), (0, 1), None)
    )
    notes = {point[0]: point[3] for name in ("within", "outside") for point in shown[f"{name} the bounds"]["data"]}
    outside = "outside the search area"
    assert notes == {4: "", 9: '"careful one"', 2: f'"</b>", {outside}', 5: outside, 6: ""}
    assert shown["far out"]["data"][0]["value"][3] == '"stray", far out'
    lines = series(parallel_options(named))
    assert [line[2:] for line in lines["within the bounds"]["data"]] == [[4, ""], [9, '"careful one"'], [6, ""]]
    assert [line[2:] for line in lines["outside the bounds"]["data"]][:2] == [[2, '"</b>"'], [5, ""]]


def test_texts_name_policies_as_somebody_has(view):
    named = replace(view, noted=Notes(policies={4: Note("careful one"), 2: Note("fast one")}))
    assert texts.keep(named) == 'Keep policy 4 "careful one"'
    long = replace(view, noted=Notes(policies={4: Note("careful one that never slips")}))
    assert texts.keep(long) == 'Keep policy 4 "careful one that…"'  # there is little room for it
    assert "slips" in texts.end_with(long, Selection(), view.front[0])
    selection = Selection(more_of=0, than=4)
    assert texts.heading(named, selection) == '2 policies better in time than policy 4 "careful one"'
    ended = replace(named, question=None, result=view.front[2], timeline=None)
    assert texts.heading(ended, Selection()).startswith('The result is policy 2 "fast one": time ')
    person = resolve(overrides={"user": "terminal"})
    between = replace(named, question=None, stand_in="it is clear", config=person)
    assert texts.heading(between, Selection()) == 'Policy 4 "careful one" was chosen for you: it is clear.'
    assert texts.end_with(named, Selection(), view.front[2]).startswith('End with policy 2 "fast one": time ')


def test_what_a_choice_would_bring_is_drawn_for_the_policy_in_focus(view):
    expected = np.array([[-65.0, -30.0], [-75.0, -15.0]])
    prospect = Prospect(np.array([-75.0, -42.0]), np.array([False, True, False, False]), expected, odds=0.3)
    selection = replace(Selection().with_policy(4).with_policy(9), prospects={9: prospect})
    shown = series(front_marks(view, selection, (0, 1), None))
    assert shown["bounds that would follow"]["markArea"]["data"][0][0] == {"coord": [-75.0, -42.0]}
    assert [point[1:3] for point in shown["expected by the model"]["data"]] == expected.tolist()
    assert [point["label"]["formatter"] for point in shown["laid out"]["data"]] == ["A", "B"]
    answered = series(front_marks(replace(view, question=None), selection, (0, 1), None))
    assert not answered["expected by the model"]["data"]
    unfocused = series(front_marks(view, replace(selection, focus=4), (0, 1), None))
    assert (
        not unfocused["bounds that would follow"]["markArea"]["data"] and not unfocused["expected by the model"]["data"]
    )
    text = texts.outlook(view, selection)
    # Whole points, and never the best of each joined.
    assert text == (
        "If you choose B: the search narrows to the dashed area, with 1 of 4 policies. It may find time −65.0, "
        "<b>fuel</b> −30.0; or time −75.0, <b>fuel</b> −15.0. 3 of 10 such forecasts come true."
    )
    assert texts.outlook(view, replace(selection, focus=4)) == "If you choose A: …"  # is being worked out
    assert texts.outlook(replace(view, question=None), selection) == ""
    lines = series(parallel_marks(view, selection))
    assert lines["bounds that would follow"]["data"] == [[-75.0, -42.0]]
    assert series(parallel_marks(replace(view, question=None), selection))["bounds that would follow"]["data"] == []


def test_lines_across_the_axes_have_the_values_of_the_policies(view):
    shown = series(parallel_options(view)) | series(parallel_marks(view, Selection().with_policy(2)))
    assert {line[2]: tuple(line[:2]) for line in shown["within the bounds"]["data"]} == {
        number: VALUES[number] for number in (4, 9)
    }
    assert shown["bounds"]["data"] == [[-82.0, -45.0]]
    assert shown["laid out"]["data"][0]["value"] == [*VALUES[2], 2]


@pytest.mark.parametrize(("objective", "than", "expected"), [(0, 4, [9, 2]), (1, 4, [5]), (0, None, [5, 4, 9, 2])])
def test_more_of_an_objective_lists_the_least_change_first(view, objective, than, expected):
    selection = Selection(more_of=objective, than=than)
    assert wanted(view, selection) == expected
    rings = series(front_marks(view, selection, (0, 1), None))["more of an objective"]["data"]
    assert {ring[0] for ring in rings} == set(expected)


def test_what_does_not_reach_the_limits_is_grey(view):
    def areas(axes, *limits):
        return series(front_marks(view, Selection(limits=limits or None), axes, None))["limits"]["markArea"]["data"]

    assert areas((0, 1)) == [] == areas((0, 1), -np.inf, -np.inf)
    options = front_options(view, (0, 1), None)
    (left, right), (low, high) = ([options[axis][end] for end in ("min", "max")] for axis in ("xAxis", "yAxis"))
    assert areas((0, 1), -75.0, -np.inf) == [[{"coord": [left, low]}, {"coord": [-75.0, high]}]]
    assert areas((0, 1), -np.inf, -30.0) == [[{"coord": [left, low]}, {"coord": [right, -30.0]}]]
    assert len(areas((1, 0), -75.0, -30.0)) == 2
    assert areas((0, 1), 50.0, -np.inf) == [[{"coord": [left, low]}, {"coord": [right, high]}]]


def test_with_nothing_wanted_there_is_no_ring(view):
    assert wanted(view, Selection()) is None
    assert not series(front_marks(view, Selection(), (0, 1), None))["more of an objective"]["data"]


def test_the_heading_says_what_is_asked(view):
    assert texts.heading(view, Selection()) == "Round 2: which of these 4 policies do you prefer?"
    last = replace(view, timeline=replace(view.timeline, generation=view.timeline.generations))
    assert texts.heading(last, Selection()).endswith("This is the last round: after it you choose the result.")
    assert texts.heading(view, Selection(more_of=0, than=4)) == "2 policies better in time than policy 4"
    final = replace(view, question=replace(view.question, purpose="final"))
    assert texts.heading(final, Selection()) == "The run is over. Which of these 4 policies is its result?"
    ended = replace(view, question=None, result=view.front[2], timeline=None)
    assert texts.heading(ended, Selection()) == "The result is policy 2: time −60.0, <b>fuel</b> −60.0"


@pytest.mark.parametrize(
    ("silent", "user", "text"),
    [
        (1, "terminal", "You are asked when this round is over, unless your answers leave no doubt."),
        (3, "terminal", "You are asked again in 3 rounds, unless your answers leave no doubt."),
        (99, "terminal", "You are asked again in 9 rounds, unless your answers leave no doubt."),  # as many as are left
        (None, "terminal", "You are asked once, at the end."),
        (1, "A", "User A decides; you watch."),
    ],
)
def test_between_questions_the_heading_says_who_is_asked_and_when(view, silent, user, text):
    config, timeline = resolve(overrides={"user": user}), replace(view.timeline, silent=silent)
    assert texts.heading(replace(view, question=None, config=config, timeline=timeline), Selection()) == text


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({}, "Waiting for your answer"),
        ({"question": None, "timeline": None}, "Paused after round 1"),
        ({"problem": "the disk is full"}, "Stopped"),
    ],
)
def test_the_phase_says_what_is_waited_for(view, changes, text):
    assert texts.phase(replace(view, **changes), now=5.0) == text


def test_a_card_says_what_its_policy_is_to_the_person(view):
    chosen, better = view.front[0], policy(6, (-75.0, -15.0))
    newer = replace(view, answered=1)
    assert [texts.standing(newer, each) for each in view.front] == ["your last choice", "new", "new", "new"]
    assert texts.standing(replace(view, stand_in="it is clear"), chosen) == "chosen for you"
    replaced = replace(view, front=(*view.front[1:], better))
    assert texts.standing(replaced, better) == "has replaced your last choice"
    assert texts.keep(replace(replaced, question=replace(view.question, front=replaced.front))).startswith(
        "Take policy 6"
    )
    selection = Selection().with_policy(4).with_policy(9)
    assert texts.beside(view, selection, view.front[1]) == "Beside A: time 10.0 better, <b>fuel</b> 20.0 worse"
    assert texts.beside(view, selection, chosen) == ""


def test_a_failure_is_said_once_with_what_to_do(view):
    failed = replace(view, question=None, timeline=None, problem="the disk is full.")
    told = "Training has stopped: the disk is full. What the run had is kept."
    assert texts.heading(failed, Selection()) == f"{told} Go on when that is put right."
    again = texts.heading(replace(failed, for_good=True), Selection())
    assert again == f"{told} Going on would fail in the same way: step back in the history, and choose otherwise."


def test_a_minus_is_a_minus_only_before_a_number():
    assert texts.minus("x-velocity -3.5, 1e-05 [-2]") == "x-velocity −3.5, 1e-05 [−2]"

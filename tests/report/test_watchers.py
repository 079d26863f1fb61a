"""Watching a run: in lines, as JSON, live, or not at all."""

import io
import json
import threading
from dataclasses import replace

import numpy as np
import pytest

from jmorl.config import resolve
from jmorl.display.console import PlainConsole
from jmorl.events import GenerationFinished, Resumed
from jmorl.report.live import REFRESH_RATE, LiveView
from jmorl.report.progress import watcher
from tests.report.conftest import OBJECTIVES


def shown(kind, events, width=80, height=40, objectives=2, **config):
    file = io.StringIO()
    console = PlainConsole(file=file, width=width, height=height)
    with watcher(kind, resolve(overrides=config), OBJECTIVES[:objectives], console) as watching:
        for event in events:
            watching.show(event)
    return file.getvalue()


def test_there_is_a_line_for_every_event_and_the_result_as_a_table(make_events):
    events = make_events()
    lines = shown("lines", events).splitlines()
    assert lines[0].endswith("; training 2.64 M steps at about 40.0 k steps/s takes 1 min 6 s")
    starts = ["compiled in 3.2 s on 2 devices", "warm-up: 240 k steps, 23.5 k steps/s, front of 4,"]
    for generation in range(1, 11):
        starts += [f"choice for round {generation}: policy ", f"round {generation} of 10: "]
    starts += [
        "final choice: policy 58 ",
        "finished: the budget of environment steps is used up; the result is policy 58",
    ]
    assert len(starts) == len(events)
    for line, start in zip(lines, starts, strict=False):
        assert line.startswith(start)
    assert lines[len(starts) : len(starts) + 2] == ["", "Final front" + " " * (len(lines[len(starts) + 1]) - 11)]
    [chosen] = [line for line in lines if line.rstrip().endswith("chosen")]
    assert chosen.split()[:5] == ["58", "-91.7", "±0.9", "-38.9", "±0.4"]


def test_a_resumed_run_says_where_it_goes_on(make_events, capsys):
    events = make_events()
    warm_up, later = (
        Resumed(finished.state, finished.steps, finished.bounds, 0) for finished in (events[1], events[5])
    )
    assert shown("lines", [warm_up]) == "resumed after warm-up, with a front of 4\n"
    assert shown("lines", [later]).startswith("resumed after round 2 of 10, with a front of ")
    assert "choice for round 3" in shown("live", [events[0], later])
    shown("json", [later])
    assert json.loads(capsys.readouterr().out) == {"event": "resumed", "generation": 2, "steps": later.steps}


def test_a_choice_is_said_with_values_and_bounds(make_events):
    events = make_events()
    decided = events[2]
    time, fuel = decided.bounds
    words = "policy 2 (time -201, fuel -91.29) of 4 shown"
    bounds = f"bounds time ≥ {time:.0f}, fuel ≥ {fuel:.2f}"
    assert f"choice for round 1: {words}; {bounds}\n" in shown("lines", [decided])
    ranked = replace(decided, answer=replace(decided.answer, ranking=(2, 3, 0)))
    assert f"{words}, in the order 2, 3, 0; {bounds}\n" in shown("lines", [ranked])
    same = replace(decided, answer=replace(decided.answer, equal=True))
    assert f"{words}, no difference between them; {bounds}\n" in shown("lines", [same])
    for_long = replace(decided, generations_to_question=3)
    assert f"{words}; {bounds}, no question for 3 rounds\n" in shown("lines", [for_long])
    enough = replace(decided, answer=replace(decided.answer, stop=True))
    assert f"{words}, and stop\n" in shown("lines", [enough])


def test_a_person_without_utility_gets_no_utility(make_events):
    assert "utility" in shown("lines", make_events())
    assert "utility" not in shown("lines", make_events(has_utility=False))
    assert "utility" not in shown("live", make_events(has_utility=False))


def test_json_is_strict_and_complete(make_events, capsys):
    events = make_events()
    assert shown("json", events) == ""

    def refuse(constant):
        raise AssertionError(f"{constant} is no JSON")

    found = [json.loads(line, parse_constant=refuse) for line in capsys.readouterr().out.splitlines()]
    assert len(found) == len(events)
    assert [each["event"] for each in found[:4]] == ["compiled", "generation", "decided", "generation"]
    warm_up, last, finished = found[1], found[-3], found[-1]
    assert warm_up["bounds"] == [None, None] and warm_up["prediction_error"] is None
    finishes = [event for event in events if isinstance(event, GenerationFinished)]
    assert last["hypervolume"] == finishes[-1].front.hypervolume
    assert last["steps"] == 2_640_000 and last["generation"] == last["generations"] == 10
    assert [policy["policy"] for policy in last["front"]] == [p.id for p in finishes[-1].state.archive.members]
    assert found[2]["values"] == events[2].chosen.values.tolist() and found[2]["shown"] == 4
    assert np.isfinite(found[2]["bounds"]).all()
    assert finished["reason"] == "budget" and finished["chosen"]["policy"] == events[-1].chosen.id


def test_quiet_says_nothing(make_events, capsys):
    assert shown("quiet", make_events()) == ""
    assert capsys.readouterr() == ("", "")


def test_an_unknown_kind_is_refused():
    with pytest.raises(ValueError, match="'loud'; known: live, lines, json, quiet"):
        watcher("loud", resolve(), OBJECTIVES[:2], PlainConsole())


@pytest.mark.parametrize("objectives", [2, 3])
@pytest.mark.parametrize(("width", "height"), [(80, 24), (100, 40), (140, 60)])
def test_every_frame_of_a_live_view_fits_on_the_screen(make_events, width, height, objectives):
    now = iter(range(10_000))
    console = PlainConsole(file=io.StringIO(), width=width, height=height)
    view = LiveView(resolve(), OBJECTIVES[:objectives], console, clock=lambda: float(next(now)))
    for event in make_events(objectives=objectives, outliers=0):
        view.timeline = view.timeline.after(event, float(next(now)))
        lines = console.render_lines(view.panel())
        assert objectives == 3 or len(lines) < height
        texts = ["".join(segment.text for segment in line) for line in lines]
        assert all(len(text.rstrip()) <= width and "…" not in text for text in texts)


def test_a_live_view_tells_where_the_run_stands(make_events):
    file = io.StringIO()
    console = PlainConsole(file=file, width=90, height=40)
    clock = [0.0]
    view = LiveView(resolve(), OBJECTIVES[:2], console, clock=lambda: clock[0])
    for event in make_events()[:5]:  # up to the second choice
        view.timeline = view.timeline.after(event, clock[0])
    clock[0] = 2.6
    console.print(view.panel())
    text = file.getvalue()
    # A generation took 10.1 seconds; the second of ten is going on.
    for fact in (
        "round 2 of 10",
        "542 k of 2.64 M steps",
        "next question  in 7.5 s",
        "end            in about 1 min 28 s",
        "speed          23.6 k steps/s",
        "utility        best -122.9, mean -132.7",
        "last choice    policy 7: time -170.2, fuel -75.6",
        "bounds         time ≥ -178.1, fuel ≥ -79.8",
        "(time)",
    ):
        assert fact in text


def test_a_live_view_leaves_its_last_state_and_the_result(make_events):
    text = shown("live", make_events())
    assert text.count("finished") == 1 and text.count("Final front") == 1
    assert text.index("finished") < text.index("Final front")


class Screen(io.StringIO):
    """A terminal that counts the frames with a word in them."""

    def __init__(self, word):
        super().__init__()
        self.word, self.frames = word, threading.Semaphore(0)

    def write(self, text):
        if self.word in text:
            self.frames.release()
        return super().write(text)

    def watched(self, **config):
        console = PlainConsole(file=self, width=80, height=40, force_terminal=True, _environ={"TERM": "xterm"})
        return watcher("live", resolve(overrides=config), OBJECTIVES[:2], console)


def test_a_live_view_is_redrawn_while_the_run_computes():
    screen = Screen("compiling")
    with screen.watched():
        # The main thread is stuck here, as in a compiled call, and yet frames come.
        assert all(screen.frames.acquire(timeout=20) for _ in range(3))


def test_a_live_view_leaves_the_screen_to_a_question_at_this_terminal_and_comes_back(make_events):
    compiled, warm_up, decided, *_ = make_events()
    screen = Screen("interactive")
    with screen.watched(user="terminal") as watching:
        for event in (compiled, warm_up):
            watching.show(event)
        assert screen.frames.acquire(timeout=20)
        with watching.asking():
            erased = screen.getvalue().rpartition("\n")[2]
            assert erased.count("\x1b[2K") == len(watching.console.render_lines(watching.panel()))
            while screen.frames.acquire(blocking=False):
                pass
            assert not screen.frames.acquire(timeout=2 / REFRESH_RATE)
            screen.write("which of these?\n")
        watching.show(decided)
        assert screen.frames.acquire(timeout=20)
    after = screen.getvalue().partition("which of these?\n")[2]
    first_frame, *_ = after.partition("\x1b[1A")
    assert "round 1 of 10" in first_frame and "next question" in first_frame


def test_a_live_view_stays_while_an_artificial_user_is_asked(make_events):
    screen = Screen("choice for round 1")
    with screen.watched(user="A") as watching:
        for event in make_events()[:2]:
            watching.show(event)
        with watching.asking():
            assert all(screen.frames.acquire(timeout=20) for _ in range(3))


@pytest.mark.parametrize("width", [40, 60, 100])
def test_a_live_view_says_how_far_the_run_is_on_every_screen(make_events, width):
    file = io.StringIO()
    console = PlainConsole(file=file, width=width, height=60)
    view = LiveView(resolve(), OBJECTIVES[:2], console, clock=lambda: 0.0)
    for event in make_events()[:5]:
        view.timeline = view.timeline.after(event, 0.0)
    console.print(view.panel())
    text = file.getvalue()
    assert "round 2 of 10" in text and "480 k of 2.64 M steps" in text
    assert max(map(len, text.splitlines())) <= width

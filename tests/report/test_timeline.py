"""Where a run stands, and how long it still takes."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from jmorl.config import resolve
from jmorl.events import Resumed
from jmorl.report.timeline import Timeline


def config_of(**changes):
    return resolve(overrides=changes)


def timelines(events, config, gap=2.0):
    """The timeline after each event, which come every `gap` seconds."""
    timeline, found = Timeline(config, since=0.0), []
    for number, event in enumerate(events, start=1):
        timeline = timeline.after(event, gap * number)
        found.append(timeline)
    return found


@given(st.integers(1, 40), st.integers(1, 40), st.integers(1, 400))
def test_generations_and_steps_are_those_a_run_will_make(warmup, iterations, extra):
    agents, each = 2, 100
    config = resolve(
        overrides={
            "population": {"agents": agents, "warmup_iterations": warmup, "iterations": iterations},
            "ppo": {"environments": 1, "rollout_steps": each, "minibatches": 1},
            "steps": agents * each * (warmup + extra),
        }
    )
    done, generations = warmup, 0
    while done < config.iteration_budget:
        done, generations = done + iterations, generations + 1
    timeline = Timeline(config, since=0.0)
    assert timeline.generations == generations
    assert timeline.total_steps == done * agents * each


def test_the_phases_of_an_interactive_run(make_events):
    found = [(each.phase, each.generation) for each in timelines(make_events(generations=2), config_of(steps=700_000))]
    assert found == [
        ("warm-up", 0),
        ("question", 1),
        ("generation", 1),
        ("question", 2),
        ("generation", 2),
        ("question", 3),
        ("question", 3),
        ("finished", 3),
    ]


def test_a_resumed_run_goes_on_where_it_was(make_events):
    compiled, *_, finished, decided = make_events(generations=3)[:5]
    after = timelines([compiled, Resumed(finished.state, finished.steps, finished.bounds, 0), decided], config_of())
    assert [(each.phase, each.generation) for each in after] == [("warm-up", 0), ("question", 2), ("generation", 2)]
    assert [each.steps(100.0) for each in after] == [240_000, finished.steps, finished.steps]


def test_without_questions_generations_follow_each_other(make_events):
    events = make_events(generations=2, interactive=False)
    found = [each.phase for each in timelines(events, config_of(steps=700_000, method="pgmorl"))]
    assert found == ["warm-up", "generation", "generation", "question", "question", "finished"]


def test_steps_grow_within_a_generation_but_not_beyond_it(make_events):
    *_, timeline = timelines(make_events()[:3], config_of())  # in generation 1, since second 6
    assert timeline.steps(6.0) == 240_000
    # The warm-up took 10 seconds, and a generation has as many iterations.
    assert timeline.steps(8.5) == 240_000 + 60_000
    assert timeline.steps(100.0) == 480_000


def test_remaining_times_of_an_interactive_run(make_events):
    *_, timeline = timelines(make_events()[:3], config_of())
    assert timeline.seconds_to_question(8.0) == pytest.approx(8.0)
    assert timeline.seconds_to_question(60.0) == 0.0
    assert timeline.seconds_to_end(8.0) == pytest.approx(8.0 + 9 * 10.0)


def test_silent_generations_put_the_question_off(make_events):
    from dataclasses import replace

    events = make_events()[:3]
    events[2] = replace(events[2], answer=replace(events[2].answer, generations=3), generations_to_question=3)
    *_, timeline = timelines(events, config_of())
    assert timeline.seconds_to_question(6.0) == pytest.approx(30.0)
    # But the end of the run is a question, too.
    *_, short = timelines(events, config_of(steps=700_000))
    assert short.seconds_to_question(6.0) == pytest.approx(20.0)


def test_a_run_without_questions_waits_for_none(make_events):
    events = make_events(interactive=False)[:2]
    *_, timeline = timelines(events, config_of(method="pgmorl"))
    assert timeline.phase == "generation" and timeline.seconds_to_question(5.0) is None
    assert timeline.seconds_to_end(4.0) == pytest.approx(10 * 10.0)


def test_nothing_is_known_while_it_compiles():
    timeline = Timeline(config_of(), since=0.0)
    assert timeline.steps(50.0) == 0
    assert timeline.seconds_to_end(50.0) is None and timeline.seconds_to_question(50.0) is None


def test_in_the_warm_up_one_iteration_tells_how_long_everything_takes(make_events):
    *_, timeline = timelines(make_events()[:1], config_of())  # since second 2, with 40,000 steps a second
    assert [timeline.steps(now) for now in (2.0, 3.5, 50.0)] == [0, 60_000, 240_000]
    assert timeline.seconds_to_end(2.0) == pytest.approx(timeline.total_steps / 40_000)
    assert timeline.seconds_to_end(50.0) == pytest.approx((timeline.total_steps - 240_000) / 40_000)
    assert timeline.seconds_to_question(50.0) is None


def test_a_longer_generation_than_the_warm_up_takes_longer(make_events):
    config = config_of(population={"warmup_iterations": 5, "iterations": 20})
    *_, timeline = timelines(make_events()[:3], config)
    assert timeline.generation_seconds() == pytest.approx(9.1 * 4 + 0.9)

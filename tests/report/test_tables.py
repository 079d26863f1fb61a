"""The tables that the commands print."""

import io
from dataclasses import replace

import numpy as np
import pytest

import envs
from jmorl.display.console import PlainConsole
from jmorl.learning.rollout import EpisodeReturns
from jmorl.report.tables import comparison_table, environment_tables, evaluation_table, run_tables
from jmorl.search.policy import values_of
from jmorl.storage.notes_file import Note, Notes


def printed(renderables, width=80):
    file = io.StringIO()
    console = PlainConsole(file=file, width=width)
    for renderable in renderables:
        console.print(renderable)
    return file.getvalue()


def section(text, title):
    """The rows of the table with this title, in words."""
    lines = iter(text.splitlines())
    while not next(lines).startswith(title):
        pass
    while not next(lines).startswith("─"):
        pass
    found = []
    for line in lines:
        if not line.strip():
            break
        found.append(line.split())
    return found


@pytest.mark.parametrize("width", [40, 60, 80, 100, 140])
@pytest.mark.parametrize("kinds", [{}, {"objectives": 3}, {"has_utility": False}, {"interactive": False}])
def test_everything_fits(make_run, width, kinds):
    text = printed(run_tables(make_run(**kinds)), width)
    assert "…" not in text
    assert max(map(len, text.splitlines())) <= width
    # No cell is broken over two lines: there is a line for each generation and each member.
    run = make_run(**kinds)
    assert len(section(text, "Generations")) == 11
    assert len(section(text, "Final front")) == len(run.front)
    words = set(text.split())
    assert {f"{volume:.0f}" for volume in run.metrics["hypervolume"]} <= words
    assert {f"{value:.1f}" for value in values_of(run.front)[:, 0]} <= words


def test_the_heading_sums_the_run_up(make_run):
    text = printed(run_tables(make_run()))
    for line in (
        "environment  mo-mountaincarcontinuous-v0",
        "method       interactive, user A, seed 1",
        "population   6 agents, 4 environments each",
        "devices      2 × cpu",
        "steps        2.64 M (and 99.0 k to evaluate)",
        # 11 generations of 10 seconds, and 0.1 for selection in all but the warm-up
        "time         1 min 51 s, 23.8 k steps/s; answers not counted",
        "state        finished: the budget of environment steps is used up",
    ):
        assert line in text


def test_names_stand_in_the_column_of_notes_and_the_heading_has_those_of_the_run(make_run):
    run = make_run()
    chosen, *others = sorted(run.front, key=lambda policy: policy.id != run.chosen.id)
    about = {chosen.id: Note("[red]careful", favourite=True), others[0].id: Note("fast one", "Falls.")}
    text = printed(run_tables(replace(run, notes=Notes(Note("slow way", "First\nand last."), about))), 120)
    notes = {int(row[0]): " ".join(row) for row in section(text, "Final front")}
    assert notes[chosen.id].endswith('chosen, "[red]careful", favourite') and notes[others[0].id].endswith('"fast one"')
    heading = [line.rstrip() for line in text.splitlines()]
    assert 'run          runs/made-up "slow way"' in heading
    assert heading[heading.index("notes        First") + 1] == "             and last."
    damaged = printed(run_tables(replace(run, notes=Notes(problem="notes.json is damaged: name"))), 120)
    assert "notes        notes.json is damaged: name" in damaged


def test_the_heading_says_how_good_the_forecasts_were(make_run):
    run = make_run()
    known = [policy for policy in run.policies if policy.interval is not None]
    held = np.mean([(policy.interval[0] <= policy.values) & (policy.values <= policy.interval[1]) for policy in known])
    text = printed(run_tables(run))
    assert f"forecasts    {held:.0%} of what {len(known)} policies reached lay in its 80% interval" in text
    warmed_up = make_run(generations=0)
    assert "forecasts" not in printed(run_tables(warmed_up))


def test_a_row_for_every_generation(make_run):
    rows = section(printed(run_tables(make_run())), "Generations")
    assert rows[0] == ["0", "240", "k", "23.5", "k", "4", "0", "-145.99", "-248.46", "10.0"]
    assert rows[10][:3] == ["10", "2.64", "M"]
    assert rows[10][-3:] == ["30", "2.0%", "10.1"]


def test_what_a_run_lacks_has_no_column(make_run):
    assert "utility" not in printed(run_tables(make_run(has_utility=False)))
    only_warm_up = printed(run_tables(make_run(generations=0)))
    assert "model" not in only_warm_up and "candi" not in only_warm_up
    assert "Decisions" not in printed(run_tables(make_run(generations=0, finished=False)))


def test_a_row_for_every_decision(make_run):
    run = make_run()
    rows = section(printed(run_tables(run)), "Decisions")
    assert rows[0] == ["1", "steer", "4", "2", "-200.7", "-91.3"]
    assert rows[-1] == ["11", "final", "5", "58", "-91.7", "-38.9"]
    assert len(rows) == len(run.decisions)


@pytest.mark.parametrize(
    ("changes", "note"),
    [
        ({"stop": True}, "stop"),
        ({"generations": 3}, "go on for 3 rounds"),
        ({"equal": True}, "no difference"),
        ({"ranking": (2, 1)}, "in the order 2 1"),
        ({"limits": (None, -45.0)}, "limits: fuel ≥ -45.0"),
        ({"stand_in": True}, "by the stand-in"),
        ({}, ""),
    ],
)
def test_a_decision_may_say_more_than_a_policy(make_run, changes, note):
    from dataclasses import replace

    run = make_run()
    run = replace(run, decisions=(replace(run.decisions[0], **changes),))
    assert " ".join(section(printed(run_tables(run)), "Decisions")[0][6:]) == note


def test_the_chosen_policy_is_marked_once_the_run_has_ended(make_run):
    finished, unfinished = printed(run_tables(make_run())), printed(run_tables(make_run(finished=False)))
    assert [row[0] for row in section(finished, "Final front") if row[-1] == "chosen"] == ["58"]
    assert "chosen" not in unfinished
    assert "state        unfinished" in unfinished and "Front so far" in unfinished


def test_an_evaluation_is_mean_error_spread_and_extremes():
    returns = np.random.default_rng(1).normal([-70, -40], [2, 5], (50, 2))
    environment = envs.make("mo-mountaincarcontinuous-v0")
    objectives = [vars(objective) for objective in environment.objectives]
    header = {"id": 17, "environment": environment.id, "objectives": objectives, "values": [-71.0, -39.0]}
    text = printed([evaluation_table(header, EpisodeReturns(returns, 0.5 * returns, np.arange(60, 110)))])
    assert text.startswith("Policy 17 in 50 fresh episodes of mo-mountaincarcontinuous-v0")
    assert "Episodes of 60 to 109 steps, 84.5 on average." in text
    assert max(map(len, text.splitlines())) <= 80
    rows = [line.split() for line in text.splitlines() if "(-" in line]
    for row, column, stored in zip(rows, returns.T, header["values"], strict=True):
        error = np.std(column, ddof=1) / np.sqrt(50)
        expected = [column.mean(), error, column.std(), column.min(), column.max(), stored, 0.5 * column.mean()]
        assert [float(word) for word in row[2:]] == pytest.approx(expected, abs=0.051)


def test_a_single_episode_has_no_standard_error():
    header = {"id": 1, "environment": "e", "objectives": [{"name": "a", "label": "a", "unit": "u"}], "values": [1.0]}
    returns = EpisodeReturns(np.array([[2.0]]), np.array([[1.5]]), np.array([7]))
    text = printed([evaluation_table(header, returns)])
    assert "Policy 1 in 1 fresh episode of e" in text and "nan" not in text


def test_two_evaluations_side_by_side():
    generator = np.random.default_rng(2)
    ours, theirs = generator.normal([-70, -40], [2, 5], (50, 2)), generator.normal([-70, -40], [2, 5], (50, 2))
    environment = envs.make("mo-mountaincarcontinuous-v0")
    header = {"id": 17, "environment": environment.id, "objectives": [vars(each) for each in environment.objectives]}
    text = printed([comparison_table(header, ours, theirs, np.array([1.25, np.nan]))], width=88)
    assert max(map(len, text.splitlines())) <= 88 and "nan" not in text
    rows = [line.split() for line in text.splitlines() if "(-" in line]
    for row, *columns in zip(rows, ours.T, theirs.T, strict=True):
        expected = [n for c in columns for n in (c.mean(), np.std(c, ddof=1), np.std(c, ddof=1) / np.sqrt(50))]
        assert [float(word) for word in row[2:8]] == pytest.approx(expected, rel=0.01)
    assert rows[0][8:] == ["+1.2"] and rows[1][8:] == []


def test_every_environment_is_listed():
    text = printed(environment_tables(envs.ids(), {}), width=140)
    for name in envs.ids():
        environment = envs.make(name)
        [row] = [line for line in text.splitlines() if line.startswith(f"{name} ")]
        sizes = [environment.observation_size, environment.action_size, environment.time_limit]
        assert row.split()[-3:] == [str(size) for size in sizes]
        for objective in environment.objectives:
            assert f"{objective.label} ({objective.unit})" in text

"""Studies: what a plan means, what is counted, and a whole one at a tiny size."""

from dataclasses import replace

import numpy as np
import pytest

from jmorl.config import ConfigError
from jmorl.experiments.cells import Places, distinct, missing
from jmorl.experiments.record import ConfirmedScore, FreshScore, QuestionRecord
from jmorl.experiments.study.command import make_study
from jmorl.experiments.study.figures import targets_figure
from jmorl.experiments.study.plan import Study, StudyPart, read_plan
from jmorl.experiments.study.results import calibration, gained, target_rows, user_rows
from tests.experiments.made import CAR, ITERATION, record
from tests.registered import ThreeWays

PLAN = f"""
seeds = [1, 2]

[contenders.interactive]
population = {{ agents = 4, warmup_iterations = 2, iterations = 3 }}
ppo = {{ environments = 3, rollout_steps = 16, minibatches = 4, epochs = 2 }}
evaluation = {{ episodes = 2, confirmation_episodes = 4 }}

[contenders.PGMORL]
method = "pgmorl"
population = {{ agents = 4, warmup_iterations = 2, iterations = 3 }}
ppo = {{ environments = 3, rollout_steps = 16, minibatches = 4, epochs = 2 }}
evaluation = {{ episodes = 2, confirmation_episodes = 4 }}

[[parts]]
name = "three ways"
env = "{ThreeWays.id}"
steps = {4 * 3 * 16 * 11}

[parts.users]
"all alike" = "weights=1,1,1"
"far away" = "target=0,0,0"
"""


@pytest.fixture
def plan(tmp_path):
    path = tmp_path / "plan.toml"
    path.write_text(PLAN, encoding="utf-8")
    return path


STUDY = Study(
    seeds=(1, 2),
    contenders={"interactive": {}, "PGMORL": {"method": "pgmorl"}},
    parts=(StudyPart("car", CAR, 2_500_000, {"A": "A", "near": "target=-80,-50"}),),
)


def key(contender, user, seed):
    return STUDY.cell(STUDY.parts[0], contender, user, seed).key


def test_who_asks_nobody_has_one_run_for_all_users():
    [part] = STUDY.parts
    keys = {cell.key for cell in STUDY.cells(part)}
    assert keys == {
        *(f"car-interactive-{user}-seed_{seed}" for user in ("A", "near") for seed in (1, 2)),
        *(f"car-PGMORL-everybody-seed_{seed}" for seed in (1, 2)),
    }
    assert STUDY.cell(part, "PGMORL", "near", 1).config.user == "A"  # whom a target does not stop


def test_what_is_counted_by_hand():
    """Two runs of the interactive method and one of PGMORL. The utility of user A is half the sum."""
    [part] = STUDY.parts
    first = record([[(-100, -60)], [(-80, -50)], [(-70, -44)]], chosen=2, questions=[(1, 0), (2, 1), (3, 2)])
    asked, by_stand_in, last = first.questions
    first = replace(first, questions=(asked, replace(by_stand_in, stand_in=True), last))
    second = record([[(-90, -56)], [(-90, -50), (-60, -58)]], chosen=2, questions=[(1, 0), (2, 2)])
    other = record([[(-84, -40), (-66, -54)]], chosen=0)
    records = {key("interactive", "A", 1): first, key("interactive", "A", 2): second, key("PGMORL", "A", 1): other}
    ours, theirs = user_rows(STUDY, part, records)
    assert (ours.user, ours.method, ours.seeds) == ("A", "interactive", (1, 2))
    assert ours.asked.tolist() == [2, 2] and ours.shown.tolist() == [10, 10]
    assert ours.best == -57 and ours.utility.tolist() == [-57, -59]
    np.testing.assert_allclose(ours.shortfall, [0, 100 * 2 / 57])
    assert ours.good == 1
    blundered, _ = user_rows(STUDY, part, {**records, key("interactive", "A", 2): replace(second, chosen=1)})
    np.testing.assert_allclose(blundered.shortfall, [0, 100 * 13 / 57])
    np.testing.assert_allclose(blundered.shortfall_of_front, [0, 100 * 2 / 57])
    # 5 % of 57 is 2.85: reached by the first run in its third generation, by the second in its second.
    assert ours.close.reached == (30 * ITERATION, 20 * ITERATION)
    assert ours.very_close.reached == (30 * ITERATION, None)
    # Who is asked at the end, about the whole front, finds the best in it.
    assert theirs.utility.tolist() == [-60] and theirs.asked.tolist() == [1] and theirs.shown.tolist() == [2]
    difference = gained(ours, theirs)
    assert (difference.mean, difference.count) == (3, 1)


def test_targets_have_rows_of_their_own():
    [part] = STUDY.parts
    run = record([[(-100, -60)], [(-80, -50)]], chosen=1)
    [row] = target_rows(STUDY, part, {key("interactive", "near", 2): run})
    assert (row.target, row.values, row.seeds, row.times.reached) == ("near", (-80, -50), (2,), (20 * ITERATION,))


def test_a_figure_of_targets_shows_every_run():
    """Targets share an axis; the runs to the first one need the fewest steps."""
    [part] = STUDY.parts
    run = record([[(-100, -60)], [(-80, -50)]], chosen=1)
    [row] = target_rows(STUDY, part, {key("interactive", "near", 2): run})
    far = replace(row, target="far", times=replace(row.times, reached=(None,), budget=50 * ITERATION))
    figure = targets_figure([row, far], "targets")
    for axes, steps in zip(figure.axes, (20 * ITERATION, 50 * ITERATION), strict=True):
        [marks] = axes.collections
        assert marks.get_offsets()[0, 1] == pytest.approx(steps / 1e6)
        assert axes.get_ylim()[0] == 0 and axes.get_ylim()[1] > steps / 1e6


def test_forecasts_and_confirmed_scores_are_judged():
    run = record([[(-100, -60)], [(-80, -50), (-70, -58)]])
    known, wrong = (-90.0, -51.0), (-75.0, -40.0)
    policies = (run.policies[0], replace(run.policies[1], interval=(known, wrong)), run.policies[2])
    said = ConfirmedScore(8, (-80.0, -50.0), (1.0, 1.0))
    right = replace(run, policies=policies, confirmed=said, fresh=FreshScore(100, (-79.1, -50.9), (0.3, 0.3)))
    flattered = replace(run, confirmed=said, fresh=FreshScore(100, (-81.1, -50.0), (0.3, 0.3)))
    found = calibration([right, flattered, run])
    assert (found.intervals, found.held, found.confirmed, found.within) == (2, 1.0, 2, 1)
    assert np.isnan(calibration([run]).held)


def test_a_whole_study(plan, capsys):
    """From a plan to a report, and nothing is made twice."""
    report = make_study(plan, work=plan.parent / "work")
    text = report.read_text(encoding="utf-8")
    assert report == plan.parent / "REPORT.md" and "from 6 of 6 runs, with the seeds 1, 2" in text
    assert "| all alike | interactive | 2 |" in text and "| all alike | PGMORL | 2 | 1, at the end |" in text
    assert "| far away | interactive |" in text and "0 of 2" in text
    for figure in ("three_ways-questions", "three_ways-targets"):
        assert (plan.parent / "figures" / f"{figure}.png").stat().st_size > 10_000
        assert f"](figures/{figure}.png)" in text
    study = read_plan(plan)
    places = Places(plan.parent / "records", plan.parent / "work")
    assert not missing(distinct(study.cells(study.parts[0])), places)
    capsys.readouterr()
    make_study(plan, work=plan.parent / "work")
    assert capsys.readouterr().out.startswith("three ways: done")
    assert report.read_text(encoding="utf-8") == text


def test_a_report_of_no_runs_says_so(plan):
    make_study(plan, run=False)
    assert "There are no runs yet." in (plan.parent / "REPORT.md").read_text(encoding="utf-8")


def test_runs_of_other_comparisons_are_taken(plan):
    make_study(plan, work=plan.parent / "work")
    other = plan.parent / "other" / "plan.toml"
    other.parent.mkdir()
    other.write_text('records = ["../records"]\n' + PLAN, encoding="utf-8")
    study = read_plan(other)
    assert len(study.made_elsewhere(distinct(study.cells(study.parts[0])))) == 6
    make_study(other, run=False)
    assert "from 6 of 6 runs" in (other.parent / "REPORT.md").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("before", "after", "problem"),
    [
        ("seeds = [1, 2]", "seeds = [1, 1]", "a seed is given twice"),
        ("seeds = [1, 2]", "seeds = []", "there is no seed"),
        ("seeds = [1, 2]", "seeds = 1", "seeds: Input should be a valid tuple"),
        ("seeds = [1, 2]", "seeds = [1, 2", "cannot be read"),
        ('name = "three ways"', 'name = "three/ways"', "'three/ways': files are named after it"),
        ('"weights=1,1,1"', '"weights=1,1"', "weights must have one number for each of 3 objectives"),
        ('"weights=1,1,1"', '"weights=1,1,1,chebyshev"', "has no utility by which runs could be compared"),
        ('method = "pgmorl"', 'method = "pgmorll"', "did you mean"),
        (f"steps = {4 * 3 * 16 * 11}", "steps = 10", "steps end within the warm-up"),
        ("[parts.users]", 'contenders = ["nobody"]\n[parts.users]', "there is no contender 'nobody'"),
        ("[parts.users]", 'best = "nowhere.json"\n[parts.users]', "there is no file"),
        ("[parts.users]", 'best = "plan.toml"\n[parts.users]', "plan.toml has no front of"),
        ("seeds = [1, 2]", 'seeds = [1, 2]\nrecords = ["nowhere"]', "records: there is no folder"),
        ("seeds = [1, 2]", "seeds = [1, -2]", "PGMORL, seed -2: seed: must be at least 0"),
        ('method = "pgmorl"', 'method = "pgmorl"\nsteps = 5', "contender PGMORL: steps belongs to the part"),
        ("[parts.users]", '[parts.users]\n"a b" = "A"\na_b = "B"', "two users of part three ways have one name"),
        ("[parts.users]", "[parts.user]", "parts.0.users: Field required"),
        ("seeds = [1, 2]", "seeds = [1, 2]\nsed = 3", "sed: Unexpected keyword argument"),
    ],
)
def test_what_is_wrong_with_a_plan_is_said_before_anything_is_made(plan, before, after, problem):
    assert before in PLAN
    plan.write_text(PLAN.replace(before, after), encoding="utf-8")
    with pytest.raises(ConfigError, match=problem):
        make_study(plan, work=plan.parent / "work")
    assert [path.name for path in plan.parent.iterdir()] == ["plan.toml"]


def test_a_report_elsewhere_makes_its_folder_and_no_file_is_taken_for_one(plan):
    make_study(plan, run=False, out=plan.parent / "new" / "folder")
    assert (plan.parent / "new" / "folder" / "REPORT.md").exists()
    with pytest.raises(ConfigError, match="out: .*plan.toml is a file"):
        make_study(plan, run=False, out=plan)


def test_questions_of_earlier_records_were_all_asked():
    assert not QuestionRecord(1, 5, 3).stand_in

"""The search by default in the paper's report: its runs come from a study, and stand beside the paper's rule."""

from dataclasses import replace

import pytest

from jmorl.config import resolve
from jmorl.experiments.record import QuestionRecord, write_record
from jmorl.paper.by_default import (
    BY_DEFAULT,
    StudyRuns,
    curves_section,
    default_curves,
    default_targets,
    study_runs,
    targets_section,
)
from jmorl.paper.figures import curves_figure, draw
from jmorl.paper.plan import CAR, ITEMS, Plan
from jmorl.paper.report import Scope, write_report
from jmorl.paper.results import curves, target_rows
from tests.experiments.made import record

PLAN = Plan(seeds=(1, 7))


def of_a_study(item, goal, seed, generations):
    """A run of the search by default, with one question of three for the user."""
    given = {"env": CAR, "user": PLAN.goals(item, "raw")[goal], "seed": seed, "steps": PLAN.steps(item)}
    made = record(generations, questions=[(1, 0), (2, 0), (3, 0)])
    questions = tuple(QuestionRecord(q.generation, q.shown, q.chosen, q.generation > 1) for q in made.questions)
    return replace(made, digest=resolve(overrides=given).identity(), questions=questions)


@pytest.fixture
def runs():
    """Target A is reached in the third generation and in the second; user A ends on -55 and on -57."""
    far, near, there = [(-120, -70)], [(-80, -50)], [(-70, -40)]
    better, best = [(-75, -45)], [(-69, -45)]
    return StudyRuns(
        [
            of_a_study(ITEMS["table1"], "A", 1, [far, near, there]),
            of_a_study(ITEMS["table1"], "A", 7, [far, there]),
            of_a_study(ITEMS["fig5"], "A", 1, [far, near, there]),
            of_a_study(ITEMS["fig5"], "A", 7, [far, better, best]),
        ]
    )


@pytest.fixture
def records():
    """PGMORL's runs, which never come near, of the report's own."""
    item = ITEMS["table1"]
    cells = [PLAN.pgmorl(item, "raw", seed) for seed in (1, 7)]
    cells += [PLAN.pgmorl(ITEMS["fig5"], "raw", seed) for seed in (1, 7)]
    return {cell.key: record([[(-120, -70)], [(-90, -60)], [(-80, -55)]]) for cell in cells}


def test_a_run_is_known_by_its_settings(runs):
    item = ITEMS["table1"]
    assert list(runs.of(PLAN, item, "A")) == [1, 7] and not runs.of(PLAN, item, "B")
    papers_rule = StudyRuns(
        [replace(each, digest=PLAN.interactive(item, "raw", "A", 1).config.identity()) for each in runs.records]
    )
    assert not papers_rule.of(PLAN, item, "A")


def test_steps_are_compared_seed_by_seed(runs, records):
    item = ITEMS["table1"]
    [row] = default_targets(PLAN, item, runs)
    assert (row.method, row.target, row.seeds) == (BY_DEFAULT, "A", (1, 7))
    assert row.times.reached == (720_000, 480_000)
    _, laid_out = targets_section([row], target_rows(PLAN, item, "raw", records))
    assert "| A | 0.60 [0.48, 0.72] | 2 of 2 | pgmorl | 5.00 [5.00, 5.00] | 0 of 2 | 4.40" in laid_out


def test_utilities_are_compared_and_only_the_users_questions_counted(runs, records):
    item = ITEMS["fig5"]
    [row] = default_curves(PLAN, item, runs)
    assert row.last.tolist() == [-55, -57]
    _, laid_out = curves_section([row], curves(PLAN, item, "raw", records))
    assert "| A | -56 | 1, 1 | pgmorl | -67.5 | +11.5" in laid_out


def test_the_report_has_it_where_there_are_runs(runs, records, tmp_path):
    item = ITEMS["table1"]
    without = write_report(tmp_path, Scope(PLAN, [item], ["raw"]), records).read_text()
    assert "The search by default" not in without
    report = write_report(tmp_path, Scope(PLAN, [item, ITEMS["fig5"]], ["raw"], runs), records).read_text()
    assert report.count("### The search by default") == 2


def test_the_figure_has_it_too(runs, records, tmp_path):
    item = ITEMS["fig5"]
    rows = [*curves(PLAN, item, "raw", records), *default_curves(PLAN, item, runs)]
    figure = curves_figure(rows, item, "raw", "title")
    assert [text.get_text() for text in figure.legends[0].get_texts()][1] == "interactive, by default"
    plain = draw(tmp_path / "plain", PLAN, item, ["raw"], records, StudyRuns())["raw"].read_bytes()
    assert draw(tmp_path / "both", PLAN, item, ["raw"], records, runs)["raw"].read_bytes() != plain


def test_records_are_read_from_a_folder(runs, tmp_path):
    assert not study_runs(tmp_path / "nowhere").records
    for number, each in enumerate(runs.records):
        write_record(tmp_path / f"{number}.json", each)
    assert len(study_runs(tmp_path).records) == 4

"""`jmorl paper --quick` from beginning to end: runs, records, report and figures; interrupted, resumed and repeated."""

import re
import struct
from collections import Counter

import numpy as np
import pytest

from jmorl.cli import main
from jmorl.experiments.record import read_record
from jmorl.learning.population import Population, TrainingFault
from jmorl.paper.plan import ITEMS, Plan

CAR_ITEMS = "table1,fig5,fig6,fig9,fig10"


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    """The car's part, both units, three users and targets, two seeds."""
    folder = tmp_path_factory.mktemp("paper")
    assert main(["paper", "--quick", "--only", CAR_ITEMS, "--out", str(folder)]) == 0
    return folder


def png_size(path):
    return struct.unpack(">II", path.read_bytes()[16:24])


def test_the_report_has_every_item_in_both_units_and_nothing_is_missing(out):
    text = (out / "REPORT.md").read_text()
    assert "at a reduced size" in text and "Missing" not in text and "missing" not in text
    for heading in ("## Table 1", "## Figure 5", "## Figure 6", "## Figure 9", "## Figure 10"):
        assert heading in text
    assert "| A | interactive | 2.45 ± 0.62 | 5 of 5 |" in text
    assert "### In raw units" in text and "### In paper units" in text
    assert not re.search(r"\bnan\b|None", text)


def test_the_report_judges_every_item_and_says_what_it_rests_on(out):
    text = (out / "REPORT.md").read_text()
    assert text.count("The paper's conclusion ") == 10
    assert len(re.findall(r"- Target [ABC]: (?:met|not met)", text)) == 3
    assert text.count("runs are in different units here") == 4  # both figures of curves, and both of final policies
    assert "chosen on seeds 1, 7, 10, 42 and 100, which are the experiment's" in " ".join(text.split())
    assert "Commits of the records: " in text and "| 10 h 13 min |" in text
    assert '| B | pgmorl | ≥ 5.00 ("No results") | 0 of 5 |' in text
    assert "reached with generation 0" in text and "E-NAUTILUS chooses from the pooled archives of 2 runs" in text
    assert "buffer within bounds (authors)" in text and "| A | pgmorl + E-NAUTILUS | 3 |" in text


@pytest.mark.slow
def test_halfcheetahs_items_are_made_too(tmp_path):
    """With PGMORL's second row; the dynamics take their time to compile."""
    assert main(["paper", "--quick", "--only", "table2,fig7,fig8,fig11", "--seeds", "1", "--out", str(tmp_path)]) == 0
    text = (tmp_path / "REPORT.md").read_text()
    for heading in ("## Table 2", "## Figure 7", "## Figure 8", "## Figure 11"):
        assert heading in text
    assert "Missing" not in text and "missing" not in text and not re.search(r"\bnan\b|None", text)
    assert "| B | interactive | 6.23 ± 1.96 printed, ± 2.84 derived | 1 of 5 |" in text
    assert "The paper prints the standard deviations of rows B and C the other way round" in text
    assert text.count("| A | pgmorl-40 |") == 3 + 2 + 2  # of the table, and of both figures of curves
    assert len(list((tmp_path / "figures").glob("*.png"))) == 8


def test_every_picture_of_the_report_is_there_as_png_and_svg(out):
    pictures = re.findall(r"!\[.*?\]\((.*?)\)", (out / "REPORT.md").read_text())
    assert len(pictures) == 10
    for name in pictures:
        assert png_size(out / name)[0] > 2000
        assert (out / name).with_suffix(".svg").read_text().startswith("<?xml")


def test_targets_that_are_reached_at_once_and_never_are_told_apart(out):
    table = Plan(quick=True)
    cells = table.cells(ITEMS["table1"], "raw")
    records = {cell.key: read_record(out / "records" / f"{cell.key}.json") for cell in cells}
    reasons = {key: record.reason for key, record in records.items()}
    assert {reasons[key] for key in reasons if "target-A" in key} == {"satisfied"}
    assert {reasons[key] for key in reasons if "target-C" in key or "pgmorl" in key} == {"budget"}
    assert all(not records[key].questions[:-1] for key in records if "target-A" in key)


def test_a_second_time_makes_nothing_and_writes_the_same_report(out, capsys):
    before = {path: path.read_bytes() for path in out.rglob("*") if path.suffix in (".md", ".json", ".svg")}
    assert main(["paper", "--quick", "--only", CAR_ITEMS, "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    assert printed.count(": done") == 10 and "steps" not in printed
    assert {path: path.read_bytes() for path in before} == before


@pytest.fixture(scope="module")
def in_threes(tmp_path_factory):
    """Table 1 in raw units, three runs in one program."""
    folder = tmp_path_factory.mktemp("threes")
    arguments = ["--only", "table1", "--units", "raw", "--together", "3"]
    assert main(["paper", "--quick", *arguments, "--out", str(folder)]) == 0
    return folder


@pytest.mark.slow
def test_runs_that_share_a_program_find_what_each_finds_alone(out, in_threes):
    shared = []
    for cell in Plan(quick=True).cells(ITEMS["table1"], "raw"):
        found, alone = (read_record(folder / "records" / f"{cell.key}.json") for folder in (in_threes, out))
        np.testing.assert_allclose(found.values, alone.values, rtol=1e-3)
        assert (found.reason, found.questions, found.steps.tolist()) == (
            (alone.reason, alone.questions, alone.steps.tolist())
        )
        assert cell.key in found.together and np.isnan(found.seconds).all() and found.machine_seconds > 0
        shared.append(found.together)
    assert list(map(len, dict.fromkeys(shared))) == [3, 3, 2]


def test_the_report_counts_their_time_once_and_says_nothing_of_waiting(in_threes):
    text = (in_threes / "REPORT.md").read_text()
    assert "8 runs were made several at a time in one program" in text and not re.search(r"\bnan\b|None", text)
    assert "| B | interactive |  | 20 min 31 s | " in text


def test_the_report_says_what_is_missing(out, tmp_path, capsys):
    for path in (out / "records").glob("mountaincar-raw-*seed-7.json"):
        target = tmp_path / "records" / path.name
        target.parent.mkdir(exist_ok=True)
        target.write_bytes(path.read_bytes())
    assert main(["paper", "--quick", "--report", "--only", "table1,fig5,fig9", "--out", str(tmp_path)]) == 0
    text = (tmp_path / "REPORT.md").read_text()
    assert "Missing: table1 in raw units, 4 of 8 runs: mountaincar-raw-interactive-target-A, seed 1; " in text
    assert "Missing: fig5 in paper units, 8 of 8 runs: mountaincar-paper-interactive-user-A, seeds 1, 7; " in text
    assert "Not to be judged yet: runs are missing." in text
    assert not (tmp_path / "work").exists()


def test_a_report_without_runs_judges_nothing(tmp_path):
    assert main(["paper", "--quick", "--report", "--only", "table1,fig5,fig9", "--out", str(tmp_path)]) == 0
    text = (tmp_path / "REPORT.md").read_text()
    assert text.count("Not to be judged yet: runs are missing.") == 1 + 2 + 2 and "conclusion" not in text


def test_a_run_that_breaks_down_is_told_and_the_others_are_made(out, tmp_path, monkeypatch, capsys):
    """One user's run breaks down in the warm-up, another's after a generation; both count, and are not made again."""
    train, calls = Population.train, Counter()

    def breaking(self, *arguments):
        calls["all"] += 1
        if calls["all"] in (1, 6):  # table 1's first runs have a warm-up and up to three generations
            raise TrainingFault("agent 2: loss is not finite in iteration 3")
        return train(self, *arguments)

    monkeypatch.setattr(Population, "train", breaking)
    arguments = ["paper", "--quick", "--only", "table1,fig5", "--units", "raw", "--out", str(tmp_path)]
    assert main(arguments) == 0
    printed = capsys.readouterr().out
    assert printed.count("broke down: agent 2: loss is not finite in iteration 3") == 2
    text = (tmp_path / "REPORT.md").read_text()
    assert text.count("- Broke down: mountaincar-raw-") == 2 and "Missing" not in text
    assert "Runs that broke down, 1 of the interactive method's, count as not reaching it" in text
    assert "(broke down at 0.00 M)" in text and not re.search(r"\bnan\b|None", text)
    made = calls["all"]
    assert main(arguments) == 0
    assert calls["all"] == made


def test_an_unknown_item_is_refused(capsys):
    with pytest.raises(SystemExit) as error:
        main(["paper", "--only", "table3"])
    assert error.value.code == 2 and "unknown table3" in capsys.readouterr().err

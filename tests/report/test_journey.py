"""The page of a run holds everything itself, and nobody's text is markup in it."""

import base64
import re
from dataclasses import replace

from jmorl.report.journey import journey_page, write_journey
from jmorl.report.plots import draw_run


def test_a_page_has_the_result_how_to_use_it_the_plots_and_the_tables(make_run, tmp_path):
    run = make_run()
    plots = draw_run(run, tmp_path / "plots")
    path = tmp_path / "journey.html"
    write_journey(run, plots, path)
    page = path.read_text(encoding="utf-8")
    assert f"The result is policy {run.chosen.id}: " in page and "jmorl.load_policy(&quot;chosen.npz&quot;)" in page
    assert "2 numbers, as the environment observes them, to 1" in page  # MountainCar
    pictures = re.findall(r'src="data:image/png;base64,([^"]+)"', page)
    assert [base64.b64decode(each) for each in pictures] == [plot.read_bytes() for plot in plots]
    assert "Decisions" in page and "Final front" in page
    assert not re.findall(r'(?:src|href)="(?!data:)', page) and "<script" not in page


def test_text_of_users_is_no_markup(make_run):
    run = make_run(finished=False)
    objectives = tuple(replace(each, label=f"<b>{each.label}</b>") for each in run.objectives)
    page = journey_page(replace(run, objectives=objectives, path=run.path.with_name("<i>run")), [])
    assert "<b>" not in page and "<i>" not in page and "&lt;b&gt;time" in page
    assert "The run has not ended." in page and "How to use" not in page and "Pictures" not in page

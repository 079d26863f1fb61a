"""The page of a run holds everything itself, and nobody's text is markup in it."""

import base64
import re
from dataclasses import replace

from jmorl.report.journey import journey_page, write_journey
from jmorl.report.plots import draw_run
from jmorl.storage.notes_file import Note, Notes


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


def test_favourites_are_there_with_names_and_notes_and_none_of_it_is_markup(make_run):
    run = make_run()
    front = {policy.id for policy in run.front}
    replaced = next(policy.id for policy in run.policies if policy.id not in front)
    named, favourite = sorted(front)[:2]
    plain = journey_page(run, [])
    assert "Favourites" not in plain
    about = {
        named: Note("<b>bold</b>", "One.\n<script>two</script>"),
        favourite: Note(favourite=True),
        replaced: Note('the "old" one', favourite=True),
        9999: Note("no such policy"),
    }
    page = journey_page(replace(run, notes=Notes(Note("<i>slow</i>", "A & B."), about)), [])
    items = re.findall(r"<li><b>(.*?)</b>: time -[0-9.]+, fuel -[0-9.]+(.*?)</li>", page, re.DOTALL)
    listed = page.partition("Favourites and notes")[2].partition("</ul>")[0]
    assert [name for name, _ in items] == [
        *(
            f"★ policy {each}{name}"
            for each, name in sorted([(favourite, ""), (replaced, " &quot;the &quot;old&quot; one&quot;")])
        ),
        f"policy {named} &quot;&lt;b&gt;bold&lt;/b&gt;&quot;",
    ]
    assert '<p class="note">One.\n&lt;script&gt;two&lt;/script&gt;</p>' in listed and listed.count("<p") == 1
    assert "<h1>made-up &quot;&lt;i&gt;slow&lt;/i&gt;&quot;: mo-" in page and '<p class="note">A &amp; B.</p>' in page
    assert "no such policy" not in page and "<script" not in page

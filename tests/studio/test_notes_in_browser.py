"""Favourites, names and notes in a real browser, and branches compared."""

import json
import re
from html import escape
from pathlib import Path

import pytest

from jmorl.storage.notes_file import read_notes
from tests.studio.browsing import Tab
from tests.studio.serving import Served

pytestmark = pytest.mark.studio
MARKUP = "<b>careful</b> one that never ever slips"
COMPARED = """() => {
  const chart = getElement(document.querySelector(".comparison .nicegui-echart").id.slice(1)).chart;
  return chart.getOption().series.map((each) => [each.name, each.data.length]);
}"""


def star(tab, policy):
    return tab.page.get_by_role("button", name=f"favourite: policy {policy}", exact=True)


def write(tab, of, name, note):
    """Open the dialog for a name and a note, fill it, and press Save."""
    tab.page.get_by_role("button", name=f"name and note of {of}", exact=True).click()
    tab.page.get_by_text(f"Name and note of {of}").wait_for()
    tab.page.get_by_label("Name", exact=True).fill(name)
    tab.page.get_by_label("Note", exact=True).fill(note)
    tab.page.get_by_role("button", name="Save", exact=True).click()


def compare(tab, count):
    """Open the comparison, and wait until it is drawn: the second branch with so many points."""
    tab.page.get_by_role("button", name="Compare branches").click()
    tab.page.locator(".comparison canvas").wait_for()
    tab.page.wait_for_function(f"({COMPARED})()[1][1] === {count}")


def test_favourites_names_notes_and_branches_beside_each_other(browser, tmp_path):
    path = tmp_path / "first"
    with Served("--out", path, "--steps", 624_000, "--population.iterations", 4, "--ask", "always") as studio:
        tab, other = Tab(browser, studio.address), Tab(browser, studio.address)
        found = {}
        tab.asked(1)
        other.asked(1)

        # What one tab notes appears in the other.
        policies = [tab.look_at(row) for row in range(tab.rows().count())]
        for policy in policies:
            tab.page.locator(".policies-row").nth(policies.index(policy)).click()
            star(tab, policy).click()
            tab.page.locator(f'[aria-label="favourite: policy {policy}"][aria-pressed="true"]').wait_for()
        other.page.get_by_text(f"Favourites ({len(policies)})").wait_for()
        noted = policies[-1]
        write(tab, f"policy {noted}", "n" * 41, "")
        tab.page.get_by_text("the name has 41 characters, and may have 40").wait_for()
        found["dialog"] = tab.barriers(dialog=True)
        tab.page.get_by_label("Name", exact=True).fill(MARKUP)
        tab.page.keyboard.press("Tab")
        tab.page.keyboard.type("Brakes early, c is a letter here.")
        tab.page.keyboard.press("Enter")
        tab.page.keyboard.type("Never slips.")
        tab.page.wait_for_timeout(300)
        tab.screenshot("20-note-dialog")
        tab.page.get_by_role("button", name="Save", exact=True).click()
        tab.card(noted).get_by_text(MARKUP, exact=True).wait_for()
        other.rows().filter(has_text=MARKUP).wait_for()
        assert not (path / "decisions.jsonl").exists()  # what was typed is no command
        found["noted"] = tab.barriers()
        tab.screenshot("21-noted")

        # The keys know favourites, too; after a round or two some have been replaced, and can still be looked at.
        tab.page.keyboard.press("f")
        tab.page.locator(f'[aria-label="favourite: policy {noted}"][aria-pressed="false"]').wait_for()
        tab.page.keyboard.press("f")
        tab.page.locator(f'[aria-label="favourite: policy {noted}"][aria-pressed="true"]').wait_for()
        tab.page.get_by_role("spinbutton", name="rounds before the next question").fill("3")
        tab.page.keyboard.press("Tab")
        tab.card(noted).get_by_role("button", name="Choose").click()
        tab.asked(4)
        tab.page.get_by_role("button", name=re.compile("Favourites")).click()
        tab.page.locator(".policies-row.replaced").first.wait_for()
        assert sorted(map(int, tab.policies())) == sorted(policies)
        gone = int(tab.page.locator(".policies-row.replaced > span:nth-child(2)").first.inner_text())
        tab.page.locator(".policies-row.replaced").first.click()
        tab.card(gone).get_by_text("No longer in the front").wait_for()
        assert not tab.card(gone).get_by_role("button", name="Choose").is_visible()
        tab.card(gone).locator(".totals dd").first.wait_for()
        found["favourites"] = tab.barriers()
        tab.screenshot("22-favourites")
        tab.page.get_by_role("button", name=re.compile("Favourites")).click()
        tab.page.locator(".policies-row.replaced").first.wait_for(state="hidden")

        # A branch has a name, and is compared with where it comes from.
        tab.tab("History")
        tab.page.get_by_role("button", name="Choose otherwise").first.click()
        tab.asked(1)
        tab.tab("Policies")
        tab.choose(0)
        tab.asked(2)
        front = tab.rows().count()
        tab.tab("History")
        other.tab("History")
        write(tab, "first-2", "little fuel", "Where does it lead\nif fuel is all that counts?")
        write(tab, "first", "the fast way", "")
        for title in ('first-2 "little fuel"', 'first "the fast way"'):
            other.page.locator(".branch-name").get_by_text(title, exact=True).wait_for()
        tab.screenshot("23-history")
        found["history"] = tab.barriers()
        compare(tab, front)
        assert [name for name, _ in tab.page.evaluate(COMPARED)] == ['first "the fast way"', 'first-2 "little fuel"']
        found["compared"] = tab.barriers(dialog=True)
        tab.screenshot("24-compared")
        tab.page.get_by_role("checkbox", name='first "the fast way"').click()
        tab.page.wait_for_function(f"!({COMPARED})()[0][1]")
        tab.page.emulate_media(color_scheme="dark")
        tab.page.set_viewport_size({"width": 390, "height": 844})
        tab.page.wait_for_timeout(600)
        found["compared on a phone in the dark"] = tab.barriers(dialog=True)
        tab.screenshot("25-compared-phone-dark")
        tab.page.get_by_role("checkbox", name='first "the fast way"').click()
        tab.page.get_by_role("button", name="Close").click()
        tab.page.locator(".comparison").wait_for(state="hidden")
        tab.tab("Policies")
        tab.page.wait_for_timeout(600)
        assert tab.page.evaluate("document.documentElement.scrollWidth") <= 390
        found["phone in the dark"] = tab.barriers()
        tab.screenshot("26-phone-dark")
        tab.page.locator(".cards").scroll_into_view_if_needed()
        tab.screenshot("26-phone-dark-cards")
        tab.page.set_viewport_size({"width": 1280, "height": 720})
        tab.page.wait_for_timeout(600)
        tab.screenshot("27-dark")
        tab.page.emulate_media(color_scheme="light")

        # The end is named, and the journey tells of it all.
        tab.rows().filter(has_text=MARKUP).click()
        tab.page.get_by_role("button", name="Stop here").click()
        end = tab.page.get_by_role("button", name=f'policy {noted} "{MARKUP}": ')
        end.wait_for()
        tab.screenshot("28-the-end")
        end.click()
        tab.page.get_by_text(f'The result is policy {noted} "{MARKUP[:17]}…"').wait_for()
        tab.screenshot("29-ended")
        tab.tab("History")
        compare(tab, front + 1)  # and a star for the result
        tab.screenshot("30-compared-at-the-end")
        tab.page.keyboard.press("Escape")
        tab.page.locator(".comparison").wait_for(state="hidden")
        tab.page.get_by_role("button", name="Save more").click()
        with tab.page.expect_download() as download:
            tab.page.get_by_text(re.compile("as a page")).click()
        journey = Path(download.value.path()).read_text(encoding="utf-8")
        assert "★ policy" in journey and escape(MARKUP) in journey and "<b>careful" not in journey
        assert not tab.problems and not other.problems
    assert {state: barriers for state, barriers in found.items() if barriers} == {}
    kept = read_notes(path)
    assert kept.run.name == "the fast way" and kept.favourites == sorted(policies)
    assert kept.policy(noted).text == "Brakes early, c is a letter here.\nNever slips."
    assert kept.before(10**6).policies == read_notes(tmp_path / "first-2").policies
    assert json.loads((tmp_path / "first-2" / "result.json").read_text())["chosen"]["policy"] == noted

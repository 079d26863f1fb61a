"""Watching, and being called when a question waits, in a real browser."""

import json

import pytest

from tests.studio.browsing import Tab
from tests.studio.serving import Served

pytestmark = pytest.mark.studio
STATES = (("", "light", (1280, 720)), ("-dark", "dark", (1280, 720)), ("-phone", "light", (390, 844)))
STEERING = (
    *("Choose", "Keep", "Skip", "Compare two", "Stop here", "Pause training", "Ask me", "Train on", "Begin", "Prefer"),
    *("Open", "favourite:", "name and note", "Call me", "Share"),
)  # what buttons are called that do more than show
# What a page sounds and notifies, in place of a person who hears and sees it.
RECORDED = """
  window.tones = [];
  window.notes = [];
  window.OscillatorNode = class extends OscillatorNode {
    start(at) {
      tones.push(at);
      super.start(at);
    }
  };
  window.Notification = class {
    static permission = "default";
    static async requestPermission() {
      return (Notification.permission = "granted");
    }
    constructor(title) {
      notes.push(title);
    }
  };
  document.hasFocus = () => sessionStorage.getItem("away") === null;
"""


def looked_at_everywhere(tab, name, found, dialog=False):
    """Take pictures of a state in the light, in the dark and on a phone, and note what axe-core finds in each."""
    for how, scheme, size in STATES:
        tab.page.emulate_media(color_scheme=scheme)
        tab.page.set_viewport_size({"width": size[0], "height": size[1]})
        tab.page.wait_for_timeout(800)  # buttons take their new colour by and by
        found[f"{name}{how}"] = tab.barriers(dialog)
        tab.screenshot(f"{name}{how}")
        assert tab.page.evaluate("document.documentElement.scrollWidth") <= size[0]
    tab.page.emulate_media(color_scheme="light")
    tab.page.set_viewport_size({"width": 1280, "height": 720})


def ways_to_steer(tab):
    """Return the buttons in sight that would steer."""
    buttons = tab.page.get_by_role("button").filter(visible=True).all()
    names = [button.get_attribute("aria-label") or button.inner_text() for button in buttons]
    return [name for name in names if name.startswith(STEERING)]


def test_who_has_the_link_sees_it_all_and_steers_nothing(browser, tmp_path):
    path, found = tmp_path / "first", {}
    with Served("--out", path, "--steps", 624_000, "--population.iterations", 4, "--ask", "always") as studio:
        steers = Tab(browser, studio.address)
        steers.asked(1)
        assert ways_to_steer(steers)
        steers.page.get_by_role("button", name="Share", exact=True).click()
        steers.page.get_by_text("can leave out /watch and steer").wait_for()
        looked_at_everywhere(steers, "30-share", found, dialog=True)
        link = steers.page.get_by_label("Address for watching").input_value()
        steers.page.get_by_role("button", name="Copy", exact=True).click()
        steers.page.get_by_text("The address is copied.").wait_for()
        steers.page.keyboard.press("Escape")
        steers.page.locator(".share").wait_for(state="hidden")

        # Somebody follows the link from a page of another site.
        watches = Tab(browser, studio.address, f"data:text/html,<a href='{link}'>watch</a>")
        watches.page.get_by_role("link", name="watch").click()
        watches.asked(1)
        assert watches.page.url == f"{studio.address}/watch/"
        watches.page.get_by_text("Somebody else answers.").wait_for()
        policy = watches.look_at(1)
        assert watches.pictures_differ(policy)
        looked_at_everywhere(watches, "31-watching", found)
        assert ways_to_steer(watches) == []
        for key in "ck=f":
            watches.page.keyboard.press(key)
        watches.page.get_by_text("Nothing has changed: this page is for watching.").first.wait_for()
        with watches.page.expect_download() as download:
            watches.page.get_by_role("button", name=f"save the file of policy {policy}").click()
        assert download.value.suggested_filename == f"policy-{policy}.npz"
        assert not [*path.glob("decisions.jsonl"), *path.glob("notes.json")]

        # It follows whoever steers, in every panel.
        watches.tab("E-NAUTILUS")
        watches.page.get_by_text("Nobody is going through E-NAUTILUS").wait_for()
        steers.tab("E-NAUTILUS")
        steers.page.get_by_role("button", name="Begin").click()
        watches.page.get_by_text("Which point do you prefer").wait_for()
        watches.screenshot("32-watching-enautilus")
        assert ways_to_steer(watches) == []
        steers.tab("Policies")
        steers.choose(0)
        watches.asked(2)
        steers.tab("History")
        steers.page.get_by_role("button", name="Choose otherwise").first.click()
        watches.page.locator(".run-name", has_text="first-2").wait_for()
        watches.tab("History")
        watches.page.get_by_role("button", name="Compare branches").click()
        watches.page.locator(".comparison canvas").wait_for()
        watches.page.get_by_role("button", name="Close").click()
        watches.page.locator(".comparison").wait_for(state="hidden")
        assert ways_to_steer(watches) == []
        watches.screenshot("33-watching-history")

        # Neither a reload nor the list of runs leads to more.
        watches.page.reload()
        watches.asked(1)
        assert ways_to_steer(watches) == []
        watches.page.get_by_role("link", name="All runs").click()
        watches.page.locator(".runs-row.open").wait_for()
        assert watches.page.url == f"{studio.address}/watch/runs"
        looked_at_everywhere(watches, "34-watching-runs", found)
        assert ways_to_steer(watches) == [] and not watches.page.locator(".runs-open, .run-form").count()
        watches.page.get_by_role("link", name="Go to it").click()
        watches.asked(1)
        assert watches.page.url == f"{studio.address}/watch/" and ways_to_steer(watches) == []

        # On this machine alone the plain address steers, in this browser, too; its other address still does not.
        watches.page.goto(studio.address)
        watches.page.get_by_role("button", name="Choose A").wait_for()
        watches.page.goto(f"{studio.address}/watch")
        watches.asked(1)
        assert ways_to_steer(watches) == []

        # The end, with all that can be saved of it.
        steers.page.get_by_role("button", name="Stop here").click()
        steers.page.get_by_role("button", name="End with").first.click()
        watches.page.get_by_text("The result is policy").wait_for()
        assert ways_to_steer(watches) == []
        watches.page.get_by_role("button", name="Save more").click()
        with watches.page.expect_download() as download:
            watches.page.get_by_text("as a table").click()
        assert download.value.suggested_filename == "front-first-2.csv"
        watches.screenshot("35-watching-end")
        assert not steers.problems and not watches.problems
    assert {state: barriers for state, barriers in found.items() if barriers} == {}
    assert len((path / "decisions.jsonl").read_text().splitlines()) == 1


def test_who_is_away_is_called_once_for_each_question_if_they_wish(browser, small, tmp_path):
    path, found = tmp_path / "run", {}
    with Served("--out", path, *small) as studio:
        tab = Tab(browser, studio.address)
        page = tab.page
        page.add_init_script(RECORDED)
        page.reload()
        calls = lambda: page.evaluate("[tones.length, notes.length]")  # noqa: E731
        switch = page.get_by_role("button", name="Call me when it is my turn")
        tab.asked(1)
        assert switch.get_attribute("aria-pressed") == "false"
        page.evaluate("sessionStorage.setItem('away', 'yes')")
        tab.choose(0)
        tab.asked(2)
        assert calls() == [0, 0]  # nobody wishes for it
        switch.click()
        page.locator('[aria-label="Call me when it is my turn"][aria-pressed="true"]').wait_for()
        assert calls() == [2, 0] and page.evaluate("Notification.permission") == "granted"  # how it sounds
        looked_at_everywhere(tab, "36-called", found)
        tab.choose(0)
        tab.asked(3)
        page.wait_for_function("notes.length === 1")
        assert calls() == [4, 1] and page.evaluate("notes") == ["Your turn: run – jmorl studio"]
        page.reload()
        tab.asked(3)
        assert switch.get_attribute("aria-pressed") == "true" and calls() == [0, 0]  # this question is known
        page.evaluate("sessionStorage.removeItem('away')")
        tab.choose(0)
        tab.final()
        assert calls() == [0, 0]  # somebody looks
        switch.click()
        page.reload()
        tab.final()
        assert switch.get_attribute("aria-pressed") == "false"
        assert not tab.problems
    assert {state: barriers for state, barriers in found.items() if barriers} == {}
    assert len([json.loads(line) for line in (path / "decisions.jsonl").read_text().splitlines()]) == 3

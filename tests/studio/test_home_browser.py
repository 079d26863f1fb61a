"""The home page in a real browser: runs found and opened, a new one begun, and what must not be lost."""

import re
import shutil

import pytest

from jmorl.storage.resume import branch
from tests.registered import ThreeWays
from tests.resuming import train
from tests.studio.browsing import Tab, chromium
from tests.studio.serving import Served, free_port

pytestmark = pytest.mark.studio


@pytest.fixture(scope="module")
def browser():
    with chromium() as browser:
        yield browser


@pytest.fixture
def runs(small_config, tmp_path):
    """Make a run that has ended, copies of it, one of them damaged, and a branch that waits for its person."""
    runs = tmp_path / "runs"
    ended = train(runs / "ended", small_config.replace(env=f"tests.registered:{ThreeWays.id}"))
    for number in range(8):
        shutil.copytree(ended, runs / "study" / f"copy-{number}")
    shutil.copytree(ended, runs / "<i>broken</i>")
    (runs / "<i>broken</i>" / "manifest.json").write_text("{")
    branch(ended, 2, runs / "yours", user="terminal").folder.close()
    return runs


def listed(tab):
    """Return the names of the runs in the list, from the top."""
    tab.page.locator(".runs-open").first.wait_for()
    return tab.page.locator(".runs-open").all_inner_texts()


def row(tab, name):
    return tab.page.locator(".runs-row", has=tab.page.get_by_role("button", name=name, exact=True))


def on_run_page(tab, name):
    """Wait until the tab shows the page of a run."""
    tab.page.locator(".run-name", has_text=f"{name} · ").wait_for()


def looked_at_everywhere(tab, name, found):
    """Take pictures of a state in the light, in the dark and on a phone, and note what axe-core finds in each."""
    for how, scheme, size in (
        ("", "light", (1280, 720)),
        ("-dark", "dark", (1280, 720)),
        ("-phone", "light", (390, 844)),
    ):
        tab.page.emulate_media(color_scheme=scheme)
        tab.page.set_viewport_size({"width": size[0], "height": size[1]})
        tab.page.wait_for_timeout(800)  # buttons take their new colour by and by
        found[f"{name}{how}"] = tab.barriers()
        tab.screenshot(f"{name}{how}")
        assert tab.page.evaluate("document.documentElement.scrollWidth") <= size[0]
    tab.page.set_viewport_size({"width": 1280, "height": 720})


def test_runs_are_found_and_opened_and_two_tabs_do_not_get_in_each_others_way(browser, runs):
    found, port = {}, free_port()
    with Served(runs, port=port) as studio:
        tab = Tab(browser, studio.address)
        assert len(listed(tab)) == 11 and tab.page.url.endswith("/runs")
        row(tab, "<i>broken</i>").get_by_text("manifest.json is not valid JSON").wait_for()
        row(tab, "yours").get_by_text("branch of ended after round 2").wait_for()
        row(tab, "ended").get_by_text("Finished").wait_for()
        looked_at_everywhere(tab, "home-1-runs", found)
        words = tab.page.get_by_role("searchbox")
        words.fill("copy-3 finished")
        tab.page.wait_for_function("document.querySelectorAll('.runs-open').length === 1")
        words.fill("no such run")
        tab.page.get_by_text("No run has all these words.").wait_for()
        words.fill("")
        # The keyboard is enough.
        tab.page.locator(".runs-open").first.focus()
        for _ in range(listed(tab).index("yours")):
            tab.page.keyboard.press("ArrowDown")
        tab.page.keyboard.press("Enter")
        on_run_page(tab, "yours")
        tab.asked(3)
        # Another tab looks at the list meanwhile, which follows what happens.
        home = Tab(browser, f"{studio.address}/runs")
        home.page.get_by_text("Open: yours. Waiting for your answer").wait_for()
        row(home, "yours").get_by_text("Open here").wait_for()
        looked_at_everywhere(home, "home-2-open", found)
        home.page.reload()
        shutil.copytree(runs / "ended", runs / "come-since")
        row(home, "come-since").wait_for()
        row(home, "<i>broken</i>").click()
        home.page.get_by_text("cannot be read as a run").wait_for()
        tab.asked(3)
        row(home, "ended").click()
        for each in (home, tab):
            on_run_page(each, "ended")
            each.page.get_by_text("The result is policy").wait_for()
        tab.page.get_by_text("ended was opened, in another tab.").wait_for()
        tab.page.get_by_role("link", name="All runs").click()
        row(tab, "ended").get_by_text("Open here").wait_for()
        home.lost()
        tab.lost()
        studio.kill()
    with Served(runs, port=port):  # in which no run is open
        for each in (home, tab):
            each.found_again()
            row(each, "yours").get_by_text("Interrupted").wait_for()
        assert home.page.url.endswith("/runs") and not home.page.get_by_text("Open:").is_visible()
    assert {state: barriers for state, barriers in found.items() if barriers} == {}


def test_a_run_is_begun_with_the_form_and_left_for_another_after_its_round(browser, small_config, tmp_path):
    runs, found = tmp_path / "runs", {}
    runs.mkdir()
    ended = train(tmp_path / "ended", small_config.replace(env=f"tests.registered:{ThreeWays.id}"))
    with Served(runs) as studio:
        tab = Tab(browser, studio.address)
        page = tab.page
        page.get_by_text("There is no run in this folder yet.").wait_for()
        page.get_by_text("Its objectives are time and fuel.").wait_for()
        page.get_by_label("Environment").click()
        page.get_by_role("option", name="mo-hopper-v5").click()
        page.get_by_text("Its objectives are speed, height and energy.").wait_for()
        page.get_by_label("Environment").click()
        page.get_by_role("option", name="mo-mountaincarcontinuous-v0").click()
        page.get_by_label("Seed").fill("x")
        page.get_by_label("Folder").fill("../outside")
        page.get_by_role("button", name=re.compile("More settings")).click()
        page.get_by_label("Settings as TOML").fill("population.iterations = 0\nuser = 'script=/etc/passwd'")
        page.get_by_role("button", name="Begin").click()
        page.locator(".problems li").first.wait_for()
        problems = page.locator(".problems li").all_inner_texts()
        assert {each.partition(":")[0] for each in problems} == {"seed", "folder", "population.iterations", "user"}
        looked_at_everywhere(tab, "home-3-problems", found)
        assert not [*runs.iterdir()] and {*tmp_path.iterdir()} == {runs, ended}
        page.get_by_label("Seed").fill("3")
        page.get_by_label("Folder").fill("car")
        page.get_by_label("Steps of training").fill("624000")
        page.get_by_label("Settings as TOML").fill("population.iterations = 4")
        page.get_by_label("You are asked", exact=True).click()
        page.get_by_role("option", name="before every round").click()
        page.get_by_role("button", name="Begin").click()
        on_run_page(tab, "car")
        page.get_by_text(re.compile("Warm-up: training")).wait_for()
        assert [path.name for path in runs.iterdir()] == ["car"]
        # It is left for another one as soon as its warm-up is over, whatever becomes of the page that asked for it.
        ended.rename(runs / "ended")
        page.get_by_role("link", name="All runs").click()
        row(tab, "ended").click()
        page.get_by_text("Opening ended, as soon as this round of car is over").wait_for()
        page.reload()
        page.get_by_text("Opening ended").wait_for()
        assert page.get_by_label("Settings as TOML").input_value() == "population.iterations = 4"
        tab.screenshot("home-4-opening")
        found["opening"] = tab.barriers()
        page.get_by_text(re.compile("^Open: ended")).wait_for()
        row(tab, "car").get_by_text("Interrupted").wait_for()
        row(tab, "car").click()
        on_run_page(tab, "car")
        tab.asked(1)
    assert {state: barriers for state, barriers in found.items() if barriers} == {}

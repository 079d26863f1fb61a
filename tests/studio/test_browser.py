"""The studio in a real browser: a whole run on MountainCar, and what must not be lost, on a small one."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from jmorl.storage.policy_file import load_policy
from jmorl.storage.stored_run import read_run
from tests.studio.browsing import Tab
from tests.studio.serving import Served, free_port

pytestmark = pytest.mark.studio
# E-NAUTILUS shows its question with so many iterations left, or has ended.
LEFT_OR_ENDED = """(left) => document.querySelector('[aria-label="iterations left"]')?.value === left
  || document.querySelector(".ending")"""
REPLACED = "has replaced your last choice"
CHART = """getElement(document.querySelector(".front .nicegui-echart").id.slice(1)).chart"""


def decisions(path):
    return [json.loads(line) for line in (path / "decisions.jsonl").read_text().splitlines()]


def test_a_person_steers_a_run_from_the_start_to_a_policy_file(browser, tmp_path):
    path = tmp_path / "first"
    with Served("--out", path, "--steps", 624_000, "--population.iterations", 4, "--ask", "always") as studio:
        tab = Tab(browser, studio.address)
        tab.page.get_by_text("Warm-up: training 6 new agents").wait_for()
        tab.page.get_by_text("still learning").first.wait_for()
        tab.screenshot("1-warm-up")
        assert not tab.page.get_by_role("button", name="Choose A").is_visible()
        assert tab.page.title() == "first – jmorl studio"
        tab.asked(1)
        tab.page.wait_for_function("document.title === 'Your turn: first – jmorl studio'")
        assert not tab.page.get_by_text("still learning").count()
        assert tab.bounds() is None

        # Two policies beside each other, at work; what choosing the one in focus would mean.
        policies = [tab.look_at(0), tab.look_at(1)]
        assert all(tab.pictures_differ(policy) for policy in policies)
        tab.page.get_by_text(re.compile("If you choose .: the search")).wait_for()
        tab.card(policies[1]).locator(".totals dd").first.wait_for()
        tab.screenshot("2-question")

        # Numbers are as people say them: of steps, less is better.
        score = tab.card(policies[1]).locator(".scores dd").first.inner_text()
        assert re.fullmatch(r"\d+\.\d+ ±\d+\.\d+ steps", score), score
        times = [tab.value(row) for row in range(tab.rows().count())]
        assert times == sorted(times) and times[0] > 0
        tab.tab("Limits")
        tab.page.get_by_label("time (steps), at most").fill(str(times[0] + 0.5))
        tab.page.get_by_text(re.compile(f"1 of {len(times)} .* your limits")).wait_for()
        tab.screenshot("2-limits")
        tab.page.get_by_label("time (steps), at most").fill("")
        tab.page.get_by_text(re.compile(f"{len(times)} of {len(times)} .* your limits")).wait_for()
        tab.tab("Policies")
        tab.card(policies[1]).get_by_role("button", name="Choose").click()
        tab.page.get_by_text(re.compile("Training round 1|Round 2: which")).first.wait_for()
        tab.screenshot("3-training")
        tab.asked(2)
        # The last choice, or what replaced it, is in focus; what is far out is at the edge.
        assert tab.page.locator(".place.focus .standing").inner_text() in ("your last choice", REPLACED)
        assert tab.page.locator(".place.focus .mark-A").is_visible() and tab.page.get_by_text("new", exact=True).count()
        assert tab.far_out() and set(map(str, tab.far_out())) < set(tab.policies())
        assert tab.drift() < 0.5
        before = tab.bounds()
        tab.better_in("fuel").click()
        tab.screenshot("4-more-of-fuel")
        tab.better_in("fuel").click()
        tab.choose(0)
        tab.asked(3)
        after = tab.bounds()
        assert before is not None and after is not None and before != after
        tab.tab("Progress")
        tab.screenshot("5-progress")

        # Two generations back, and otherwise.
        tab.tab("History")
        first = decisions(path)
        tab.page.get_by_role("button", name="Choose otherwise").first.click()
        tab.asked(1)
        assert tab.bounds() is None
        tab.tab("Policies")
        last = tab.rows().count() - 1
        otherwise = tab.look_at(last)
        tab.page.get_by_role("spinbutton", name="rounds before the next question").fill("2")
        tab.page.keyboard.press("Tab")
        tab.card(otherwise).get_by_role("button", name="Choose").click()
        tab.asked(3)
        tab.tab("History")
        tab.screenshot("6-history")
        branch = tmp_path / "first-2"
        assert [each["generation"] for each in decisions(branch)] == [1]
        assert decisions(branch)[0]["policy"] != first[0]["policy"] and decisions(path) == first

        # E-NAUTILUS to its end, one step taken back on the way.
        tab.tab("E-NAUTILUS")
        tab.page.get_by_role("button", name="Begin").click()
        tab.page.get_by_role("button", name="Prefer").first.click()
        tab.page.get_by_text("Which point do you prefer").wait_for()
        tab.screenshot("7-enautilus")
        tab.page.get_by_role("button", name="Step back").click()
        for left in (3, 2, 1):
            tab.page.wait_for_function(LEFT_OR_ENDED, arg=str(left))
            if tab.page.get_by_text("E-NAUTILUS ends on").count():
                break
            tab.page.get_by_role("button", name="Prefer").first.click()
        tab.page.get_by_text("E-NAUTILUS ends on").wait_for()
        ended_on = json.loads((branch / "enautilus.json").read_text())["policy"]
        assert tab.card(ended_on).is_visible()
        tab.card(ended_on).get_by_role("button", name="Choose").click()

        # To the end, and the policy as a file.
        tab.asked(4)
        tab.tab("Policies")
        tab.choose(0)
        tab.final()
        tab.screenshot("8-final-question")
        result = tab.look_at(0)
        tab.card(result).get_by_role("button", name="is the result").click()
        tab.end(result)
        tab.page.get_by_text(f"The result is policy {result}").wait_for()
        tab.screenshot("9-end")
        with tab.page.expect_download() as download:
            tab.page.get_by_role("button", name="Save the policy file").click()
        saved = tmp_path / "saved.npz"
        download.value.save_as(saved)
        tab.page.get_by_text(f'load_policy("policy-{result}.npz")').wait_for()
        tab.page.get_by_role("button", name="Close").click()
        for what, kind, start in (
            ("table", "csv", b"policy,"),
            ("picture", "png", b"\x89PNG"),
            ("page", "html", b"<!doc"),
        ):
            tab.page.locator(".q-menu").wait_for(state="hidden")  # one that still closes takes the click
            tab.page.get_by_role("button", name="Save more").click()
            with tab.page.expect_download() as download:
                tab.page.get_by_text(re.compile(f"as a {what}")).click()
            assert download.value.suggested_filename.endswith(f"first-2.{kind}")
            assert Path(download.value.path()).read_bytes().startswith(start)
        tab.page.get_by_role("button", name="How it came about").click()
        tab.page.get_by_role("tab", name="History", selected=True).wait_for()
        assert not tab.problems
    policy = load_policy(saved)
    stored = read_run(branch)
    assert policy.header["id"] == result == stored.chosen.id
    np.testing.assert_allclose(policy.header["values"], stored.chosen.values)
    assert np.abs(policy([-0.5, 0.01])) <= 1
    assert "go on" not in "".join(studio.log) and studio.process.returncode == 143


def test_a_question_outlives_a_reload_a_closed_tab_and_a_killed_server(browser, small, tmp_path):
    path, port = tmp_path / "run", free_port()
    with Served("--out", path, *small, port=port) as studio:
        tab = Tab(browser, studio.address)
        tab.asked(1)
        policy = tab.look_at(1)
        tab.page.reload()
        tab.asked(1)
        tab.card(policy).wait_for()  # what was laid out still is
        shown = tab.policies()
        tab.lost()
        studio.kill()
        # One message says so; nothing can be pressed, by keys either.
        tab.page.get_by_text("The studio does not answer").wait_for()
        assert str(path) in tab.page.get_by_role("alert").inner_text()
        assert tab.page.locator(".studio[inert]").count() and not tab.page.get_by_text("Connection lost").is_visible()
        tab.screenshot("15-lost")
        tab.page.keyboard.press("c")
        assert not (path / "decisions.jsonl").exists()
    with Served(path, port=port) as studio:
        tab.found_again()
        tab.asked(1)
        assert tab.policies() == shown
        chosen = tab.choose(0)
        tab.asked(2)
        tab.lost()
        studio.kill()
    with Served(path, port=port) as studio:
        tab.found_again()
        tab.asked(2)
        again = Tab(browser, studio.address)  # in place of a tab that was closed
        again.asked(2)
        assert [(each["generation"], each["policy"]) for each in decisions(path)] == [(1, chosen)]
        again.page.close()
        tab.choose(0)
        tab.asked(3)
        assert len(decisions(path)) == 2


def test_silence_is_broken_a_run_paused_ended_and_trained_on(browser, tmp_path):
    path = tmp_path / "run"
    with Served("--out", path, "--steps", 624_000, "--population.iterations", 4, "--ask", "always") as studio:
        tab = Tab(browser, studio.address)
        tab.asked(1)
        rounds = tab.page.get_by_role("spinbutton", name="rounds before the next question")
        rounds.fill("99")
        tab.page.keyboard.press("Tab")
        tab.choose(0)
        tab.page.get_by_text("You are asked again in 4 rounds.").wait_for()  # as many as there are
        tab.page.get_by_role("button", name="Ask me after this round").click()
        tab.page.get_by_text(re.compile("Round [234]: which of these")).wait_for()
        tab.choose(0)
        tab.page.get_by_role("button", name="Pause training").click()
        tab.page.get_by_text("Paused after round").wait_for()
        tab.screenshot("11-paused")
        tab.page.get_by_role("button", name="Go on with this run").click()
        tab.page.get_by_text(re.compile("Round [34]: which of these")).wait_for()
        # Another policy is looked at, and the run still ends with the one that was chosen.
        tab.look_at(tab.rows().count() - 1)
        tab.page.get_by_role("button", name="Stop here").click()
        tab.page.get_by_text("End the run?").wait_for()
        tab.screenshot("12-the-end")
        tab.page.get_by_role("button", name="End with").first.click()
        tab.page.get_by_text("The result is policy").wait_for()
        ended = decisions(path)[-1]
        last = decisions(path)[-2]
        better = np.array(ended["values"]) >= np.array(last["values"])
        assert ended["stop"] and (ended["policy"] == last["policy"] or better.all())
        tab.page.get_by_role("spinbutton", name="rounds to train on for").fill("2")
        tab.page.keyboard.press("Tab")
        tab.page.get_by_role("button", name="Train on for").click()
        tab.page.get_by_text("which of these").wait_for()
        tab.page.get_by_text("of 2 rounds").wait_for()
        assert not tab.problems
    assert read_run(path).chosen.id == ended["policy"]


def test_the_last_question_allows_every_policy_and_is_confirmed(browser, small, tmp_path):
    """With the paper's rule, which asks about those within the bounds only."""
    path = tmp_path / "run"
    with Served("--out", path, *small) as studio:
        tab = Tab(browser, studio.address)
        for generation in (1, 2, 3):
            tab.asked(generation)
            if generation == 3:
                tab.page.get_by_text("This is the last round").wait_for()
            tab.choose(0)
        tab.final()
        keep = tab.page.get_by_role("button", name=re.compile("Keep|Take"))
        if keep.count():
            keep.click()
            tab.page.get_by_text("End the run?").wait_for()
            tab.page.get_by_role("button", name="Not yet", exact=True).click()
            tab.page.get_by_text("End the run?").wait_for(state="hidden")
        outside = tab.page.locator(".policies-row.outside")
        assert outside.count()
        policy = int(outside.last.locator("span").nth(1).inner_text())
        outside.last.click()
        tab.card(policy).get_by_text("Outside the search area.").wait_for()
        tab.card(policy).get_by_role("button", name="is the result").click()
        assert len(decisions(path)) == 3
        tab.end(policy)
        tab.page.get_by_text(f"The result is policy {policy}").wait_for()
        assert decisions(path)[-1]["policy"] == policy and not tab.problems


def test_of_two_tabs_the_first_answers_and_the_second_is_told(browser, small, tmp_path):
    path = tmp_path / "run"
    with Served("--out", path, *small) as studio:
        tabs = [Tab(browser, studio.address) for _ in range(2)]
        for tab in tabs:
            tab.asked(1)
        # Each looks at what it likes.
        policy, other = tabs[0].look_at(0), tabs[1].look_at(1)
        tabs[0].page.wait_for_timeout(500)
        focused = [tab.page.locator(".place.focus .card-title").inner_text() for tab in tabs]
        assert focused == [f"policy {policy}", f"policy {other}"]
        tabs[1].look_at(0)
        buttons = [tab.card(policy).get_by_role("button", name="Choose").element_handle() for tab in tabs]
        for button in buttons:
            button.evaluate("(button) => button.click()")
        # Whether the second click was on its way before its tab knew of the first or not.
        tabs[1].page.get_by_text("in another tab").wait_for()
        for tab in tabs:
            tab.asked(2)
        assert [each["generation"] for each in decisions(path)] == [1]
        tabs[0].choose(0)
        tabs[1].page.get_by_text("was chosen, in another tab").wait_for()  # who has not clicked is told, too
        tabs[1].asked(3)
        assert not tabs[0].page.get_by_text("in another tab").count()


def test_a_front_of_thousands_with_three_objectives_can_be_searched(browser):
    with Served(command=("benchmarks.studio", "still")) as studio:
        tab = Tab(browser, studio.address)
        tab.asked(4)
        tab.to_the_top()
        first = tab.look_at(0)
        best = tab.value(0)
        tab.page.get_by_role("columnheader", name="objective 1").click()  # the other way round
        tab.page.wait_for_function("(n) => !document.querySelector('.policies-row').textContent.includes(n)", arg=first)
        tab.to_the_top()
        assert tab.value(0) < tab.value(1) < best
        tab.better_in("objective 3").click()
        tab.page.get_by_text(f"better in objective 3 than policy {first}").wait_for()
        tab.better_in("objective 3").click()
        tab.page.get_by_text("which of these 2000 policies").wait_for()
        tab.page.get_by_label("→").click()
        tab.page.get_by_role("option", name="objective 3").click()
        tab.page.wait_for_function(f"{CHART}.getOption().xAxis[0].name.startsWith('objective 3')")
        # A click on a point lays out what is there, or what lies over it.
        x, y = tab.page.evaluate(
            f"""() => {{
              const chart = {CHART}, place = chart.getDom().getBoundingClientRect();
              const data = chart.getOption().series.find((each) => each.id === "within the bounds").data[7];
              const [x, y] = chart.convertToPixel({{ xAxisIndex: 0, yAxisIndex: 0 }}, [data[3], data[2]]);
              return [place.x + x, place.y + y];
            }}"""
        )
        tab.page.mouse.click(x, y)
        tab.page.locator(".place").nth(1).locator(".card-title").wait_for()
        assert not tab.problems


def test_five_objectives_with_long_labels_have_room(browser):
    label = "mean force of the carriage's actuator"
    with Served("--objectives", 5, "--label", label, command=("benchmarks.studio", "still")) as studio:
        tab = Tab(browser, studio.address)
        tab.asked(4)
        tab.page.get_by_role("button", name="Choose A").wait_for()
        tab.screenshot("16-five-objectives")
        assert tab.page.evaluate("document.documentElement.scrollWidth") <= 1280
        # All of each button, heading and number can be read: nothing is wider than its place.
        wider = "(all) => all.filter((each) => each.scrollWidth > each.clientWidth + 1).map((each) => each.textContent)"
        for read in (".question .q-btn", ".heading", ".policies-head button", ".scores dt", ".scores dd"):
            assert tab.page.locator(read).evaluate_all(wider) == []
        assert tab.better_in(f"{label} 5").bounding_box()["width"] > 100
        assert not tab.problems


def test_the_keyboard_is_enough(browser, small, tmp_path):
    path = tmp_path / "run"
    with Served("--out", path, *small) as studio:
        tab = Tab(browser, studio.address)
        tab.asked(1)
        keys = tab.page.keyboard
        keys.press("ArrowRight")
        tab.page.locator(".place.focus").wait_for()
        keys.press("ArrowRight")
        tab.page.locator(".place").nth(1).wait_for()
        keys.press("2")
        tab.page.locator('[aria-pressed="true"]', has_text="east").wait_for()
        keys.press("2")
        keys.press("x")
        tab.page.locator(".place.focus").wait_for()
        keys.press("c")
        tab.asked(2)
        tab.page.locator(".place.focus").wait_for()
        first = decisions(path)[0]["policy"]
        keys.press("?")
        tab.page.get_by_text("keep the last choice").wait_for()
        keys.press("Escape")
        tab.page.get_by_text("keep the last choice").wait_for(state="hidden")
        keys.press("k")
        tab.asked(3)
        assert [each["generation"] for each in decisions(path)] == [1, 2]
        assert first in [each["policy"] for each in decisions(path)[1]["shown"]]
        # To the button that stops the run, by the tabulator alone.
        for _ in range(60):
            keys.press("Tab")
            if tab.page.evaluate("document.activeElement.textContent.trim()") == "Stop here":
                break
        keys.press("Enter")
        end = tab.page.get_by_role("button", name="End with").first
        end.wait_for()
        keys.press("k")  # goes to the dialog, for which it means nothing
        end.press("Enter")
        tab.page.get_by_text("The result is policy").wait_for()
        assert [each["stop"] for each in decisions(path)] == [False, False, True]


def test_nothing_keeps_anybody_out_in_any_state(browser, tmp_path):
    """As axe-core judges; in the dark and on a phone, too."""
    with Served("--out", tmp_path / "run", "--steps", 624_000, "--population.iterations", 4) as studio:
        tab = Tab(browser, studio.address)
        found = {}
        tab.page.get_by_text("Warm-up: training 6 new agents").wait_for()
        found["warm-up"] = tab.barriers()
        tab.asked(1)
        tab.page.get_by_text(re.compile("If you choose A: the search")).wait_for()
        found["question"] = tab.barriers()
        for title in ("Progress", "History", "Limits", "Between", "E-NAUTILUS"):
            tab.tab(title)
            tab.page.get_by_role("tab", name=title, selected=True).wait_for()
            found[title] = tab.barriers()
        tab.page.get_by_role("button", name="Begin").click()
        tab.page.get_by_text("Which point do you prefer").wait_for()
        found["points"] = tab.barriers()
        tab.page.keyboard.press("?")
        tab.page.get_by_text("keep the last choice").wait_for()
        found["keys"] = tab.barriers(dialog=True)
        tab.page.keyboard.press("Escape")
        tab.page.get_by_text("keep the last choice").wait_for(state="hidden")
        assert tab.page.locator("h1").count() == tab.page.locator("main").count() == 1
        tab.page.emulate_media(color_scheme="dark")
        tab.page.locator(".body--dark").wait_for()
        tab.page.wait_for_timeout(500)  # buttons take their new colour by and by
        found["dark"] = tab.barriers()
        tab.screenshot("13-dark")
        tab.page.emulate_media(color_scheme="light")
        tab.page.set_viewport_size({"width": 390, "height": 844})
        tab.page.wait_for_timeout(500)
        found["phone"] = tab.barriers()
        tab.screenshot("14-phone")
        assert tab.page.evaluate("document.documentElement.scrollWidth") <= 390
        tab.page.set_viewport_size({"width": 1280, "height": 720})
        tab.page.get_by_role("button", name="Stop here").click()
        tab.page.get_by_text("End the run?").wait_for()
        found["ending"] = tab.barriers(dialog=True)
        tab.page.get_by_role("button", name="End with").first.click()
        tab.page.get_by_text("The result is policy").wait_for()
        found["end"] = tab.barriers()
        assert {state: barriers for state, barriers in found.items() if barriers} == {}
        assert not tab.problems


def test_a_dial_leads_from_one_policy_to_another(browser, tmp_path):
    """The picture, the scores and the file follow it; the keys of the page do not move what is laid out meanwhile."""
    path = tmp_path / "dial"
    with Served("--out", path, "--steps", 624_000, "--population.iterations", 4, "--ask", "always") as studio:
        tab = Tab(browser, studio.address)
        tab.asked(1)
        tab.tab("Between")
        tab.put_all_away()
        tab.page.get_by_text("Lay out two policies").wait_for()
        tab.tab("Policies")
        first, second = tab.look_at(0), tab.look_at(tab.rows().count() - 1)
        tab.tab("Between")
        dial = tab.page.get_by_label("way from the first policy to the second")
        tab.page.get_by_text(f"50 % of A (policy {first}), 50 % of B (policy {second})").wait_for()
        tab.page.get_by_text("over 16 episodes").wait_for()
        middle = tab.page.locator(".between-scores").inner_text()
        tab.page.locator(".dial canvas").wait_for()
        tab.screenshot("10-between")
        dial.press("End")
        tab.page.get_by_text(f"Beyond B (policy {second}), away from A (policy {first})").wait_for()
        tab.page.get_by_text("over 16 episodes").wait_for()
        assert tab.page.locator(".between-scores").inner_text() != middle
        dial.press("ArrowLeft")
        assert dial.input_value() == "145"
        assert tab.card(first).is_visible() and tab.card(second).is_visible()
        with tab.page.expect_download() as download:
            tab.page.get_by_role("button", name="save the file of this blend").click()
        policy = load_policy(download.value.path())
        assert policy.header["blend"]["parents"] == sorted((first, second))
        assert not tab.problems

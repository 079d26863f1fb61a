"""The course of somebody who has read nothing: from a new run to a policy file, by what the page says alone."""

import numpy as np
import pytest

from jmorl.storage.policy_file import load_policy
from tests.studio.browsing import Tab, chromium
from tests.studio.serving import Served

pytestmark = pytest.mark.studio
MOST_ANSWERS = 5
STANDINGS = (
    "your last choice",
    "has replaced your last choice",
    "chosen for you",
    "has replaced what was chosen for you",
)  # which a question begins with


def test_a_policy_to_sign_for_takes_five_answers_at_most(browser_tab):
    """Every text and button below is one that the page shows at that moment, and the only one that is highlighted."""
    tab, page = browser_tab, browser_tab.page

    # What happens here, while the first policies learn.
    page.get_by_text("Policies are trained that trade time and fuel against each other.").wait_for()
    page.get_by_text("Nothing is final: you can go back to any earlier question.").wait_for()
    page.get_by_text("The first policies, still learning. You are asked when the warm-up is over.").wait_for()
    page.get_by_role("button", name="Got it").click()

    # Three policies beside each other, and what choosing one would mean.
    page.get_by_text("Waiting for your answer: question 1 of at most").wait_for()
    page.get_by_text("If you choose A: the search").wait_for()
    for letter in "BC":
        assert page.get_by_role("button", name=f"Choose {letter}").is_visible()
    assert page.get_by_text("Beside A: time").count() == 2
    page.get_by_role("button", name="Choose A").click()

    # Each question begins with what was chosen last, or what has come of it.
    for number in range(2, MOST_ANSWERS):
        page.get_by_text(f"question {number} of at most").wait_for()
        assert page.locator(".place.focus .standing").inner_text() in STANDINGS
        if page.get_by_text("The run is over.").count():
            break
        page.locator(".place.focus .choose").click()

    # The end is asked about once, and says with what.
    over = page.get_by_text("The run is over.").count()
    page.get_by_role("button", name="A is the result" if over else "Stop here").click()
    page.get_by_text("You can step back in the history or train on at any time.").wait_for()
    page.get_by_role("button", name="End with A, policy").click()
    page.get_by_text("The result is policy").wait_for()
    tab.screenshot("17-signed")
    with page.expect_download() as download:
        page.get_by_role("button", name="Save the policy file").click()
    page.get_by_text("Put it beside your program").wait_for()
    policy = load_policy(download.value.path())
    assert np.abs(policy([-0.5, 0.0])).max() <= 1
    assert policy.header["evaluation_episodes"] >= 100  # scores that are confirmed, and no stroke of luck
    assert not tab.problems


@pytest.fixture
def browser_tab(tmp_path):
    """Open the page of a new run on MountainCar, with every setting as it comes."""
    with Served("--env", "mo-mountaincarcontinuous-v0", "--out", tmp_path / "run") as studio, chromium() as browser:
        yield Tab(browser, studio.address)

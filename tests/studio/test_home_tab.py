"""What somebody on the home page sees and can do, without a browser."""

import asyncio
import shutil
from dataclasses import replace

import pytest

from jmorl.storage.resume import branch
from jmorl.studio import home_texts
from jmorl.studio.home import Home
from jmorl.studio.home_tab import HomeTab
from tests.studio.test_form import RIGHT


class Watching:
    """A tab on the home page, with what it has said, how often it was shown, and how often it led to the open run."""

    def __init__(self, session, folder, kept=None):
        self.said, self.shown, self.gone = [], 0, 0
        self.tab = HomeTab(session, Home(folder), self._show, self._say, self._go, kept)

    def _say(self, text, tone):
        self.said.append((tone, text))

    def _show(self):
        self.shown += 1

    def _go(self):
        self.gone += 1


@pytest.fixture
def runs(whole, tmp_path):
    """Copy a run that has ended, and make a branch of it in which a person decides."""
    shutil.copytree(whole, tmp_path / "ended")
    branch(tmp_path / "ended", 2, tmp_path / "yours", user="terminal").folder.close()
    return tmp_path


@pytest.fixture
def nothing_open(make_session):
    return make_session()


@pytest.fixture
def watching(nothing_open, runs):
    watching = Watching(nothing_open, runs)
    asyncio.run(watching.tab.follow())
    return watching


def fill_in(tab, form, **changes):
    tab.fill_in(**{**vars(form), **changes})


def test_runs_are_listed_once_they_are_read_and_kept_while_nothing_changes(nothing_open, runs):
    watching = Watching(nothing_open, runs)
    tab = watching.tab
    assert (tab.runs, watching.shown) == (None, 0)
    asyncio.run(tab.follow())
    listed = tab.runs
    assert [run.name for run in listed] == ["yours", "ended"] and watching.shown == 1
    asyncio.run(tab.follow())
    assert tab.runs is listed


def test_a_run_of_the_list_is_opened_and_gone_to(nothing_open, watching):
    asyncio.run(watching.tab.open("yours"))
    assert nothing_open.question().generation == 3 and watching.gone == 1 and not watching.said
    assert (
        home_texts.open_run(nothing_open.view, "", 0.0)
        == "Open: yours. Waiting for your answer: question 3 of at most 4."
    )
    asyncio.run(watching.tab.follow())
    assert watching.tab.runs[0].state == "interrupted"  # its lock is this session's own
    asyncio.run(watching.tab.open("ended"))
    assert nothing_open.view.result and watching.gone == 2


def test_only_what_is_listed_can_be_opened(nothing_open, watching, runs):
    shutil.copytree(runs / "ended", runs / "since")
    for name in ("../ended", "since", "", str(runs / "ended")):
        asyncio.run(watching.tab.open(name))
    assert not nothing_open.is_open and not watching.gone
    assert {tone for tone, _ in watching.said} == {"warning"} and len(watching.said) == 4


def test_why_a_run_cannot_be_opened_is_told(nothing_open, watching, runs):
    (runs / "yours" / "config.toml").write_text("[")
    asyncio.run(watching.tab.open("yours"))
    assert [tone for tone, _ in watching.said] == ["failure"] and "config.toml" in watching.said[0][1]
    assert not nothing_open.is_open and not watching.gone and not watching.tab.at_work


def test_what_opening_waits_for_is_told(nothing_open, watching):
    asyncio.run(watching.tab.open("yours"))
    nothing_open.question()
    view = nothing_open.view
    assert home_texts.open_run(view, "ended", 0.0) == "Opening ended …"
    training = replace(view, question=None)
    assert home_texts.open_run(training, "ended", 0.0) == "Opening ended, as soon as this round of yours is over …"
    assert home_texts.open_run(None, "ended", 0.0) == "Opening ended …" and home_texts.open_run(None, "", 0.0) == ""


def test_a_new_run_is_begun_and_gone_to(nothing_open, watching, runs):
    fill_in(watching.tab, RIGHT, name="mine")
    asyncio.run(watching.tab.begin())
    assert watching.gone == 1 and nothing_open.view.path == runs / "mine" and not watching.tab.problems
    assert nothing_open.question().generation == 1
    assert watching.tab.kept["form"] == RIGHT  # whose next run has another name


def test_what_is_wrong_with_the_form_stands_beside_it_until_it_is_tried_again(nothing_open, watching, runs):
    before = sorted(runs.iterdir())
    fill_in(watching.tab, RIGHT, seed="x", name="ended")
    asyncio.run(watching.tab.begin())
    told = watching.tab.problems
    assert [problem.partition(":")[0] for problem in told] == ["seed", "folder"]
    assert not watching.said and not watching.gone and not nothing_open.is_open and sorted(runs.iterdir()) == before
    watching.tab.fill_in(name="other")
    asyncio.run(watching.tab.begin())
    assert [problem.partition(":")[0] for problem in watching.tab.problems] == ["seed"]


def test_one_run_at_a_time_is_opened_from_a_tab(nothing_open, watching):
    watching.tab.at_work = True
    asyncio.run(watching.tab.open("yours"))
    asyncio.run(watching.tab.begin())
    assert not nothing_open.is_open and not watching.said and not watching.gone


def test_the_form_outlives_a_reload(nothing_open, runs):
    kept = {}
    Watching(nothing_open, runs, kept).tab.fill_in(seed="5", env="mo-hopper-v5")
    form = Watching(nothing_open, runs, kept).tab.form
    assert (form.seed, form.env) == ("5", "mo-hopper-v5")
    kept["form"] = RIGHT  # whose environment is not there any more
    assert Watching(nothing_open, runs, kept).tab.form.env in Watching(nothing_open, runs).tab.environments


def test_what_is_listed_is_told_in_words(watching):
    yours, ended = (run.facts for run in watching.tab.runs)
    assert home_texts.decider(yours) == "interactive, you decide"
    assert home_texts.decider(ended) == "interactive, user weights=0.5,0.3,0.2"
    assert (home_texts.progress(yours), home_texts.budget(ended)) == ("2 rounds", "2.11 k of 2.11 k steps")
    assert home_texts.branch_of(yours.origin) == "branch of ended after round 2" and home_texts.branch_of(None) == ""
    assert home_texts.result(yours) == "" and home_texts.result(ended).startswith("north −")

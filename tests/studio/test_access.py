"""What somebody who only watches can do: look at everything, and change nothing."""

import asyncio
import inspect

import pytest

from jmorl.decision.answers import Answer, Choose
from jmorl.studio import texts, words
from jmorl.studio.access import Access
from jmorl.studio.home import Home
from jmorl.studio.home_tab import HomeTab
from jmorl.studio.tab import Editing, Ending, Tab

WATCHES = Access(watching=True)
REFUSED = ("hint", words.ONLY_WATCHING)
READ = {
    *("view", "dialogue", "prospects", "clock", "leaving", "opening", "is_open", "held_folders", "open_folder"),
    *("history", "fronts", "score_between", "work_out"),
}


class Unsteered:
    """A session of which one may read alone; what else is asked of it is noted."""

    def __init__(self, session):
        self._session, self.wanted = session, []

    def __getattr__(self, name):
        if name not in READ:
            self.wanted.append(name)
        return getattr(self._session, name)


def commands(kind):
    """Return the names of the commands of a kind of tab."""
    return {name for name, value in vars(kind).items() if inspect.isfunction(value) and not name.startswith("_")}


def give(tab, name, *arguments):
    """Give a tab a command, and wait for it."""
    given = getattr(tab, name)(*arguments)
    if inspect.isawaitable(given):
        asyncio.run(waited_for(given))


async def waited_for(command):
    await command


@pytest.fixture
def question(session):
    return session.question()


def test_a_tab_that_watches_refuses_each_command_that_steers_and_does_the_others(session, question):
    """Every command is in one of the two lists; one that is new has to be put there."""
    said, first, other = [], question.front[0].id, question.front[1].id
    session.begin_dialogue(2, 2)
    dialogue, run = session.dialogue, session.view.run
    only_read = Unsteered(session)
    tab = Tab(only_read, lambda: None, lambda text, tone: said.append((tone, text)), access=WATCHES)
    steering = {
        "choose": (first,),
        "say_equal": (),
        "skip": (),
        "ask_pair": (),
        "keep": (),
        "stop": (),
        "end": (first,),
        "ask_now": (),
        "pause": (),
        "train_on": (2,),
        "answer": (question, Answer(first)),
        "favour": (first,),
        "edit_policy": (first,),
        "edit_run": (session.history()[0],),
        "save_note": ("name", "text"),
        "step_back": (run, 1),
        "switch": (run,),
        "begin_dialogue": (2, 2),
        "reply": (dialogue, Choose(0)),
        "undo_reply": (),
        "close_dialogue": (),
    }
    looking = {
        "score_between": (run, first, other, 50),
        "follow": (),
        "limit": (0, 1.0),
        "do_not_end": (),
        "go_on_for": (2,),
        "look_at": (other,),
        "look_along": (1,),
        "put_away": (other,),
        "more_of": (0,),
        "list_favourites": (True,),
        "stop_editing": (),
        "compare": (),
        "compare_anew": (),
        "compare_with": (run, True),
        "stop_comparing": (),
        "turn_axes": ((1, 0),),
        "turn_to": (words.HISTORY,),
    }
    assert {*steering, *looking} == commands(Tab) and not {*steering} & {*looking}
    tab.ending = Ending(question, (first,))  # as if there were a way to either
    tab.editing = Editing(run, first, "", session.view.noted.policy(first))
    for name, arguments in steering.items():
        said.clear()
        give(tab, name, *arguments)
        assert said == [REFUSED], name
    said.clear()
    for name, arguments in looking.items():
        give(tab, name, *arguments)
    assert REFUSED not in said and only_read.wanted == []
    assert session.view.question is question and session.dialogue is dialogue
    assert not [*session.view.path.glob("decisions.jsonl"), *session.view.path.glob("notes.json")]
    assert tab.axes == (1, 0) and tab.side == words.HISTORY


def test_a_home_page_that_watches_lists_runs_and_opens_and_begins_none(session, question):
    said, went, runs = [], [], session.view.path.parent
    only_read = Unsteered(session)
    tab = HomeTab(
        only_read,
        Home(runs),
        lambda: None,
        lambda text, tone: said.append((tone, text)),
        lambda: went.append(None),
        access=WATCHES,
    )
    steering, looking = {"open": ("run",), "begin": ()}, {"follow": (), "fill_in": ()}
    assert {*steering, *looking} == commands(HomeTab)
    for name in looking:
        give(tab, name)
    assert [run.name for run in tab.runs] == ["run"]
    for name, arguments in steering.items():
        said.clear()
        give(tab, name, *arguments)
        assert said == [REFUSED], name
    assert only_read.wanted == [] and not went and [path.name for path in runs.iterdir()] == ["run"]


def test_a_page_that_watches_is_told_so_in_words(session, question):
    assert "north, east and west" in texts.watched(session.view.objectives)
    assert texts.title(session.view).startswith("Your turn: ")
    assert texts.title(session.view, watching=True) == "run – jmorl studio"

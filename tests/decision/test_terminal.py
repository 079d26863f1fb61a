"""The person at a terminal: every command, every mistake, and what is shown."""

import io
import re
from dataclasses import replace

import numpy as np
import pytest

from envs.core import Objective
from jmorl.decision import enautilus as en
from jmorl.decision.answers import Adjust, Answer, AskPair, Back, Choose, Skip
from jmorl.decision.navigation import run_enautilus
from jmorl.decision.protocol import PointQuestion
from jmorl.decision.terminal import TerminalUser, policy_reply
from jmorl.display.console import PlainConsole
from jmorl.search.prospect import Prospect

# Policies 10, 11, 12 in the tests below.
VALUES = [[-70, -40], [-66.25, -57], [-100, -20]]
LIMIT = "Name an objective (time, fuel) and what it must reach, for example: limit fuel -40; or: limit fuel none"
HAND = np.array([[0, 12], [1, 11], [2, 10], [10, 4], [11, 3], [12, 0]], float)


class Session:
    """A user with prepared input, and what was printed."""

    def __init__(self, *lines: str, width: int = 100):
        self.remaining = list(lines)
        self.prompts: list[str] = []
        self.file = io.StringIO()
        self.user = TerminalUser(PlainConsole(file=self.file, width=width), self.read)

    def read(self, prompt: str) -> str:
        self.prompts.append(prompt)
        assert len(self.prompts) < 10, "asked again and again"
        if not self.remaining:
            raise EOFError
        return self.remaining.pop(0)

    @property
    def output(self) -> str:
        return self.file.getvalue()

    @property
    def sentences(self) -> str:
        """All that was printed as running text."""
        return " ".join(self.output.split())


@pytest.fixture
def point_question(front_of, objectives_of):
    """The second question of a dialogue on `HAND`, two iterations before the end."""

    def make(choices: int = 1) -> PointQuestion:
        state = en.begin(HAND, 3, 2)
        for _ in range(choices):
            state = en.choose(state, en.intermediate_points(state)[0])
        return PointQuestion(5, choices, objectives_of(2), front_of(HAND), state, en.intermediate_points(state))

    return make


@pytest.mark.parametrize(
    ("line", "answer"),
    [
        ("12", Answer(12)),
        ("  12\t", Answer(12)),
        ("", Answer(11)),
        ("go 5", Answer(11, generations=5)),
        ("12 go 5", Answer(12, generations=5)),
        ("12 GO 1", Answer(12, generations=1)),
        ("q", Answer(11, stop=True)),
        ("12 q", Answer(12, stop=True)),
        ("12 10 11", Answer(12, ranking=(12, 10, 11))),
        ("12 10", Answer(12, ranking=(12, 10))),
        ("12 10 11 q", Answer(12, stop=True, ranking=(12, 10, 11))),
        ("12 10 go 3", Answer(12, generations=3, ranking=(12, 10))),
        ("same", Answer(11, equal=True)),
        ("SAME", Answer(11, equal=True)),
    ],
)
def test_commands(ask, line, answer):
    session = Session(line)
    assert session.user.answer(ask(VALUES, previous=11)) == answer
    assert len(session.prompts) == 1


def test_the_end_of_the_input_is_the_same_as_q(ask):
    assert Session().user.answer(ask(VALUES, previous=11)) == Answer(11, stop=True)


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        ("99", "There is no policy 99. You can choose from: 10, 11, 12."),
        ("1" * 5000, "choose a policy by its number, for example 10"),
        ("-1", "I do not understand '-1'; choose a policy by its number"),
        ("12.0", "I do not understand '12.0'"),
        ("[/red]", "I do not understand '[/red]'"),
        ("12 please", "I do not understand '12 please'; ? lists what you can type."),
        ("12 12", "Name each policy once, from the best down."),
        ("12 99 98", "Only the policies shown can be put in order. Not shown: 99, 98."),
        ("12 10 now", "I do not understand '12 10 now'"),
        ("same same", "I do not understand 'same'"),
        ("12 10 go", "Say for how many rounds"),
        ("limit", LIMIT),
        ("limit fuel", LIMIT),
        ("limit 5", LIMIT),
        ("limit speed 5", LIMIT),
        ("limit fuel low", "A limit is a number, or none; 'low' is neither."),
        ("limit fuel nan", "A limit is a number, or none; 'nan' is neither."),
        ("limit fuel inf", "A limit is a number, or none; 'inf' is neither."),
        ("12 q now", "I do not understand '12 q now'"),
        ("q 12", "I do not understand 'q 12'"),
        ("go", "Say for how many rounds to go on, for example: go 5"),
        ("go 0", "Say for how many rounds"),
        ("12 go -3", "Say for how many rounds"),
        ("12 go x", "Say for how many rounds"),
        ("99 go 5", "There is no policy 99"),
        ("best", "Best in what? Name one of the objectives: 1 time, 2 fuel. For example: best time"),
        ("best speed", "Best in what?"),
        ("best 0", "Best in what?"),
        ("best 3", "Best in what?"),
        ("limit fuel <= -45", "fuel label: more is better. So a limit says at least: limit fuel -45"),
        ("if", "Say which policy, for example: if 10"),
        ("if 99", "There is no policy 99"),
        ("if 10 12", "Say which policy"),
        ("pair pair", "I do not understand 'pair'"),
    ],
)
def test_mistakes_are_explained_and_asked_again(ask, line, sentence):
    session = Session(line, "12")
    assert session.user.answer(ask(VALUES, previous=11)) == Answer(12)
    assert sentence in session.sentences
    assert len(session.prompts) == 2
    # The tables are not repeated.
    assert session.output.count("which of these") == 1


@pytest.mark.parametrize("line", ["", "q", "go 5"])
@pytest.mark.parametrize(
    ("previous", "sentence"), [(None, "There is no last choice yet"), (9, "a later policy is better in everything")]
)
def test_without_a_last_choice_in_the_front_one_must_choose(ask, line, previous, sentence):
    session = Session(line, "12")
    assert session.user.answer(ask(VALUES, previous=previous)) == Answer(12)
    assert f"{sentence}; choose a policy by its number, for example 10" in session.sentences


def test_the_input_ending_before_any_choice_is_an_error_not_a_loop(ask):
    with pytest.raises(EOFError, match="nothing is chosen. There is no last choice yet.* Resume the run"):
        Session("what?").user.answer(ask(VALUES))


@pytest.mark.parametrize(("line", "instead"), [("skip", Skip), ("PAIR", AskPair)])
def test_a_question_is_skipped_or_asked_about_a_pair_with_the_limits_so_far(ask, line, instead):
    with pytest.raises(instead) as raised:
        Session("limit fuel -45", line).user.answer(ask(VALUES, previous=11))
    assert raised.value.limits == (-np.inf, -45.0)
    with pytest.raises(instead) as raised:
        Session(line).user.answer(ask(VALUES, previous=11))
    assert raised.value.limits is None


@pytest.mark.parametrize(
    ("line", "changes", "sentence"),
    [
        ("skip", {"purpose": "final"}, "This question has to be answered"),
        ("if 12", {"purpose": "final"}, "The policy that you choose is the result; nothing follows."),
        ("pair", {"again": True}, "With same, what you have just chosen stays."),
        ("pair", {"form": "pair"}, "This question is about two policies already."),
        ("pair", {"front": 2}, "There are no more than two policies."),
    ],
)
def test_what_a_question_does_not_have_is_said(ask, line, changes, sentence):
    question = ask(VALUES[: changes.pop("front", 3)], previous=11)
    session = Session(line, "11")
    assert session.user.answer(replace(question, **changes)).policy == 11
    assert sentence in session.sentences


def test_what_a_choice_would_mean(ask):
    expected = np.array([[-55.0, -52.0], [-90.0, -60.0]])  # the second is worse than what is there

    def prospect(policy):
        kept = np.array([policy.id == 12, True, True])
        return Prospect(np.array([-65.0, -np.inf]), kept, expected, odds=0.42)

    session = Session("if 11", "if 12", "12")
    session.user.answer(replace(ask(VALUES), prospect=prospect))
    said = " ".join(session.output.split())
    assert "If you choose policy 11: the search narrows to time label ≥ −65.0, with 2 of 3 policies." in said
    assert "If you choose policy 12: the search goes on around all 3 policies." in said
    assert "It may find time label −55.0, fuel label −52.0. 4 of 10 such forecasts come true." in said
    session = Session("if 12", "12")
    session.user.answer(ask(VALUES))  # a choice that changes nothing
    assert "If you choose policy 12, the search goes on as before." in session.output


def test_before_the_first_question_one_is_told_what_happens(ask):
    told = "Policies are trained that trade time label and fuel label against each other."
    for generation, said in ((1, True), (2, False)):
        session = Session("all", "12", "12")
        session.user.answer(ask(VALUES, generation=generation))
        session.user.answer(ask(VALUES, generation=generation))  # about a pair, say
        assert session.sentences.count(told) == said


def test_numbers_may_be_written_as_people_write_them(ask):
    question = ask([[-70, -40], [-60, -50], [-50, -60]])
    for line in ("12, 10, 11", "12 > 10 > 11", "12 10 11"):
        assert policy_reply(question, line) == Answer(12, ranking=(12, 10, 11))
    for line in ("limit 2 −45", "limit fuel >= -45", "limit fuel>-45", "limit fuel ≥ -45,0"):
        assert policy_reply(question, line) == (-np.inf, -45.0)


def test_undecodable_input_gets_the_help(ask):
    session = Session()

    def read(prompt: str) -> str:
        session.prompts.append(prompt)
        return b"\xff".decode() if len(session.prompts) == 1 else "12"

    assert TerminalUser(session.user.console, read).answer(ask(VALUES)) == Answer(12)
    assert "keep the last choice" in session.output


@pytest.mark.parametrize("line", ["?", "help"])
def test_help(ask, line):
    session = Session(line, "10", width=79)
    session.user.answer(ask(VALUES))
    for text in (
        "  12           choose policy 12\n",
        "  Enter        keep the last choice, while it is in the front: none is better\n",
        "  12 4 9       prefer policy 12, then 4, then 9, to all others\n",
        "  same         no difference between these\n",
        "  limit fuel -40\n               rule out what does not reach this; none takes it back\n",
        "  best fuel    list the policies that are best in an objective first\n",
        "  12 go 5      choose policy 12, then no question for 5 rounds (or go 5)\n",
        "  12 q         choose policy 12 and end (q or Ctrl-D: with the last choice)\n",
    ):
        assert text in session.output


def tables_shown(session: Session) -> list[list[str]]:
    """The rows of each table, from top to bottom."""
    tables: list[list[str]] = []
    rows: list[str] | None = None
    for line in session.output.splitlines():
        if line.startswith("───"):
            tables.append(rows := [])
        elif rows is not None and line.split()[:1] and line.split()[0].isdecimal():
            rows.append(line)
        else:
            rows = None
    return tables


def order_shown(session: Session) -> list[list[str]]:
    """The policies of each table, from top to bottom."""
    return [[row.split()[0] for row in rows] for rows in tables_shown(session)]


@pytest.mark.parametrize("line", ["best fuel", "best 2", "best f", "best FUEL LABEL"])
def test_best_lists_the_front_by_that_objective(ask, line):
    session = Session(line, "10")
    session.user.answer(ask(VALUES))
    assert order_shown(session) == [["11", "10", "12"], ["12", "10", "11"]]


def test_all_lists_the_policies_that_a_short_question_leaves_out(ask):
    question = ask(VALUES)
    short = replace(question, front=question.front[:2], others=question.front[2:])
    session = Session("all", "12")
    assert session.user.answer(short) == Answer(12)
    before, after = session.output.split("12 ", 1)[0], session.output
    assert "Type all to see 1 more." in before and "-20.0" not in before and "-20.0" in after
    assert Session("12").user.answer(short) == Answer(12)


def test_only_what_is_shown_can_be_ranked_until_all_are(ask):
    question = ask(VALUES)
    short = replace(question, front=question.front[:2], others=question.front[2:])
    session = Session("12 10", "all", "12 10")
    assert session.user.answer(short) == Answer(12, ranking=(12, 10))
    assert session.sentences.count("Only the policies shown can be put in order. Not shown: 12.") == 1


@pytest.mark.parametrize("previous", [None, 9])
def test_no_difference_without_a_last_choice_in_the_front_goes_on_with_one_of_those_shown(ask, previous):
    answer = Session("same").user.answer(ask(VALUES, previous=previous))
    assert answer.equal and answer.policy in (10, 11, 12)


@pytest.mark.parametrize("line", ["limit fuel -45", "limit 2 -45", "LIMIT Fuel Label -45.0", "limit f -4.5e1"])
def test_a_limit_marks_what_does_not_reach_it_and_goes_with_the_answer(ask, line):
    session = Session(line, "10")
    assert session.user.answer(ask(VALUES, previous=11)) == Answer(10, limits=(-np.inf, -45.0))
    before, after = ({row.split()[0]: row for row in rows} for rows in tables_shown(session))
    assert "beyond your limits" not in " ".join(before.values())
    assert {policy for policy, row in after.items() if "beyond your limits" in row} == {"11"}


def test_limits_of_several_objectives_add_up_and_one_can_be_taken_back(ask):
    session = Session("limit time -80", "limit fuel -45", "limit time none", "12 10")
    assert session.user.answer(ask(VALUES)) == Answer(12, ranking=(12, 10), limits=(-np.inf, -45.0))
    assert [["beyond" in row for row in sorted(rows)] for rows in tables_shown(session)] == [
        [False, False, False],
        [False, False, True],
        [False, True, True],
        [False, True, False],
    ]


def test_limits_that_hold_already_are_shown_and_only_a_change_is_in_the_answer(ask):
    question = replace(ask(VALUES), limits=(-np.inf, -45.0))
    session = Session("10")
    assert session.user.answer(question) == Answer(10)
    assert ["beyond" in row for row in sorted(*tables_shown(session))] == [False, True, False]
    assert Session("limit fuel -45", "10").user.answer(question) == Answer(10)
    assert Session("limit fuel none", "10").user.answer(question) == Answer(10, limits=(-np.inf, -np.inf))
    assert Session("limit time -80", "10").user.answer(question) == Answer(10, limits=(-80.0, -45.0))


def test_a_limit_survives_a_look_at_all_policies(ask):
    question = ask(VALUES)
    short = replace(question, front=question.front[:2], others=question.front[2:])
    session = Session("limit time -80", "all", "10")
    assert session.user.answer(short) == Answer(10, limits=(-80.0, -np.inf))
    assert ["beyond" in row for row in sorted(tables_shown(session)[-1])] == [False, False, True]


@pytest.mark.parametrize(
    ("purpose", "form", "again", "heading"),
    [
        ("steer", "pair", False, "Round 4. Which one of these two policies do you prefer?"),
        ("final", "pair", False, "The run is over. Which one of these two policies do you prefer?"),
        ("steer", "rank", False, "Round 4. In which order do you prefer these 2 policies?"),
        ("steer", "best", True, "Round 4. Your earlier answers speak for the other one of these two. Which one"),
        ("final", "best", True, "The run is over. Your earlier answers speak for the other one of these two."),
    ],
)
def test_the_heading_says_what_is_asked(ask, purpose, form, again, heading):
    session = Session("10")
    session.user.answer(replace(ask(VALUES[:2], purpose=purpose, generation=4), form=form, again=again))
    assert heading in session.sentences


def test_an_ambiguous_objective_is_asked_for_again(ask):
    question = ask([[1, 2], [2, 1]])
    objectives = (Objective("speed x", "speed x", "m"), Objective("speed y", "speed y", "m"))
    session = Session("best speed", "best speed y", "10")
    session.user.answer(type(question)("steer", 1, objectives, question.front, question.bounds, None))
    assert "Best in what? Name one of the objectives: 1 speed x, 2 speed y" in session.sentences
    assert order_shown(session) == [["11", "10"], ["10", "11"]]


def test_what_the_question_shows(ask):
    session = Session("10")
    session.user.answer(ask(VALUES, generation=4, previous=11, bounds=[-90, -60]))
    assert "Round 4: which of these 3 policies do you prefer?" in session.output
    for text in ("time label", "(time unit)", "fuel label", "(fuel unit)"):
        assert text in session.output
    [table] = tables_shown(session)
    rows = {row.split()[0]: row for row in table}
    assert rows["11"].split() == ["11", "-66.2", "±0.5", "-57.0", "±0.5", "0.5", "0.5", "1", "last", "choice"]
    assert "outside the bounds" in rows["12"] and "outside" not in rows["10"]
    assert "x: your last choice" in session.output
    assert all(len(line) <= 100 for line in session.output.splitlines())


def test_the_plot_puts_policies_where_they_are(ask):
    session = Session("10")
    session.user.answer(ask([[0, 10], [10, 0]], previous=11))
    plot = session.output[session.output.index("(fuel label)") :]
    rows = [line for line in plot.splitlines() if "|" in line and "-|-" not in line]
    (high,) = (line for line in rows if " o " in line)
    (low,) = (line for line in rows if " x " in line)
    assert rows.index(high) < rows.index(low) and high.index("o") < low.index("x")
    assert plot.split("o: a policy")[0].isascii()


def test_other_numbers_of_objectives_have_a_table_and_no_plot(ask):
    for values in ([[1], [2]], [[1, 2, 3], [3, 2, 1]], [[1, 2, 3, 4], [4, 3, 2, 1]]):
        session = Session("11")
        assert session.user.answer(ask(values)) == Answer(11)
        assert "o: a policy" not in session.output


def test_nothing_is_cut_off_in_a_narrow_terminal(ask):
    session = Session("10", width=40)
    session.user.answer(ask([[1.25, 2.5, 3.75], [3.5, 2.25, 1.5]]))
    assert "…" not in session.output and max(map(len, session.output.splitlines())) <= 40
    numbers = {float(word) for word in session.output.split() if re.fullmatch(r"\d+\.\d+", word)}
    assert {1.25, 2.5, 3.75, 3.5, 2.25, 1.5} <= numbers


@pytest.mark.parametrize("values", [[[5, 5]], [[5, 5], [5, 5]], [[0, 0]], [[1e-9, 1e12], [2e-9, 1e12]]])
@pytest.mark.parametrize("width", [20, 80, 200])
def test_fronts_without_range_and_odd_widths_can_be_shown(ask, values, width):
    session = Session("10", width=width)
    assert session.user.answer(ask(values)) == Answer(10)


def test_values_that_differ_look_different(ask):
    session = Session("10")
    session.user.answer(ask([[1000.0, 0.001], [1000.5, 0.0005]]))
    for text in ("1000.000 ", "1000.500 ", "0.001000 ", "0.000500 "):
        assert text in session.output


def test_the_final_question(ask):
    session = Session("go 5", "12 go 5", "12")
    assert session.user.answer(ask(VALUES, purpose="final", previous=11)) == Answer(12)
    assert "The run is over. Which of these 3 policies is its result?" in session.output
    assert session.sentences.count("The run has no rounds left to go on for") == 2
    assert Session("").user.answer(ask(VALUES, purpose="final", previous=11)) == Answer(11)


@pytest.mark.parametrize(
    ("line", "answer"),
    [
        ("1", Choose(0)),
        (" 2 ", Choose(1)),
        ("back", Back(1)),
        ("back 2", Back(2)),
        ("iterations 4", Adjust(4, 2)),
        ("points 5", Adjust(1, 5)),
        ("POINTS 5", Adjust(1, 5)),
        ("q", Adjust(0, 2)),
    ],
)
def test_point_commands(point_question, line, answer):
    session = Session(line)
    question = point_question(choices=2)
    assert question.state.iterations_left == 1
    assert session.user.choose_point(question) == answer
    assert len(session.prompts) == 1


def test_the_end_of_the_input_ends_the_dialogue_here(point_question):
    assert Session().user.choose_point(point_question()) == Adjust(0, 2)


@pytest.mark.parametrize(
    ("choices", "line", "sentence"),
    [
        (1, "", "Choose a point by its number, 1 to 2; ? lists what else you can type."),
        (1, "0", "Choose a point by its number, 1 to 2"),
        (1, "3", "Choose a point by its number, 1 to 2"),
        (1, "1 2", "Choose a point by its number"),
        (1, "[bold]", "Choose a point by its number"),
        (0, "back", "You are at the start; there is nothing to undo."),
        (0, "back 1", "You are at the start"),
        (2, "back 3", "You can go back by 1 to 2, for example: back 2"),
        (2, "back 0", "You can go back by 1 to 2"),
        (2, "back x", "You can go back by 1 to 2"),
        (2, "back 1 2", "You can go back by 1 to 2"),
        (1, "iterations", "Say how many iterations, at least 1, for example: iterations 4"),
        (1, "iterations 0", "Say how many iterations, at least 1"),
        (1, "points -2", "Say how many points, at least 1, for example: points 4"),
        (1, "points " + "9" * 5000, "Say how many points"),
    ],
)
def test_point_mistakes_are_explained_and_asked_again(point_question, choices, line, sentence):
    session = Session(line, "1")
    assert session.user.choose_point(point_question(choices)) == Choose(0)
    assert sentence in session.sentences
    assert len(session.prompts) == 2


def test_point_help(point_question):
    session = Session("?", "1")
    session.user.choose_point(point_question())
    for text in ("move to point 2", "undo the last choice", "iterations 4", "points 5", "Ctrl-D"):
        assert text in session.output


def test_what_a_question_about_points_shows(point_question):
    session = Session("1")
    question = point_question(choices=0)
    session.user.choose_point(question)
    assert "E-NAUTILUS, 3 iterations left, 6 of 6 policies reachable. Which point do you prefer?" in session.output
    [[first, second]] = tables_shown(session)
    # A third of the way from (0, 0) to (11, 3): neither (12, 0) nor the cluster on the left is as good everywhere.
    assert first.split() == ["1", "3.7", "to", "11.0", "1.0", "to", "4.0", "33", "%", "2", "14", "(11.0,", "3.0)"]
    assert second.split()[0] == "2" and "11 (1.0, 11.0)" in second
    assert "+: you are here" in session.output
    assert Session("1").user.choose_point(point_question(choices=2)) == Choose(0)


def test_a_whole_dialogue(front_of, objectives_of):
    session = Session("1", "back", "points 3", "3", "2", "1")
    chosen = run_enautilus(front_of(HAND), objectives_of(2), session.user.choose_point, 2, 2, 1)
    assert chosen.id in (10, 11, 12)
    assert session.output.count("2 iterations left") == 3


def test_a_front_of_one_policy_is_no_choice_among_policies(ask):
    session = Session("10")
    session.user.answer(ask([[1, 2]], generation=4))
    assert "Round 4: do you go on with this policy?" in session.output
    session = Session("10")
    session.user.answer(ask([[1, 2]], purpose="final"))
    assert "The run is over. Is this policy its result?" in session.output

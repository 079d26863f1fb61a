"""Decision makers by name: what each name makes, and a sentence for everything that is wrong with one."""

import subprocess
import sys

import numpy as np
import pytest

from jmorl.decision.scripted import ScriptedUser
from jmorl.decision.target import TargetUser
from jmorl.decision.terminal import TerminalUser
from jmorl.decision.users import make_user, parse_user

VALUES = np.array([[3.0, 1.0], [2.0, 2.5], [0.0, 9.0]])


@pytest.mark.parametrize(
    ("spec", "utilities"),
    [
        ("A", [2, 2.25, 4.5]),
        ("B", [2.4, 2.15, 2.7]),
        ("C", [1.6, 2.35, 6.3]),
        (" A ", [2, 2.25, 4.5]),
        ("weights=0.5,0.5", [2, 2.25, 4.5]),
        ("weights=3,1", [2.5, 2.125, 2.25]),
        ("weights=0, 2.0", [1, 2.5, 9]),
        ("weights=1,1,chebyshev=4,10", [-4.5, -3.75, -2]),
        ("weights=0,1,chebyshev=4,10", [-9, -7.5, -1]),
        ("weights=1,0,concave=0,0,3,9", [np.log(6), np.log(1 + 10 / 3), 0]),
        ("weights=1,0,limits=none,2", [3 - 1000, 2, 0]),
        ("A,random=0.2", [2, 2.25, 4.5]),
        ("weights=3,1,before=0,1,until=4", [2.5, 2.125, 2.25]),
    ],
)
def test_users_with_a_utility(objectives_of, spec, utilities):
    np.testing.assert_allclose(make_user(spec, objectives_of(2)).utility(VALUES), utilities)


def test_three_weights_are_normalised(objectives_of):
    utility = make_user("weights=2,1,1", objectives_of(3)).utility(np.array([[1.0, 2.0, 6.0]]))
    np.testing.assert_allclose(utility, [2.5])


def test_chebyshev_without_a_utopian_point_reports_no_utility(ask, objectives_of):
    user = make_user("weights=1,1,chebyshev", objectives_of(2))
    assert user.utility(VALUES) is None
    # Distances to the ideal (3, 9), halved: 4, 3.25, 1.5.
    assert user.answer(ask(VALUES)).policy == 12


def test_one_answer_in_five_is_any_and_the_same_question_has_the_same_answer(ask, objectives_of):
    user = make_user("weights=1,0,random=0.2", objectives_of(2))
    generator = np.random.default_rng(0)
    questions = [ask(generator.normal(size=(10, 2)), generation=3) for _ in range(500)]
    answers = [user.answer(question).policy for question in questions]
    assert answers == [user.answer(question).policy for question in questions]
    wrong = [answer != 10 + each.values[:, 0].argmax() for answer, each in zip(answers, questions, strict=True)]
    assert 0.13 < np.mean(wrong) < 0.24  # nine in ten of a fifth


def test_small_differences_are_mistaken_more_often(ask, objectives_of):
    user = make_user("weights=1,0,temperature=0.05", objectives_of(2))
    generator = np.random.default_rng(0)

    def mistakes(behind: float) -> float:
        fronts = [np.array([[1.0, each], [1 - behind, 0.0], [0.0, 0.0]]) for each in generator.normal(size=300)]
        return float(np.mean([user.answer(ask(front)).policy != 10 for front in fronts]))

    # Bradley and Terry: 1 / (1 + exp(difference / temperature)).
    assert mistakes(0.05) == pytest.approx(1 / (1 + np.e), abs=0.08)
    assert mistakes(0.5) < 0.01


def test_a_mind_may_change(ask, objectives_of):
    user = make_user("weights=0,1,before=1,0,until=4", objectives_of(2))
    assert [user.answer(ask(VALUES, generation=each)).policy for each in (1, 3, 4, 9)] == [10, 10, 12, 12]


def test_limits_are_told_and_kept_to(ask, objectives_of):
    user = make_user("weights=1,0,limits=none,2", objectives_of(2))
    answer = user.answer(ask(VALUES))
    assert answer.policy == 11 and answer.limits == (-np.inf, 2.0)


def test_targets(objectives_of):
    user = make_user("target=-80,-42", objectives_of(2))
    assert isinstance(user, TargetUser) and user.target.tolist() == [-80, -42] and user.scaled
    unscaled = make_user("target=-80, 4.2e1,unscaled", objectives_of(2))
    assert isinstance(unscaled, TargetUser) and unscaled.target.tolist() == [-80, 42] and not unscaled.scaled


def test_terminal_and_script(objectives_of, tmp_path):
    assert isinstance(make_user("terminal", objectives_of(3)), TerminalUser)
    log = tmp_path / "a=b,c.jsonl"
    log.write_text("")
    user = make_user(f"script={log}", objectives_of(3))
    assert isinstance(user, ScriptedUser) and user.path == log


def test_no_limit_may_be_written_as_one_likes(objectives_of):
    user = make_user("A,limits=None,-45", objectives_of(2))
    assert user.utility(np.array([[-900.0, -45.0], [-1.0, -45.5]])).argmax() == 0


@pytest.mark.parametrize("spec", ["A", "weights=1,2,3", "weights=1,2,chebyshev", "target=1", "terminal"])
def test_without_a_known_number_of_objectives_any_number_passes(spec):
    assert callable(parse_user(spec, None))


@pytest.mark.parametrize(
    ("spec", "objectives", "problem"),
    [
        ("D", 2, "unknown user 'D'; known: A, B, C or weights=W1.*random=SHARE.*; target=.*; terminal; script=FILE"),
        ("", 2, "unknown user ''"),
        ("a", 2, "unknown user 'a'"),
        ("A=1", 2, "unknown user 'A=1'"),
        ("weights", 2, "user weights has no value; write weights=W1,W2,..."),
        ("target", 2, "user target has no value; write target=Z1,Z2,..."),
        ("terminal=1", 2, "unknown user 'terminal=1'"),
        ("A", 3, "user A has weights for two objectives, but there are 3; write weights=W1,W2"),
        ("weights=1,2,3", 2, "weights must have one number for each of 2 objectives, not 3: 1,2,3"),
        ("weights=1", 2, "weights must have one number for each of 2 objectives, not 1: 1"),
        ("weights=", None, "user weights has no value"),
        ("weights=1,x", None, "but 'x' is none"),
        ("weights=0.5;0.5", None, "but '0.5;0.5' is none"),
        ("weights=1,nan", None, "weights must be finite numbers, but 'nan' is not"),
        ("weights=1,inf", None, "weights must be finite numbers"),
        ("weights=1,-0.5", None, "weights must not be negative: 1,-0.5"),
        ("weights=0,0", None, "weights must have a finite sum above zero: 0,0"),
        ("weights=1e308,1e308", None, "weights must have a finite sum above zero"),
        ("weights=1,2,euclid", 2, "but 'euclid' is none"),
        ("weights=1,2,chebyshevy", 2, "weights must be numbers separated by commas, but 'chebyshevy' is none"),
        ("weights=1,2,chebyshev=", 2, "chebyshev must be numbers"),
        ("weights=1,2,chebyshev=1", None, "chebyshev must have one number for each of 2 objectives, not 1: 1"),
        ("weights=1,2,concave", 2, "concave has no value; write concave=WORST1,"),
        ("weights=1,2,concave=1,2", 2, "concave needs two numbers for each of 2 objectives, concave=WORST1,"),
        ("weights=1,2,concave=1,2,0,3", 2, "concave has the worst value of each objective first, then better ones"),
        ("weights=1,2,concave=1,2,3,4,chebyshev", 2, "either chebyshev or concave"),
        ("weights=1,2,limits=3", 2, "limits must have a number or none for each of 2 objectives, not 1: 3"),
        ("weights=1,2,limits=3,nothing", 2, "limits must be numbers separated by commas, but 'nothing' is none"),
        ("A,random=0.2,0.3", 2, "random must be one number, not '0.2,0.3'"),
        ("A,temperature=abc", 2, "temperature must be one number, not 'abc'"),
        ("A,before=1,0,until=0", 2, "until=GENERATION, a whole number from 1"),
        ("weights=-1,2,random=2,until=x", 2, "not be negative.*; random must be.*; until must be one number"),
        ("A,random=2", 2, "random must be from 0 to 1, not 2"),
        ("A,temperature=-1", 2, "temperature must be at least 0, not -1"),
        ("A,before=1,2", 2, "needs before=W1,W2,... and until=GENERATION"),
        ("A,until=3", 2, "needs before=W1,W2,... and until=GENERATION"),
        ("A,before=1,2,until=2.5", 2, "a whole number"),
        ("A,randon=0.2", 2, "a user has no option 'randon'; .*; did you mean 'random'"),
        ("A,random=0.2,random=0.3", 2, "random is given twice"),
        ("target=1,2,3", 2, "target must have one number for each of 2 objectives, not 3: 1,2,3"),
        ("target=1,nan", 2, "target must be finite numbers, but 'nan' is not"),
        ("target=1,", None, "target must be numbers separated by commas, but '' is none"),
        ("target=1,2,unscaled,3", None, "nothing may follow 'unscaled' in a target, but ',3' does"),
    ],
)
def test_problems(spec, objectives, problem):
    with pytest.raises(ValueError, match=problem):
        parse_user(spec, objectives)


@pytest.mark.parametrize(
    ("value", "problem"),
    [
        ("nowhere.jsonl", "there is no decision log 'nowhere.jsonl': .*/nowhere.jsonl is not a file"),
        ("/", "there is no decision log '/': / is not a file"),
    ],
)
def test_a_script_is_looked_for_when_somebody_is_to_be_asked(objectives_of, value, problem):
    assert callable(parse_user(f"script={value}", 2))
    with pytest.raises(ValueError, match=problem):
        make_user(f"script={value}", objectives_of(2))


def test_naming_users_loads_neither_plots_nor_clustering():
    heavy = "{'plotille', 'scipy.cluster', 'jmorl.decision.terminal', 'jmorl.decision.scripted'}"
    code = f"import sys, jmorl.decision.users; print(sorted({heavy} & set(sys.modules)))"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert loaded.stdout.strip() == "[]"


def test_a_home_folder_that_there_is_none_of_is_no_traceback():
    with pytest.raises(ValueError, match="there is no decision log '~nobody-of-this-name/x'"):
        make_user("script=~nobody-of-this-name/x", ())

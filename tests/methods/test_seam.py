"""A method of one's own: a class and a registration, and everything else works with it."""

import ast
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from jmorl import Decided, DecisionMaker, GenerationFinished, Method, MethodError, PairQuestion, WeightQuestion, run
from jmorl.config import ConfigError
from jmorl.decision.answers import Answer, AnswerError
from jmorl.decision.scripted import ScriptedUser
from jmorl.methods import registry
from jmorl.methods.pgmorl import PGMORL
from tests.resuming import go_on, outcome, train

JMORL = Path(__file__).parents[2] / "jmorl"


class Duels(PGMORL):
    """PGMORL that asks for weights once and for two comparisons before every generation, and counts them."""

    def question(self, run):
        asked = run.search.silent_generations
        if not run.questions:
            return WeightQuestion(run.generation + 1, self.problem.objectives, run.archive.members)
        members = run.archive.members
        if asked < 2 and len(members) > 1:
            return PairQuestion(run.generation + 1, self.problem.objectives, (members[asked], members[-1]))
        return None

    def answered(self, run, question, answer):
        more = isinstance(question, PairQuestion)
        return replace(run.search, silent_generations=run.search.silent_generations + more)

    def taken_in(self, run, offspring, tasks):
        return replace(super().taken_in(run, offspring, tasks), silent_generations=0)


registry.register_method("duels", Duels)


class Judge(DecisionMaker):
    """Prefers what is best in the first objective."""

    def __init__(self):
        self.asked = []

    def respond(self, question):
        self.asked.append(question)
        return super().respond(question)

    def answer(self, question):
        return Answer(question.front[int(np.argmax(question.values[:, 0]))].id)

    def weigh(self, question):
        return [3, 1, 0]


@pytest.fixture(scope="module")
def config(small_config):
    return small_config.replace(method="duels")


def test_questions_of_other_kinds_are_asked_answered_and_counted(config):
    judge = Judge()
    events = list(run(config, judge))
    decided = [event for event in events if isinstance(event, Decided)]
    assert isinstance(decided[0].question, WeightQuestion) and decided[0].answer == (0.75, 0.25, 0.0)
    pairs = [(event, event.question) for event in decided if isinstance(event.question, PairQuestion)]
    assert len(pairs) >= 2
    for event, question in pairs:
        preferred = max(question.pair, key=lambda policy: policy.values[0])
        assert event.answer == preferred.id and event.chosen is None
    assert events[-1].state.questions == len(judge.asked) == len(decided)
    assert events[-1].state.policies_shown == sum(len(event.question.shown) for event in decided)


def test_a_run_with_them_is_resumed_replayed_and_its_questions_are_not_asked_again(config, tmp_path):
    whole = train(tmp_path / "whole", config, user=Judge())
    path = train(tmp_path / "interrupted", config, user=Judge(), events=4)  # after a checkpoint and two answers
    again = Judge()
    go_on(path, user=again)
    assert outcome(path) == outcome(whole)
    assert not any(isinstance(question, WeightQuestion) for question in again.asked)
    replayed = [event for event in run(config, ScriptedUser(whole / "decisions.jsonl")) if isinstance(event, Decided)]
    assert [event.answer for event in replayed if event.chosen is None]


def test_a_user_who_cannot_weigh_says_so(config):
    class Plain(DecisionMaker):
        def answer(self, question):
            return Answer(question.front[0].id)

    with pytest.raises(AnswerError, match="Plain cannot say how much each objective matters"):
        list(run(config, Plain()))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda tasks: None, "tasks must return jmorl.Tasks, not None"),
        (lambda tasks: replace(tasks, parents=tasks.parents[1:]), "a policy for each of 4 agents"),
        (lambda tasks: replace(tasks, parents=[0, 1, 2, 3]), "a policy for each of 4 agents"),
        (lambda tasks: replace(tasks, weights=tasks.weights[:, :2]), r"weights of tasks must be .* \(4, 3\)"),
        (lambda tasks: replace(tasks, weights=np.full((4, 3), np.nan)), "weights of tasks must be finite"),
        (lambda tasks: replace(tasks, weights=np.zeros((4, 3))), "must not be negative, and not all zero"),
        (lambda tasks: replace(tasks, weights="even"), "weights of tasks must be finite"),
        (lambda tasks: replace(tasks, predicted=[1.0]), "predicted of tasks must be finite"),
    ],
)
def test_tasks_that_cannot_be_trained_are_named(monkeypatch, small_config, change, message):
    tasks = PGMORL.tasks
    monkeypatch.setattr(PGMORL, "tasks", lambda method, run: change(tasks(method, run)))
    with pytest.raises(MethodError, match=message):
        list(run(small_config))


def test_weights_may_be_a_list(monkeypatch, small_config):
    tasks = PGMORL.tasks
    monkeypatch.setattr(
        PGMORL, "tasks", lambda method, run: replace(tasks(method, run), weights=tasks(method, run).weights.tolist())
    )
    assert list(run(small_config.replace(steps=4 * 3 * 16 * 3)))


def test_a_method_that_is_not_whole_is_not_registered():
    class Half(Method):
        def tasks(self, run):
            return None

    with pytest.raises(ValueError, match="method 'half' lacks initial_state, pack, taken_in, unpack"):
        registry.register_method("half", Half)
    with pytest.raises(ValueError, match="'half' must be a subclass of jmorl.Method, not 3"):
        registry.register_method("half", 3)


def test_an_unknown_method_is_refused_and_the_nearest_is_named(small_config):
    with pytest.raises(ConfigError, match="unknown method 'interactiv'; known: .*did you mean 'interactive'"):
        small_config.replace(method="interactiv")
    with pytest.raises(ConfigError, match="cannot import 'no_such_module'"):
        small_config.replace(method="no_such_module:mine")


def test_a_method_in_a_module_of_ones_own_is_found(small_config):
    config = small_config.replace(method="tests.methods.test_seam:duels", steps=4 * 3 * 16 * 3)
    assert [event for event in run(config, Judge()) if isinstance(event, GenerationFinished)]


def test_two_methods_cannot_have_one_name():
    with pytest.raises(ValueError, match="'duels' is already registered"):
        registry.register_method("duels", PGMORL)


def test_a_newcomers_method_is_a_short_file():
    assert len((JMORL / "methods" / "fixed.py").read_text().splitlines()) < 120


def test_nobody_asks_which_method_it_is():
    """Outside the methods, the method's name is shown or stored; it is never compared."""
    for path in JMORL.rglob("*.py"):
        if "methods" in path.parts or "paper" in path.parts:
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Compare):
                assert not any("method" in ast.unparse(side) for side in (node.left, *node.comparators)), path

"""A run from warm-up to final choice: its order, its accounts, its bounds, for every method, with three objectives."""

import hashlib
import os
import subprocess
import sys

import jax
import numpy as np
import pytest

from jmorl.config import resolve
from jmorl.decision.answers import Answer
from jmorl.decision.protocol import DecisionMaker
from jmorl.decision.utility import UtilityUser
from jmorl.events import Compiled, Decided, GenerationFinished, RunFinished
from jmorl.learning.population import Population, TrainingFault
from jmorl.loop import run
from jmorl.search.bounds import lower_bounds, within
from jmorl.search.policy import values_of
from tests.probes import Faulty, Onwards, ThreeWays


class Recorder(DecisionMaker):
    """Answers with the n-th shown policy, or as told, and keeps the questions."""

    def __init__(self, index=0, **answer):
        self.index, self.answer_fields, self.questions = index, answer, []
        self.satisfied_after = np.inf

    def answer(self, question):
        self.questions.append(question)
        chosen = question.front[min(self.index, len(question.front) - 1)]
        return Answer(chosen.id, **(self.answer_fields if question.purpose == "steer" else {}))

    def satisfied(self, values):
        self.satisfied_after -= 1
        return self.satisfied_after < 0


def digest(events):
    """A hash of everything a run produced, times apart."""
    sha = hashlib.sha256()
    for event in events:
        if isinstance(event, GenerationFinished):
            for policy in event.offspring:
                for leaf in jax.tree.leaves((policy.values, policy.weights, policy.snapshot)):
                    sha.update(np.asarray(leaf).tobytes())
        if isinstance(event, Decided):
            sha.update(str(event.answer).encode())
    return sha.hexdigest()


@pytest.fixture(scope="module")
def interactive(small_config):
    user = Recorder(index=1)
    return user, list(run(small_config, user))


def generations(events):
    return [event for event in events if isinstance(event, GenerationFinished)]


def test_events_come_in_the_papers_order(interactive):
    kinds = [type(event) for event in interactive[1]]
    assert kinds == [Compiled, GenerationFinished, *[Decided, GenerationFinished] * 3, Decided, RunFinished]


def test_who_looks_in_early_sees_the_agents_on_their_way_and_changes_nothing(small_config, interactive):
    seen = []
    config = small_config.replace(population={"warmup_iterations": 8})
    events = list(run(config, Recorder(index=1), early=seen.append))
    [agents] = seen
    assert digest(events) == digest(run(config, Recorder(index=1)))
    short = config.replace(population={"warmup_iterations": 1})
    for agent, policy in zip(agents, generations(run(short, Recorder(index=1)))[0].offspring, strict=True):
        assert agent.id == policy.id and agent.generation == 0
        np.testing.assert_array_equal(agent.values, policy.values)
    # In paper units every evaluation moves the units.
    seen.clear()
    list(run(small_config.replace(evaluation={"units": "paper"}), Recorder(), early=seen.append))
    assert not seen


def test_steps_are_counted(interactive):
    assert [event.steps for event in generations(interactive[1])] == [4 * 3 * 16 * done for done in (2, 5, 8, 11)]
    evaluated = [event.state.evaluation_steps for event in generations(interactive[1])]
    assert evaluated == [4 * 2 * 10 * done for done in (1, 2, 3, 4)]
    assert interactive[1][-1].state.questions == 4


def test_a_generation_starts_while_iterations_are_left(small_config):
    for steps, expected in ((4 * 3 * 16 * 3, 1), (4 * 3 * 16 * 5, 1), (4 * 3 * 16 * 5 + 1, 1), (4 * 3 * 16 * 6, 2)):
        events = list(run(small_config.replace(steps=steps, method="pgmorl"), Recorder()))
        assert events[-1].state.generation == expected


def test_bounds_follow_the_choice(interactive, small_config):
    events = interactive[1]
    for before, decided, after in zip(events[1:-3:2], events[2:-2:2], events[3:-1:2], strict=True):
        unit = np.ptp(before.state.archive.values, axis=0)
        expected = lower_bounds(decided.chosen.values, small_config.search.delta, unit)
        np.testing.assert_array_equal(after.bounds, expected)
        assert (after.bounds <= decided.chosen.values).all()


def test_parents_are_the_choice_or_lie_within_the_bounds(interactive):
    events = interactive[1]
    known = {policy.id: policy for event in generations(events) for policy in event.offspring}
    for event in generations(events)[1:]:
        for child in event.offspring:
            parent = known[child.parent]
            assert parent is event.state.choice or (parent.values >= event.bounds).all()
            assert child.predicted is not None


def test_offspring_inherit_their_parents_state(interactive):
    """Adam counts its steps: a child's count is its parent's plus those of one generation."""
    events = generations(interactive[1])
    known = {policy.id: policy for event in events for policy in event.offspring}
    for event in events[1:]:
        for child in event.offspring:
            inherited = (
                child.snapshot.observation_statistics.count - known[child.parent].snapshot.observation_statistics.count
            )
            assert inherited == pytest.approx(3 * 16 * 3, rel=1e-3)


def test_the_final_question_shows_the_archive_within_the_bounds(interactive):
    user, events = interactive
    final, state = user.questions[-1], events[-1].state
    assert final.purpose == "final"
    inside = [p for p in state.archive.members if within(p.values[None], state.search.bounds)[0]]
    assert list(final.front) == inside
    assert events[-1].chosen in inside


def test_records_are_true_parent_to_child_edges(interactive):
    records = interactive[1][-1].state.search.records
    children = [policy for event in generations(interactive[1])[1:] for policy in event.offspring]
    known = {policy.id: policy for event in generations(interactive[1]) for policy in event.offspring}
    np.testing.assert_array_equal(records.children, values_of(children))
    np.testing.assert_array_equal(records.parents, values_of([known[child.parent] for child in children]))
    np.testing.assert_array_equal(records.weights, np.stack([child.weights for child in children]))


def test_policies_have_unique_ids_and_finite_scores(interactive):
    policies = [policy for event in generations(interactive[1]) for policy in event.offspring]
    assert [policy.id for policy in policies] == list(range(16))
    assert all(np.isfinite(policy.values).all() for policy in policies)


def test_pgmorl_asks_only_at_the_end_and_has_no_bounds(small_config):
    user = Recorder()
    events = list(run(small_config.replace(method="pgmorl"), user))
    assert [question.purpose for question in user.questions] == ["final"]
    assert all((event.bounds == -np.inf).all() for event in generations(events))
    assert user.questions[0].front == events[-1].state.archive.members


def test_a_user_may_go_on_without_being_asked_and_may_stop(small_config):
    user = Recorder(generations=2)
    list(run(small_config, user))
    assert [question.generation for question in user.questions] == [1, 3, 4]
    stopping = Recorder(stop=True)
    events = list(run(small_config, stopping))
    assert events[-1].reason == "stopped"
    assert events[-1].chosen is events[-2].chosen
    assert events[-1].state.generation == 0


@pytest.mark.parametrize("method", ["interactive", "pgmorl"])
def test_a_satisfied_user_ends_the_run(small_config, method):
    user = Recorder()
    user.satisfied_after = 1  # not after the warm-up, but after the first generation
    events = list(run(small_config.replace(method=method), user))
    assert events[-1].reason == "satisfied"
    assert events[-1].state.generation == 1


@pytest.mark.parametrize(
    "search", [{"gain_within": "front"}, {"value_scale": "none"}, {"bounds_scale": "one"}, {"delta": 0.0}]
)
def test_every_variant_of_the_search_runs(small_config, search):
    events = list(run(small_config.replace(search=search), Recorder(index=1)))
    assert events[-1].state.generation == 3


def test_a_choice_that_leaves_nothing_else_is_still_trained(small_config):
    """Bounds at the choice itself: no other policy reaches them, so every task continues it."""
    events = generations(list(run(small_config.replace(search={"delta": 0.0}), Recorder())))
    assert events[1].candidates == 1
    assert {child.parent for child in events[1].offspring} == {events[1].state.choice.id}


def test_an_answer_that_was_not_shown_is_refused(small_config):
    class Liar(DecisionMaker):
        def answer(self, question):
            return Answer(10_000)

    with pytest.raises(ValueError, match="policy 10000 is not among the policies shown"):
        list(run(small_config, Liar()))


def test_what_was_found_before_a_fault_is_kept(small_config, monkeypatch):
    train = Population.train
    calls = []

    def failing(*arguments):
        calls.append(arguments)
        if len(calls) == 3:
            raise TrainingFault("agent 0: loss is not finite in iteration 1")
        return train(*arguments)

    monkeypatch.setattr(Population, "train", failing)
    seen = []
    with pytest.raises(TrainingFault, match="agent 0: loss"):
        for event in run(small_config, Recorder()):
            seen.append(event)
    assert [event.state.generation for event in generations(seen)] == [0, 1]
    assert all(np.isfinite(policy.values).all() for policy in seen[-2].state.archive.members)


def test_a_fault_that_only_evaluation_meets_is_named(small_config):
    """Rollouts of four, twice, end before the tenth step of an episode, which breaks."""
    config = small_config.replace(ppo={"rollout_steps": 4, "minibatches": 2}, steps=4 * 3 * 4 * 11)
    with pytest.raises(TrainingFault, match="agent 0: the return of east, west is not finite in evaluation; agent 1"):
        list(run(config, Recorder(), Faulty("reward", breaks_at=10, component=slice(1, None))))


def test_an_environment_that_is_not_as_it_declares_is_refused(small_config):
    class Short(ThreeWays):
        def transition(self, state, action):
            result = super().transition(state, action)
            return result._replace(reward=result.reward[:2])

    with pytest.raises(
        ValueError, match=r"probe-three-ways is not as it declares: reward has shape \(2,\), not \(3,\)"
    ):
        next(run(small_config, Recorder(), Short()))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"decision_maker": UtilityUser}, "decision_maker must be a DecisionMaker, .* not the class UtilityUser"),
        ({"decision_maker": "A"}, "decision_maker must be a DecisionMaker, an instance of a subclass, not 'A'"),
        ({"environment": "cart:cart-v0"}, "environment must be an Environment, as `envs.make` returns it, not 'cart"),
    ],
)
def test_what_is_of_another_kind_is_named(small_config, arguments, message):
    with pytest.raises(TypeError, match=message):
        run(small_config, **arguments)


def test_another_environment_than_the_configs_is_refused(small_config):
    with pytest.raises(
        ValueError, match=r"environment probe is not probe-three-ways, which the config names: objectives"
    ):
        next(run(small_config, Recorder(), Onwards()))


def test_one_objective_is_nothing_to_choose_between(small_config):
    class Single(ThreeWays):
        objectives = ThreeWays.objectives[:1]

    with pytest.raises(ValueError, match="there must be 2 objectives or more, not 1"):
        next(run(small_config, Recorder(), Single()))


def test_different_seeds_differ_in_every_generation(small_config):
    first, second = (generations(list(run(small_config.replace(seed=seed), Recorder()))) for seed in (1, 2))
    for one, other in zip(first, second, strict=True):
        assert not np.array_equal(values_of(one.offspring), values_of(other.offspring))


def test_two_processes_find_the_same_bytes(small_config, interactive, tmp_path):
    config = tmp_path / "config.toml"
    config.write_text(small_config.to_toml())
    program = (
        "import sys, tests.conftest\n"
        "from pathlib import Path\n"
        "from jmorl.config import resolve\n"
        "from jmorl import run\n"
        "from tests.test_run import Recorder, digest\n"
        f"print(digest(run(resolve(file=Path({str(config)!r})), Recorder(index=1))))\n"
    )
    finished = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, env={**os.environ}, timeout=300
    )
    assert resolve(file=config) == small_config
    assert finished.stdout.strip() == digest(interactive[1])


def test_the_default_reference_point_is_below_the_warm_up(interactive):
    warmed_up = generations(interactive[1])[0]
    values = values_of(warmed_up.offspring)
    np.testing.assert_allclose(warmed_up.state.reference_point, values.min(0) - 0.1 * np.ptp(values, axis=0))
    assert all(event.front.hypervolume > 0 for event in generations(interactive[1]))


def test_metrics_agree_with_the_state(interactive, small_config):
    last = generations(interactive[1])[-1]
    assert last.front.front_size == len(last.state.archive.members)
    assert last.utility_max is None  # this user has no utility function
    with_utility = generations(list(run(small_config)))[-1]
    utilities = with_utility.state.archive.values @ [0.5, 0.3, 0.2]
    assert with_utility.utility_max == pytest.approx(utilities.max())
    assert with_utility.search["utility_mean"] <= with_utility.utility_max + 1e-12
    assert with_utility.search["prediction_error"] >= 0

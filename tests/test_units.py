"""Paper units: MO-Gymnasium's own wrappers, chained as the authors do, give the same numbers."""

from typing import Any

import gymnasium
import jax
import numpy as np
import pytest
from mo_gymnasium.wrappers import MOClipReward, MONormalizeReward

from envs.core import Objective
from jmorl.learning.rollout import EpisodeReturns, Trace
from jmorl.scoring import paper_scores, raw_scores
from jmorl.units import in_running_units, initial_units, measured_in

GAMMA, SCALE_GAMMA = 0.97, 0.9


class Replay(gymnasium.Env):
    """Gives out the rewards of episodes that are known beforehand."""

    observation_space = action_space = gymnasium.spaces.Box(-1, 1, (1,))

    def __init__(self, episodes):
        self.episodes, self.number = episodes, -1

    def reset(self, *, seed=None, options=None):
        self.number, self.step_number = self.number + 1, 0
        return np.zeros(1), {}

    def step(self, action):
        rewards, terminated = self.episodes[self.number]
        self.step_number += 1
        last = self.step_number == len(rewards)
        reward = rewards[self.step_number - 1].astype(np.float64)
        return np.zeros(1), reward, last and terminated, last and not terminated, {}


def wrapped_scores(episodes, objectives):
    """The discounted returns [N, M] of the episodes behind the real wrappers, and the last deviations [M]."""
    environment: Any = Replay(episodes)
    normalisers: list[Any] = []
    for index in range(objectives):
        environment = MONormalizeReward(environment, idx=index, gamma=SCALE_GAMMA)
        normalisers.append(environment)
        environment = MOClipReward(environment, idx=index, min_r=-10, max_r=10)
    scores = []
    for _ in episodes:
        environment.reset()
        score, power, ended = np.zeros(objectives), 1.0, False
        while not ended:
            _, reward, terminated, truncated, _ = environment.step(np.zeros(1))
            score, power, ended = score + power * reward, power * GAMMA, terminated or truncated
        scores.append(score)
    return np.array(scores), [float(np.sqrt(each.return_rms.var + each.epsilon)) for each in normalisers]


def random_episodes(generator, count, objectives):
    """Episodes of all lengths, some with terminal rewards that are clipped, and a reward that hardly varies."""
    scale = np.array([1.0, 300.0, 1e-3])[:objectives]
    return [
        (
            (generator.normal(-1, 1, (generator.integers(1, 40), objectives)) * scale).astype(np.float32),
            bool(generator.integers(2)),
        )
        for _ in range(count)
    ]


def as_returns(episodes, agents):
    """The episodes as an evaluation of so many agents returns them, padded to one length."""
    longest = max(len(rewards) for rewards, _ in episodes)
    padded = np.stack([np.pad(rewards, ((0, longest - len(rewards)), (0, 0))) for rewards, _ in episodes])
    terminated = np.array([ended for _, ended in episodes])
    lengths = np.array([len(rewards) for rewards, _ in episodes])
    flat = EpisodeReturns(padded.sum(1), padded.sum(1), lengths, Trace(padded, terminated))
    shape = (agents, len(episodes) // agents)
    return jax.tree.map(lambda part: part.reshape(*shape, *part.shape[1:]), flat)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("objectives", [2, 3])
def test_scores_are_those_of_the_real_wrappers(seed, objectives):
    episodes = random_episodes(np.random.default_rng(seed), 12, objectives)
    expected, deviations = wrapped_scores(episodes, objectives)
    scores, units = paper_scores(as_returns(episodes, 4), initial_units(objectives), GAMMA, SCALE_GAMMA)
    np.testing.assert_allclose(scores.values, expected.reshape(4, 3, -1).mean(1), rtol=1e-7)
    np.testing.assert_allclose(scores.std, expected.reshape(4, 3, -1).std(1), rtol=1e-6)
    np.testing.assert_allclose(units.deviation, deviations, rtol=1e-7)
    assert scores.steps == sum(len(rewards) for rewards, _ in episodes)
    np.testing.assert_allclose(scores.raw, raw_scores(as_returns(episodes, 4)).values)


def test_both_endings_and_clipping_matter_in_that_comparison():
    episodes = random_episodes(np.random.default_rng(0), 12, 2)
    expected, _ = wrapped_scores(episodes, 2)
    otherwise, _ = wrapped_scores([(rewards, not terminated) for rewards, terminated in episodes], 2)
    assert np.abs(expected - otherwise).max() > 1e-2
    scaled, _ = in_running_units(episodes[0][0], episodes[0][1], initial_units(2), SCALE_GAMMA)
    assert (np.abs(scaled) == 10).any() and (np.abs(scaled) < 10).any()


def test_a_time_limit_does_not_end_the_sums_and_termination_does():
    rewards = np.full((3, 1), 2.0)
    _, truncated = in_running_units(rewards, False, initial_units(1), 0.5)
    _, terminated = in_running_units(rewards, True, initial_units(1), 0.5)
    assert truncated.discounted_sum == 3.5 and terminated.discounted_sum == 2.0
    _, after = in_running_units(rewards[:1], False, truncated, 0.5)
    assert after.discounted_sum == 0.5 * 3.5 + 2


def test_one_long_episode_is_scored_like_its_parts():
    rewards = np.random.default_rng(3).normal(5, 1, (60, 2))
    whole, at_once = in_running_units(rewards, True, initial_units(2), 0.9)
    units, parts = initial_units(2), []
    for part, last in ((rewards[:7], False), (rewards[7:8], False), (rewards[8:], True)):
        scaled, units = in_running_units(part, last, units, 0.9)
        parts.append(scaled)
    np.testing.assert_allclose(np.concatenate(parts), whole, rtol=1e-10)
    np.testing.assert_allclose(np.stack(list(vars(units).values())), np.stack(list(vars(at_once).values())), rtol=1e-10)


def test_an_objective_that_is_multiplied_keeps_its_score():
    """The paper's HalfCheetah: ten times the speed is the same score."""
    rewards = np.random.default_rng(1).normal(5, 1, (400, 2))
    plain, _ = in_running_units(rewards, False, initial_units(2), 0.99)
    faster, _ = in_running_units(rewards * [10, 1], False, initial_units(2), 0.99)
    np.testing.assert_allclose(faster[20:], plain[20:], rtol=1e-4)


def test_scores_in_paper_units_are_not_labelled_with_the_environments():
    objectives = (Objective("speed", "speed", "m/s"),)
    assert measured_in("raw", objectives) == objectives
    assert measured_in("paper", objectives)[0].unit == "running deviations"

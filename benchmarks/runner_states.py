"""States of runners of every kind that their dynamics should be tried on, as MuJoCo C passes through them.

python -m benchmarks.runner_states ENV POLICY...    keep policies' gaits -> benchmarks/gaits.npz
"""

import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import NamedTuple

import jax
import mujoco
import numpy as np

import envs
from envs.half_cheetah import HalfCheetah
from envs.planar.model import compile_model
from envs.runner import FASTEST_SEEN, Runner
from jmorl.storage.policy_file import load_policy

GAITS = Path(__file__).parent / "gaits.npz"  # of each runner two policies, one fast and one on little torque
# One of each model.
RUNNERS = ("mo-halfcheetah-v5", "mo-walker2d-v5", "mo-hopper-v5", "pgmorl-walker2d-v2", "pgmorl-hopper-v2")
FAR = 10_000.0  # metres
TRIES = 10_000  # to find a state in which bodies touch each other

Controller = Callable[[np.ndarray], np.ndarray]  # observation [O] -> control [U]


class Steps(NamedTuple):
    """N time steps, each from its own state: before and after, in MuJoCo's joint order."""

    qpos: np.ndarray  # [N, V]
    qvel: np.ndarray  # [N, V]
    control: np.ndarray  # [N, U]
    next_qpos: np.ndarray  # [N, V]
    next_qvel: np.ndarray  # [N, V]


class Beginning(NamedTuple):
    """What an episode begins from."""

    runner: Runner
    model: mujoco.MjModel
    rng: np.random.Generator
    number: int  # of the episode
    qpos: np.ndarray  # [V] of a start of the environment
    qvel: np.ndarray  # [V]

    def at_height(self, low: float, high: float) -> float:
        """Return a position along z at which the torso is so many metres above the ground."""
        return float(self.rng.uniform(low, high) + self.model.qpos0[1] - self.model.body_pos[1, 2])

    def velocities(self, x: float, z: float, angle: float, joints: float) -> np.ndarray:
        """Return normal velocities with these standard deviations, in m/s and rad/s."""
        return self.rng.normal(size=self.model.nv) * [x, z, angle, *[joints] * (self.model.nv - 3)]

    def joints(self, beyond: float = 0.0) -> np.ndarray:
        """Return angles anywhere in the joints' ranges, or beyond by this share of each; any of free joints."""
        limited = self.model.jnt_limited[3:, None].astype(bool)
        low, high = np.where(limited, self.model.jnt_range[3:], [-np.pi, np.pi]).T
        return self.rng.uniform(low - beyond * (high - low), high + beyond * (high - low))

    def random(self) -> Controller:
        """Return gentle, lively or saturated random actions."""
        box = self.runner.action_box
        return lambda _: box.action(self.rng.normal(size=self.model.nu) * self.rng.choice([0.3, 1.0, 3.0]), np)


# From the beginning of an episode to qpos, qvel and who controls.
Episode = Callable[[Beginning], tuple[np.ndarray, np.ndarray, Controller]]


def converged(model: mujoco.MjModel) -> mujoco.MjModel:
    """Return the same model, with a solver that goes on until it has the answer."""
    model.opt.tolerance, model.opt.ls_tolerance, model.opt.iterations = 1e-14, 1e-6, 200
    return model


@cache
def runner_of(id: str) -> Runner:
    """Return a runner whose model has a converged solver: not the one that others get from `envs.make`."""
    runner = envs.make_anew(id)
    assert isinstance(runner, Runner)
    converged(runner.model)
    return runner


def kinds_of(id: str) -> list[str]:
    """Return the kinds of states that a runner can be in."""
    there = {"trained gaits": id in _gaits(), "self-contact": compile_model(runner_of(id).model).pairs.count > 0}
    return [kind for kind in KINDS if there.get(kind, True)]


def steps_of(id: str, kind: str, count: int, seed: int) -> Steps:
    """Return at least `count` time steps of a kind, rounded up to whole episodes."""
    runner, (length, episode) = runner_of(id), KINDS[kind]
    episodes = -(-count // (length * runner.frame_skip))
    starts = jax.device_get(jax.vmap(runner.initial_state)(jax.random.split(jax.random.key(seed), episodes)))
    model, rng = runner.model, np.random.default_rng(seed)
    data = mujoco.MjData(model)
    rows: list[tuple[np.ndarray, ...]] = []
    for number in range(episodes):
        start = starts.qpos[number].astype(float), starts.qvel[number].astype(float)
        rows += _play(runner, data, *episode(Beginning(runner, model, rng, number, *start)), length)
    return Steps(*(np.stack(column) for column in zip(*rows, strict=True)))


def _play(
    runner: Runner, data: mujoco.MjData, qpos: np.ndarray, qvel: np.ndarray, act: Controller, length: int
) -> list[tuple[np.ndarray, ...]]:
    """Return `length` environment steps, every one of their time steps."""
    mujoco.mj_resetData(runner.model, data)
    data.qpos[:], data.qvel[:] = qpos, qvel
    rows: list[tuple[np.ndarray, ...]] = []
    for _ in range(length):
        data.ctrl[:] = np.clip(act(_seen(runner, data)), runner.action_box.low, runner.action_box.high)
        for _ in range(runner.frame_skip):
            before = data.qpos.copy(), data.qvel.copy(), data.ctrl.copy()
            mujoco.mj_step(runner.model, data)
            rows.append((*before, data.qpos.copy(), data.qvel.copy()))
    return rows


def _seen(runner: Runner, data: mujoco.MjData) -> np.ndarray:
    """Return the observation [O]."""
    far = np.inf if isinstance(runner, HalfCheetah) else FASTEST_SEEN
    return np.concatenate([data.qpos[1:], np.clip(data.qvel, -far, far)])


def keep_gaits(id: str, policies: list[Path]) -> None:
    """Write policies as layers, kernel [in, out] above bias, that take observations as they are."""
    kept = {f"{name}/{index}_{depth}": layer for name, some in _gaits().items() for (index, depth), layer in some}
    kept = {name: layer for name, layer in kept.items() if not name.startswith(f"{id}/")}
    for index, policy in enumerate(map(load_policy, policies)):
        deviation = np.sqrt(policy.observation_variance)
        (kernel, bias), *rest = policy.layers
        first = (kernel / deviation[:, None], bias - (policy.observation_mean / deviation) @ kernel)
        kept |= {f"{id}/{index}_{depth}": np.vstack(layer) for depth, layer in enumerate((first, *rest))}
    _gaits.cache_clear()
    np.savez(GAITS, **kept)  # type: ignore[arg-type]  # NumPy's stub takes the second for another parameter


@cache
def _gaits() -> dict[str, list[tuple[tuple[int, int], np.ndarray]]]:
    """Return the layers kept of each runner, by policy and depth."""
    found: dict[str, list[tuple[tuple[int, int], np.ndarray]]] = {}
    with np.load(GAITS) as kept:
        for name in sorted(kept.files):
            id, _, place = name.rpartition("/")
            index, _, depth = place.partition("_")
            found.setdefault(id, []).append(((int(index), int(depth)), kept[name]))
    return found


def _gait(begin: Beginning) -> tuple[np.ndarray, np.ndarray, Controller]:
    """Play a trained policy from a start of the environment, with noise in every other pair of episodes."""
    kept = _gaits()[begin.runner.id]
    index, noise = begin.number % (1 + max(policy for (policy, _), _ in kept)), 0.2 * (begin.number // 2 % 2)
    layers = [layer for (policy, _), layer in kept if policy == index]

    def act(observation: np.ndarray) -> np.ndarray:
        for layer in layers[:-1]:
            observation = np.tanh(observation @ layer[:-1] + layer[-1])
        output = observation @ layers[-1][:-1] + layers[-1][-1] + noise * begin.rng.normal(size=begin.model.nu)
        return begin.runner.action_box.action(output, np)

    return begin.qpos, begin.qvel, act


def _start(begin: Beginning) -> tuple[np.ndarray, np.ndarray, Controller]:
    """Play random actions from a start of the environment."""
    return begin.qpos, begin.qvel, begin.random()


def _far(begin: Beginning) -> tuple[np.ndarray, np.ndarray, Controller]:
    """Play the same, far from the origin."""
    return begin.qpos + FAR * np.eye(begin.model.nq)[0], begin.qvel, begin.random()


def _fall(begin: Beginning) -> tuple[np.ndarray, np.ndarray, Controller]:
    """Drop it from anywhere, at any angle, joints anywhere in their ranges, tumbling."""
    qpos = np.concatenate([[0, begin.at_height(0.3, 2.2), begin.rng.uniform(-np.pi, np.pi)], begin.joints()])
    return qpos, begin.velocities(3, 2, 4, 6), begin.random()


def _inverted(begin: Beginning) -> tuple[np.ndarray, np.ndarray, Controller]:
    """On its back or its head, legs in the air, kicking."""
    qpos = begin.model.qpos0.copy()
    qpos[1:3] = begin.at_height(0.15, 0.7), np.pi + begin.rng.uniform(-1, 1)
    return qpos, begin.velocities(1, 1, 1, 1), begin.random()


def _violent(begin: Beginning) -> tuple[np.ndarray, np.ndarray, Controller]:
    """In the ground, fast, and joints beyond their limits, all at once."""
    place = begin.rng.uniform(-5, 5), begin.at_height(0.05, 1.1), begin.rng.uniform(-np.pi, np.pi)
    return np.concatenate([place, begin.joints(0.15)]), begin.velocities(3, 3, 5, 8), begin.random()


def _touching(begin: Beginning) -> tuple[np.ndarray, np.ndarray, Controller]:
    """Folded up until bodies touch each other."""
    data = mujoco.MjData(begin.model)
    for _ in range(TRIES):
        data.qpos[:] = [0, begin.at_height(0.3, 1.5), begin.rng.uniform(-np.pi, np.pi), *begin.joints(0.15)]
        mujoco.mj_fwdPosition(begin.model, data)
        if any((begin.model.geom_bodyid[contact.geom] > 0).all() for contact in data.contact):
            return data.qpos.copy(), begin.velocities(2, 2, 3, 5), begin.random()
    raise ValueError(f"bodies of {begin.runner.id} do not touch each other in {TRIES} states")


# kind -> environment steps of an episode, and how it begins and goes on
KINDS: dict[str, tuple[int, Episode]] = {
    "trained gaits": (250, _gait),
    "random actions": (40, _start),
    "falls": (25, _fall),
    "inverted": (25, _inverted),
    "10 km away": (40, _far),
    "violent": (1, _violent),
    "self-contact": (1, _touching),
}

if __name__ == "__main__":
    keep_gaits(sys.argv[1], [Path(path) for path in sys.argv[2:]])

"""States of the half cheetah of every kind that its dynamics should be tried on, as MuJoCo C passes through them.

python -m benchmarks.cheetah_states POLICY...    keep policies' gaits -> benchmarks/gaits.npz
"""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import mujoco
import numpy as np

from envs.half_cheetah import FRAME_SKIP, JOINTS, RESET_NOISE
from envs.mujoco_model import load_model
from jmorl.storage.policy_file import load_policy

GAITS = Path(__file__).parent / "gaits.npz"  # two policies, one fast and one on little torque
FAR = 10_000.0  # metres

Controller = Callable[[np.ndarray], np.ndarray]  # observation [O] -> control [U]
# A model, where randomness comes from, and the episode's number -> qpos, qvel, and who controls.
Episode = Callable[[mujoco.MjModel, np.random.Generator, int], tuple[np.ndarray, np.ndarray, Controller]]


class Steps(NamedTuple):
    """N time steps, each from its own state: before and after, in MuJoCo's joint order."""

    qpos: np.ndarray  # [N, V]
    qvel: np.ndarray  # [N, V]
    control: np.ndarray  # [N, U]
    next_qpos: np.ndarray  # [N, V]
    next_qvel: np.ndarray  # [N, V]


def converged(model: mujoco.MjModel) -> mujoco.MjModel:
    """Return the same model, with a solver that goes on until it has the answer."""
    model.opt.tolerance, model.opt.ls_tolerance, model.opt.iterations = 1e-14, 1e-6, 200
    return model


def cheetah_steps(kind: str, count: int, seed: int) -> Steps:
    """At least `count` time steps of a kind, rounded up to whole episodes."""
    model, rng = converged(load_model("half_cheetah")), np.random.default_rng(seed)
    length, episode = KINDS[kind]
    data = mujoco.MjData(model)
    episodes = -(-count // (length * FRAME_SKIP))
    rows = [row for index in range(episodes) for row in _play(model, data, *episode(model, rng, index), length)]
    return Steps(*(np.stack(column) for column in zip(*rows, strict=True)))


def _play(
    model: mujoco.MjModel, data: mujoco.MjData, qpos: np.ndarray, qvel: np.ndarray, act: Controller, length: int
) -> list[tuple[np.ndarray, ...]]:
    """`length` environment steps, every one of their time steps."""
    mujoco.mj_resetData(model, data)
    data.qpos[:], data.qvel[:] = qpos, qvel
    rows: list[tuple[np.ndarray, ...]] = []
    for _ in range(length):
        data.ctrl[:] = np.clip(act(np.concatenate([data.qpos[1:], data.qvel])), -1, 1)
        for _ in range(FRAME_SKIP):
            before = data.qpos.copy(), data.qvel.copy(), data.ctrl.copy()
            mujoco.mj_step(model, data)
            rows.append((*before, data.qpos.copy(), data.qvel.copy()))
    return rows


def keep_gaits(policies: list[Path]) -> None:
    """Write policies as layers, kernel [in, out] above bias, that take observations as they are."""
    layers: dict[str, Any] = {}
    for index, policy in enumerate(map(load_policy, policies)):
        deviation = np.sqrt(policy.observation_variance)
        (kernel, bias), *rest = policy.layers
        first = (kernel / deviation[:, None], bias - (policy.observation_mean / deviation) @ kernel)
        layers |= {f"{index}_{depth}": np.vstack(layer) for depth, layer in enumerate((first, *rest))}
    np.savez(GAITS, **layers)


def _policy(index: int) -> Controller:
    """One of the kept policies, in turn."""
    with np.load(GAITS) as kept:
        count = 1 + max(int(name.partition("_")[0]) for name in kept.files)
        layers = [kept[name] for name in sorted(kept.files) if name.startswith(f"{index % count}_")]

    def act(observation: np.ndarray) -> np.ndarray:
        for layer in layers[:-1]:
            observation = np.tanh(observation @ layer[:-1] + layer[-1])
        return observation @ layers[-1][:-1] + layers[-1][-1]

    return act


def _gait(model: mujoco.MjModel, rng: np.random.Generator, index: int) -> tuple[np.ndarray, np.ndarray, Controller]:
    """Play a trained policy from a start of the environment, with noise in every other pair of episodes."""
    act, noise = _policy(index), 0.2 * (index // 2 % 2)
    qpos, qvel, _ = _reset(model, rng, index)
    return qpos, qvel, lambda observation: act(observation) + noise * rng.normal(size=model.nu)


def _reset(model: mujoco.MjModel, rng: np.random.Generator, _index: int) -> tuple[np.ndarray, np.ndarray, Controller]:
    """Play random actions from a start of the environment."""
    qpos, qvel = rng.uniform(-RESET_NOISE, RESET_NOISE, JOINTS), RESET_NOISE * rng.normal(size=JOINTS)
    return qpos, qvel, _random(model, rng)


def _far(model: mujoco.MjModel, rng: np.random.Generator, index: int) -> tuple[np.ndarray, np.ndarray, Controller]:
    """Play the same, far from the origin."""
    qpos, qvel, act = _reset(model, rng, index)
    qpos[0] += FAR
    return qpos, qvel, act


def _fall(model: mujoco.MjModel, rng: np.random.Generator, _index: int) -> tuple[np.ndarray, np.ndarray, Controller]:
    """Drop it from anywhere, at any angle, joints anywhere in their ranges, tumbling."""
    qpos, qvel = np.zeros(JOINTS), rng.normal(size=JOINTS) * [3, 2, 4, 6, 6, 6, 6, 6, 6]
    qpos[1], qpos[2] = rng.uniform(-0.4, 1.5), rng.uniform(-np.pi, np.pi)
    qpos[3:] = rng.uniform(*model.jnt_range[3:].T)
    return qpos, qvel, _random(model, rng)


def _inverted(
    model: mujoco.MjModel, rng: np.random.Generator, _index: int
) -> tuple[np.ndarray, np.ndarray, Controller]:
    """On its back or its head, legs in the air, kicking."""
    qpos, qvel = np.zeros(JOINTS), rng.normal(size=JOINTS)
    qpos[1], qpos[2] = rng.uniform(-0.55, 0.0), np.pi + rng.uniform(-1, 1)
    return qpos, qvel, _random(model, rng)


def _violent(model: mujoco.MjModel, rng: np.random.Generator, _index: int) -> tuple[np.ndarray, np.ndarray, Controller]:
    """In the ground, fast, and joints beyond their limits, all at once."""
    qpos, qvel = rng.uniform(-5, 5, JOINTS), rng.normal(size=JOINTS) * [3, 3, 5, 8, 8, 8, 8, 8, 8]
    low, high = model.jnt_range[3:].T
    qpos[1], qpos[2] = rng.uniform(-0.65, 0.4), rng.uniform(-np.pi, np.pi)
    qpos[3:] = rng.uniform(low - 0.15 * (high - low), high + 0.15 * (high - low))
    return qpos, qvel, _random(model, rng)


def _random(model: mujoco.MjModel, rng: np.random.Generator) -> Controller:
    """Gentle, lively or saturated random actions."""
    return lambda _: rng.normal(size=model.nu) * rng.choice([0.3, 1.0, 3.0])


# kind -> environment steps of an episode, and how it begins and goes on
KINDS: dict[str, tuple[int, Episode]] = {
    "trained gaits": (250, _gait),
    "random actions": (40, _reset),
    "falls": (25, _fall),
    "inverted": (25, _inverted),
    "10 km away": (40, _far),
    "violent": (1, _violent),
}

if __name__ == "__main__":
    keep_gaits([Path(path) for path in sys.argv[1:]])

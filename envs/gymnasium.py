"""An `Environment` behind MO-Gymnasium's API, and MO-Gymnasium's own environment of the same id.

The first is for its wrappers, its algorithms, and anything made for Gymnasium; time limit and vector reward come with
the environment, so no wrapper is needed. The second is to compare with. Needs the `gymnasium` extra.
"""

import warnings
from typing import Any

import gymnasium
import jax
import jax.numpy as jnp
import numpy as np

from envs import plain_id
from envs.core import Environment
from envs.mujoco_model import quiet_mujoco


class GymnasiumEnvironment(gymnasium.Env[np.ndarray, np.ndarray]):
    """One environment at a time, on the host, with rewards [M] as in MO-Gymnasium."""

    metadata: dict[str, Any] = {"render_modes": []}

    def __init__(self, environment: Environment[Any]):
        size, box, objectives = environment.observation_size, environment.action_box, len(environment.objectives)
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (size,), np.float32)
        self.action_space = gymnasium.spaces.Box(box.low, box.high, dtype=np.float32)
        self.reward_space = gymnasium.spaces.Box(-np.inf, np.inf, (objectives,), np.float32)
        self.reward_dim = objectives
        self._reset = jax.jit(environment.reset)
        self._advance = jax.jit(environment.advance)
        self._state: Any = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Start an episode; the start state is drawn from Gymnasium's own generator."""
        super().reset(seed=seed)
        key = jax.random.key(int(self.np_random.integers(2**32)))
        self._state, observation = self._reset(key)
        return np.array(observation), {}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, Any, bool, bool, dict[str, Any]]:
        """One step: observation [O], reward [M], terminated, truncated, and an empty info."""
        if self._state is None:
            raise gymnasium.error.ResetNeeded("call reset before the first step")
        self._state, step = self._advance(self._state, jnp.asarray(action, jnp.float32))
        observation, reward = np.array(step.final_observation), np.array(step.reward)
        return observation, reward, bool(step.terminated), bool(step.truncated), {}


def original(id: str) -> Any:
    """MO-Gymnasium's environment that `envs.make(id)` is the counterpart of, with its time limit; options are ours.

    Raises gymnasium.error.Error if MO-Gymnasium has none of that id, and ImportError if what it needs is missing.
    """
    with warnings.catch_warnings(), quiet_mujoco():
        warnings.simplefilter("ignore")  # about versions and precision; nothing that a user of ours can change
        import mo_gymnasium

        return mo_gymnasium.make(plain_id(id))

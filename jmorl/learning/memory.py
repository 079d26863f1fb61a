"""What a run needs of memory at least, from its settings alone, and how much there is.

Whatever is certain to be there at the same time is counted, and nothing else: what the estimate refuses cannot work,
but what it lets pass may still be too large. Sizes in bytes.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import jax
import psutil

from envs.core import Environment
from jmorl.learning.settings import LearningConfig

FLOAT = 4
STATES_ON_DEVICES, STATES_ON_HOST = 2, 2  # before and after training; the same, and in the policies it came from
WORTH_NAMING = 0.1  # of what is needed


class DoesNotFit(ValueError):
    """A run that needs more memory than there is. The message names the settings that make it large."""


@dataclass(frozen=True)
class Needed:
    """Memory for all agents together."""

    state: int  # one copy of all train states: networks, and the two moments of the optimiser
    gradients: int
    rollouts: int  # what an iteration acts through and learns from
    episodes: int  # of an evaluation

    @property
    def on_devices(self) -> int:
        """Evaluation follows on training."""
        return STATES_ON_DEVICES * self.state + self.gradients + max(self.rollouts, self.episodes)

    @property
    def on_host(self) -> int:
        """Beside the devices."""
        return STATES_ON_HOST * self.state


def check_memory(environment: Environment[Any], config: LearningConfig, runs: int = 1) -> None:
    """Raise DoesNotFit if so many runs in one program cannot fit into the memory there is."""
    needed = needed_memory(environment, config, runs)
    devices = jax.local_devices()
    on_devices = [stats["bytes_limit"] for each in devices if (stats := each.memory_stats())]
    if on_devices:
        _compare(needed.on_devices, sum(on_devices), "on its devices", needed, config)
        _compare(needed.on_host, machine_memory(), "on this machine", needed, config)
    else:
        # The first copy on a CPU may be the host's own.
        on_both = needed.on_devices + needed.on_host - needed.state
        _compare(on_both, machine_memory(), "on this machine", needed, config)


def needed_memory(environment: Environment[Any], config: LearningConfig, runs: int = 1) -> Needed:
    """Return the memory that a run, or so many runs side by side, needs."""
    ppo, evaluation, agents = config.ppo, config.evaluation, runs * config.agents
    o, a, m = environment.observation_size, environment.action_size, len(environment.objectives)
    parameters = sum(_parameters((o, *ppo.hidden_sizes, outputs)) for outputs in (a, m))
    widest = max(ppo.hidden_sizes)
    trajectory, batch = 2 * o + a + m, o + 2 * m + 2
    episode = o + 2 * m
    episode += environment.time_limit * m if evaluation.units == "paper" else 0
    episode += environment.time_limit * a if evaluation.actions == "sampled" else 0
    return Needed(
        state=FLOAT * agents * 3 * parameters,
        gradients=FLOAT * agents * parameters,
        rollouts=FLOAT * agents * ppo.environments * ppo.rollout_steps * (trajectory + batch + widest),
        episodes=FLOAT * agents * evaluation.episodes * (episode + widest),
    )


def _parameters(sizes: tuple[int, ...]) -> int:
    """Of a network with layers of these sizes, the input's included."""
    return sum((inputs + 1) * outputs for inputs, outputs in pairwise(sizes))


def machine_memory() -> int:
    """Return the memory of this machine, or of the process's control group, with swap."""
    return min([psutil.virtual_memory().total, *_group_limits()]) + psutil.swap_memory().total


def _group_limits(groups: Path = Path("/proc/self/cgroup"), mounted: Path = Path("/sys/fs/cgroup")) -> Iterator[int]:
    """Yield the limits of Linux control groups, in both versions: of this process's own and of those around it."""
    try:
        lines = groups.read_text(encoding="utf-8").splitlines()
    except OSError:  # another system
        return
    for line in lines:
        _, kinds, path = line.split(":", 2)
        if kinds and "memory" not in kinds.split(","):
            continue
        root, name = (mounted / "memory", "memory.limit_in_bytes") if kinds else (mounted, "memory.max")
        folder = root / path.lstrip("/")
        for each in (folder, *folder.parents):
            if each.is_relative_to(root):
                try:
                    yield int((each / name).read_text(encoding="utf-8"))
                except (OSError, ValueError):  # there is none, or it says "max"
                    continue


def _compare(needed: int, available: int, where: str, parts: Needed, config: LearningConfig) -> None:
    if needed <= available:
        return
    agents = config.agents
    named = {
        f"the networks and optimisers of {agents} agents (population.agents, ppo.hidden_sizes)": parts.state,
        f"rollouts of {config.ppo.environments} x {config.ppo.rollout_steps} steps an agent (ppo.environments, "
        "ppo.rollout_steps)": parts.rollouts,
        f"{config.evaluation.episodes} episodes an agent in evaluation (evaluation.episodes)": parts.episodes,
    }
    largest = max(named.values())
    why = [name for name, size in named.items() if size >= WORTH_NAMING * largest]
    raise DoesNotFit(
        f"the run needs {_gigabytes(needed)} of memory or more, and there are {_gigabytes(available)} {where}; it is "
        f"large for {' and '.join(why)}"
    )


def _gigabytes(size: int) -> str:
    return f"{size / 1e9:,.1f} GB"

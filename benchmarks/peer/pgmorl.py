"""How fast morl-baselines' PGMORL runs at the sizes of the paper, as a JSON object on standard output.

    python -m venv .venv-peer && .venv-peer/bin/pip install -r benchmarks/peer/requirements.txt
    .venv-peer/bin/python benchmarks/peer/pgmorl.py --env mo-mountaincarcontinuous-v0 > peer.json

`--steps` is the budget of training steps, with the meaning it has in jmorl: a generation starts while fewer than
floor(steps / (P E T)) iterations are done, though at least one is run. The default is a warm-up of one iteration and
one whole generation: about five minutes on an idle CPU core. The published library runs unchanged; its train, evaluate
and select phases are timed from outside, in wall-clock and in CPU seconds, which differ where other programs had the
core.

The same as in jmorl's paper preset: P agents, batches of E*T steps in minibatches of E*T/32, L iterations a
generation, the networks, and every PPO setting. Not the same, and of weight in a comparison of times:

- each evaluation is 5 episodes an agent, one environment at a time, actions sampled; there is one before the warm-up;
- the prediction model is fitted anew for every candidate weight, and selection slows down as the buffer fills: a first
  generation shows the least it takes (the buffer keeps 4 policies a bin, as in jmorl, instead of the library's 2);
- environments are reset at every iteration, and any later reset takes a step.
"""

import argparse
import contextlib
import importlib.metadata
import json
import os
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from morl_baselines.multi_policy.pgmorl.pgmorl import PGMORL
from morl_baselines.single_policy.ser.mo_ppo import make_env

# Below every return in the units of the normalised and clipped rewards; a return below it leaves the buffer empty.
REFERENCE_POINT = np.array([-110.0, -110.0])


@dataclass(frozen=True)
class Phase:
    """One call of a phase."""

    name: str  # train: one iteration of all agents; evaluate: all agents; select: all tasks
    wall_seconds: float
    cpu_seconds: float


def arguments() -> argparse.Namespace:
    """Return the sizes, by default those of the paper with a shortened warm-up."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--env", default="mo-mountaincarcontinuous-v0", help="a MO-Gymnasium id with two objectives")
    parser.add_argument("--agents", type=int, default=6, help="P, at least 4")
    parser.add_argument("--environments", type=int, default=4, help="E")
    parser.add_argument("--rollout-steps", type=int, default=1000, help="T")
    parser.add_argument("--warmup-iterations", type=int, default=1, help="K; 10 in the paper")
    parser.add_argument("--iterations", type=int, default=10, help="L")
    parser.add_argument("--steps", type=int, default=264_000, help="budget of training steps")
    parser.add_argument("--discount", type=float, default=0.995, help="gamma")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=1, help="of PyTorch; 2 were slower on two busy cores")
    sizes = parser.parse_args()
    if sizes.agents < 4:
        parser.error(f"--agents is {sizes.agents}: PGMORL's predictor needs the records of at least 4")
    return sizes


def pgmorl(sizes: argparse.Namespace) -> PGMORL:
    """Return the algorithm with jmorl's paper preset."""
    return PGMORL(
        env_id=sizes.env,
        origin=REFERENCE_POINT,
        num_envs=sizes.environments,
        pop_size=sizes.agents,
        warmup_iterations=sizes.warmup_iterations,
        steps_per_iteration=sizes.rollout_steps,
        evolutionary_iterations=sizes.iterations,
        performance_buffer_size=4,
        # As many weights as agents for the warm-up, and half this step between the candidates.
        delta_weight=1 / (sizes.agents - 1),
        gamma=sizes.discount,
        seed=sizes.seed,
        log=False,
        device="cpu",
        net_arch=[64, 64],
        num_minibatches=32,
        update_epochs=10,
        learning_rate=3e-4,
        clip_coef=0.2,
        ent_coef=0.0,
        vf_coef=0.5,
        max_grad_norm=0.5,
        gae_lambda=0.95,
    )


def timed(name: str, phase: Callable[..., Any], record: list[Phase]) -> Callable[..., Any]:
    """`phase`, appending what each call took to `record`."""

    def call(*args: Any, **kwargs: Any) -> Any:
        wall, cpu = time.perf_counter(), time.process_time()
        result = phase(*args, **kwargs)
        record.append(Phase(name, time.perf_counter() - wall, time.process_time() - cpu))
        return result

    return call


def run(sizes: argparse.Namespace) -> list[Phase]:
    """Every phase of one run, in order. The library's own printing goes nowhere."""
    record: list[Phase] = []
    with open(os.devnull, "w", encoding="utf-8") as nowhere, contextlib.redirect_stdout(nowhere):
        algorithm = pgmorl(sizes)
        # Set on the object, under the names Python gives to private methods: the class stays as published.
        for name, method in (
            ("train", "_PGMORL__train_all_agents"),
            ("evaluate", "_PGMORL__eval_all_agents"),
            ("select", "_PGMORL__task_weight_selection"),
        ):
            setattr(algorithm, method, timed(name, getattr(algorithm, method), record))
        eval_env = make_env(sizes.env, sizes.seed, 0, "evaluation", sizes.discount)()
        algorithm.train(total_timesteps=sizes.steps, eval_env=eval_env, ref_point=REFERENCE_POINT)
    return record


def split_generations(record: list[Phase]) -> tuple[list[Phase], list[list[Phase]]]:
    """Return the warm-up, and the generations: each begins with its selection."""
    starts = [i for i, phase in enumerate(record) if phase.name == "select"]
    ends = [*starts[1:], len(record)]
    return record[: starts[0]], [record[start:end] for start, end in zip(starts, ends, strict=True)]


def summary(phases: list[Phase], steps_per_iteration: int) -> dict[str, Any]:
    """Training steps, seconds by phase and in all, and rates."""
    steps = steps_per_iteration * sum(phase.name == "train" for phase in phases)
    parts = {name: [phase for phase in phases if phase.name == name] for name in ("train", "evaluate", "select")}
    train, total = seconds(parts["train"]), seconds(phases)
    return {
        "training_steps": steps,
        **{name: seconds(part) for name, part in parts.items()},
        "total": total,
        "training_steps_per_second": round(steps / train["wall_seconds"], 1),
        "steps_per_second": round(steps / total["wall_seconds"], 1),
        "steps_per_cpu_second": round(steps / total["cpu_seconds"], 1),
    }


def seconds(phases: list[Phase]) -> dict[str, float]:
    """Return what the phases took together."""
    return {
        "wall_seconds": round(sum(phase.wall_seconds for phase in phases), 3),
        "cpu_seconds": round(sum(phase.cpu_seconds for phase in phases), 3),
    }


def main() -> None:
    """Run once and print the figures."""
    sizes = arguments()
    torch.set_num_threads(sizes.threads)
    with tempfile.TemporaryDirectory() as scratch, contextlib.chdir(scratch):  # MuJoCo leaves a log file behind
        record = run(sizes)
    warmup, generations = split_generations(record)
    steps_per_iteration = sizes.agents * sizes.environments * sizes.rollout_steps
    report = {
        "versions": {name: importlib.metadata.version(name) for name in ("morl-baselines", "torch", "mo-gymnasium")},
        "sizes": vars(sizes),
        "warmup": summary(warmup, steps_per_iteration),
        "generations": [summary(generation, steps_per_iteration) for generation in generations],
        "all_generations": summary([phase for generation in generations for phase in generation], steps_per_iteration),
        "whole_run": summary(record, steps_per_iteration),
    }
    print(json.dumps(report, indent=2))


if __name__ == "__main__":
    main()

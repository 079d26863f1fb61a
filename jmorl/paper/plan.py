"""The plan: the runs that the paper's tables and figures are made of, with their settings.

What two items need alike is one cell: PGMORL asks nobody before its end, so its run for a seed serves every user and
target.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from jmorl.config import resolve
from jmorl.decision.utility import USERS
from jmorl.experiments.cells import Cell
from jmorl.paper.data import Targets, honest, published
from jmorl.presets import PAPER_RULE, merged

CAR, CHEETAH = "mo-mountaincarcontinuous-v0", "mo-halfcheetah-v5"
NAMES = {CAR: "mountaincar", CHEETAH: "halfcheetah"}
METHODS = ("interactive", "pgmorl")
SHORTER = "pgmorl-40"  # PGMORL on HalfCheetah with the paper's warm-up, which it has no reason to wait longer for
METHOD_NAMES = {"interactive": "the interactive method", "pgmorl": "PGMORL", SHORTER: "PGMORL with warm-up 40"}
TARGET_SEEDS = (1, 7, 10, 42, 100)
USER_SEEDS = (1, 42, 100)
PILOT_SEEDS = (2, 3, 5)  # other than all of the above: targets are chosen on them
USER_STEPS = {CAR: 2_500_000, CHEETAH: 5_000_000}

# What the authors' program does and jmorl's defaults do otherwise, where it is a setting.
AUTHORS: Mapping[str, Any] = {
    "evaluation": {"units": "paper", "actions": "sampled", "episodes": 5},
    "ppo": {"discount": 0.995, "weights_on": "scaled"},
    "search": {"bounds_scale": "one", "gain_within": "front", "value_scale": "none", "buffer_size": 2},
}
REFERENCE = {CAR: (-110.0, -110.0), CHEETAH: (-100.0, -100.0)}  # in paper units

# Sizes of `--quick`: everything happens, nothing is learned.
QUICK: Mapping[str, Any] = {
    "population": {"agents": 3, "warmup_iterations": 1, "iterations": 1},
    "ppo": {"environments": 2, "rollout_steps": 64, "minibatches": 2, "epochs": 1, "hidden_sizes": (8,)},
    "evaluation": {"episodes": 2},
}
SHORTER_WARM_UP = {False: 40, True: 2}  # at full size, and `quick`
QUICK_SEEDS = (1, 7)
QUICK_STEPS = {"users": 3 * 2 * 64 * 3, "targets": 3 * 2 * 64 * 4}
QUICK_TARGETS = {"A": (-1e5, -1e5), "B": (-1e3, -350.0), "C": (0.0, 0.0)}  # reached at once, perhaps, and never

Kind = Literal["steps to targets", "greatest utility", "mean utility", "final policies"]


@dataclass(frozen=True)
class Item:
    """A table or figure of the paper."""

    name: str
    env: str
    kind: Kind
    normalised: bool = False


ITEMS = {
    item.name: item
    for item in (
        Item("table1", CAR, "steps to targets"),
        Item("fig5", CAR, "greatest utility"),
        Item("fig6", CAR, "mean utility"),
        Item("fig9", CAR, "final policies"),
        Item("fig10", CAR, "final policies", normalised=True),
        Item("table2", CHEETAH, "steps to targets"),
        Item("fig7", CHEETAH, "greatest utility"),
        Item("fig8", CHEETAH, "mean utility"),
        Item("fig11", CHEETAH, "final policies"),
    )
}


@dataclass(frozen=True)
class Plan:
    """How the experiment is made: at full size, or `quick`; with which seeds, if not the paper's."""

    quick: bool = False
    seeds: tuple[int, ...] | None = None

    def seeds_of(self, item: Item) -> tuple[int, ...]:
        """Return the seeds of an item."""
        if self.quick and not self.seeds:
            return QUICK_SEEDS
        return self.seeds or (TARGET_SEEDS if item.kind == "steps to targets" else USER_SEEDS)

    def methods(self, item: Item, units: str) -> tuple[str, ...]:
        """Return the names of an item's methods: the interactive one, then those that it is compared with."""
        shorter = item.env == CHEETAH and units == "raw" and item.kind != "final policies"
        return (*METHODS, SHORTER) if shorter else METHODS

    def targets(self, env: str, units: str) -> Targets:
        """Return the targets: published in paper units, fixed beforehand in raw ones."""
        if units == "paper":
            return next(table.targets for table in published().tables.values() if table.env == env)
        return QUICK_TARGETS if self.quick else honest(env).targets

    def user_weights(self, item: Item, units: str) -> dict[str, tuple[float, ...]]:
        """Return each user's weights of the objectives. Normalised utilities are linear, too, with other weights.

        In paper units normalising divides all objectives by the same constant, which changes no decision.
        """
        span = honest(item.env).span if item.normalised and units == "raw" else None
        return {user: weights if span is None else _normalised(weights, span) for user, weights in USERS.items()}

    def cells(self, item: Item, units: str) -> list[Cell]:
        """Return the runs that an item needs."""
        goals = self.goals(item, units)
        seeds = self.seeds_of(item)
        cells = [self.interactive(item, units, goal, seed) for goal in goals for seed in seeds]
        baselines = self.methods(item, units)[1:]
        return cells + [self.pgmorl(item, units, seed, method) for method in baselines for seed in seeds]

    def later(self, item: Item, units: str) -> list[Cell]:
        """Return those of an item's runs that are made after the other runs of all items."""
        if SHORTER not in self.methods(item, units):
            return []
        return [self.pgmorl(item, units, seed, SHORTER) for seed in self.seeds_of(item)]

    def cell(self, item: Item, units: str, method: str, goal: str, seed: int) -> Cell:
        """Return the run of a method for a user or target."""
        if method == "interactive":
            return self.interactive(item, units, goal, seed)
        return self.pgmorl(item, units, seed, method)

    def interactive(self, item: Item, units: str, goal: str, seed: int) -> Cell:
        """Return the interactive run for a user, or for a target."""
        to_target = item.kind == "steps to targets"
        user = self.goals(item, units)[goal]
        name = "target" if to_target else "user" if user == goal else "normalised"
        return self._cell(item.env, units, "interactive", user, f"{name}-{goal}", seed, to_target)

    def pgmorl(self, item: Item, units: str, seed: int, method: str = "pgmorl") -> Cell:
        """Return PGMORL's run for all users and targets; `method` may be SHORTER.

        With a constant learning rate a run is the beginning of a longer one, so that the longest serves for all; a
        rate that falls over the budget makes them different runs.
        """
        longest = self._cell(item.env, units, method, "A", "to-cap", seed, to_cap=True)
        ppo = longest.config.ppo
        if item.kind == "steps to targets" or ppo.learning_rate == ppo.final_learning_rate:
            return longest
        return self._cell(item.env, units, method, "A", "to-budget", seed, to_cap=False)

    def steps(self, item: Item) -> int:
        """Return the budget after which an item looks at a run."""
        return self._steps(item.env, item.kind == "steps to targets")

    def pilots(self, env: str) -> list[Cell]:
        """Return runs of both methods on other seeds, in raw units, on which targets are chosen."""
        item = next(item for item in ITEMS.values() if item.env == env and item.kind == "greatest utility")
        seeds = self.seeds or (QUICK_SEEDS if self.quick else PILOT_SEEDS)
        return [self.interactive(item, "raw", goal, seed) for goal in USERS for seed in seeds] + [
            self.pgmorl(item, "raw", seed) for seed in seeds
        ]

    def goals(self, item: Item, units: str) -> dict[str, str]:
        """Return the decision maker, as a config has it, of each user or target by name."""
        if item.kind == "steps to targets":
            unscaled = ",unscaled" if units == "paper" else ""
            targets = self.targets(item.env, units).items()
            return {name: f"target={_listed(target)}{unscaled}" for name, target in targets}
        weights = self.user_weights(item, units)
        return {user: user if weights[user] == USERS[user] else f"weights={_listed(weights[user])}" for user in USERS}

    def _steps(self, env: str, to_cap: bool) -> int:
        if self.quick:
            return QUICK_STEPS["targets" if to_cap else "users"]
        cap = next(table.cap_steps for table in published().tables.values() if table.env == env)
        return cap if to_cap else USER_STEPS[env]

    def _cell(self, env: str, units: str, method: str, user: str, goal: str, seed: int, to_cap: bool) -> Cell:
        kind = "interactive" if method == "interactive" else "pgmorl"
        chosen = {"env": env, "method": kind, "user": user, "seed": seed, "checkpoints": {"keep": 2}}
        # In raw units learning is ours, and the search the paper's.
        config = resolve("paper" if units == "paper" else "default", None, merged(PAPER_RULE, chosen))
        if units == "paper":
            config = config.replace(**AUTHORS, reference_point=REFERENCE[env])
        if self.quick:
            config = config.replace(**QUICK)
        if method == SHORTER:
            config = config.replace(population={"warmup_iterations": SHORTER_WARM_UP[self.quick]})
        key = f"{NAMES[env]}-{units}-{method}-{goal}-seed-{seed}"
        return Cell(key, config.replace(steps=self._steps(env, to_cap)))


def named(method: str) -> str:
    """Return the name of a method in a sentence."""
    return METHOD_NAMES[method]


def in_order(items: Sequence[Item], units: Sequence[str]) -> Iterator[tuple[Item, str]]:
    """Yield every item in each kind of units, in the order in which their runs are made."""
    for unit in units:
        for item in items:
            yield item, unit


def _normalised(weights: Sequence[float], span: Sequence[float]) -> tuple[float, ...]:
    """Return the weights of w . (z / span), summing to one."""
    divided = [weight / each for weight, each in zip(weights, span, strict=True)]
    return tuple(round(each / sum(divided), 6) for each in divided)


def _listed(numbers: Sequence[float]) -> str:
    return ",".join(f"{number:g}" for number in numbers)

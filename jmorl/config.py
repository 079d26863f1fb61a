"""Every setting of a run: frozen, validated, and the presets.

A `Config` is made by `resolve`: preset, then config file, then flags, each overriding the one before. All
problems are reported at once, as a `ConfigError`. The letters P, E, T, K, L, M are those of the README.
"""

import hashlib
import json
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeVar, get_args, get_origin

import pydantic
import tomli_w
from pydantic import Field, ValidationInfo, field_validator, model_validator

import envs
from jmorl.decision.users import parse_user
from jmorl.search.pareto import MOST_OBJECTIVES

Count = Annotated[int, Field(ge=1, lt=2**31)]  # as large as JAX takes
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]


C = TypeVar("C", bound="Section")


class ConfigError(ValueError):
    """A config that cannot be run. `problems` has one line for each thing that is wrong."""

    def __init__(self, problems: list[str]):
        self.problems = problems
        super().__init__("\n".join(problems))


class Section(pydantic.BaseModel):
    """A group of settings: immutable, hashable, unknown names refused."""

    model_config = pydantic.ConfigDict(frozen=True, extra="forbid", validate_default=True)

    @model_validator(mode="before")
    @classmethod
    def _split_lists(cls, values: Any) -> Any:
        """A list may be written as on the command line: `64,64`."""
        if not isinstance(values, Mapping):
            return values
        return {name: _split(cls, name, value) for name, value in values.items()}


def _split(section: type[Section], name: str, value: Any) -> Any:
    field = section.model_fields.get(name)
    if field is None or not isinstance(value, str):
        return value
    kinds = (field.annotation, *get_args(field.annotation))
    return (value.split(",") if value else []) if any(get_origin(kind) is tuple for kind in kinds) else value


class PopulationConfig(Section):
    """How many agents are trained, and how long between two questions."""

    agents: Count = Field(6, description="P, agents trained side by side")
    warmup_iterations: Count = Field(10, description="K, PPO iterations before the first question")
    iterations: Count = Field(10, description="L, PPO iterations in a generation")


class PPOConfig(Section):
    """Multi-objective PPO: how an agent learns from its rollouts."""

    environments: Count = Field(4, description="E, environments of each agent")
    rollout_steps: Count = Field(1000, description="T, steps of each environment in an iteration")
    epochs: Count = Field(10, description="passes over each batch of E*T steps")
    minibatches: Count = Field(32, description="minibatches in an epoch; divides E*T")
    learning_rate: Positive = Field(3e-4, description="of Adam, at the start of a run")
    final_learning_rate: Positive = Field(
        3e-4, description="of Adam, once the budget is used; linear in between, by generation"
    )
    adam_epsilon: Positive = Field(1e-5, description="of Adam")
    discount: Annotated[float, Field(gt=0, le=1)] = Field(0.995, description="gamma")
    gae_lambda: Annotated[float, Field(ge=0, le=1)] = Field(0.95, description="lambda of the advantage estimation")
    clip: Positive = Field(0.2, description="range of the policy ratio, and of the value change")
    value_coefficient: NonNegative = Field(0.5, description="weight of the value loss")
    entropy_coefficient: NonNegative = Field(0.0, description="weight of the entropy bonus")
    action_bound_coefficient: NonNegative = Field(
        0.0, description="weight of the penalty on mean actions outside the environment's box"
    )
    max_gradient_norm: Positive = Field(0.5, description="one global norm over all parameters")
    initial_log_std: Finite = Field(0.0, description="log standard deviation of a new agent's actions")
    noise_correlation: Annotated[float, Field(ge=0, lt=1)] = Field(
        0.0, description="of the exploration noise of successive actions"
    )
    hidden_sizes: Annotated[tuple[Count, ...], Field(min_length=1)] = Field(
        (64, 64), description="hidden layers of actor and critic"
    )
    weights_on: Literal["raw", "scaled"] = Field(
        "raw", description="weights act on the objectives in raw units, or in units of their running deviation"
    )

    @field_validator("minibatches")
    @classmethod
    def _divides_batch(cls, minibatches: int, info: ValidationInfo) -> int:
        if {"environments", "rollout_steps"} <= info.data.keys():
            batch = info.data["environments"] * info.data["rollout_steps"]
            if batch % minibatches:
                raise ValueError(f"{minibatches} minibatches do not divide a batch of E*T = {batch} steps")
        return minibatches


class EvaluationConfig(Section):
    """How policies are scored. The defaults give a number the same meaning in every run; the paper's units do not."""

    episodes: Count = Field(64, description="episodes of each evaluation")
    actions: Literal["deterministic", "sampled"] = Field(
        "deterministic",
        description="the mean action from the same starts for every policy, or sampled actions from fresh starts",
    )
    units: Literal["raw", "paper"] = Field(
        "raw", description="mean undiscounted return, or the paper's: discounted, rewards over their running deviation"
    )
    scale_discount: Annotated[float, Field(gt=0, le=1)] = Field(
        0.995, description="paper units: gamma of the sums whose running deviation divides rewards"
    )


class SearchConfig(Section):
    """Which policy is trained next, and with which weights."""

    delta: NonNegative = Field(0.1, description="slack of the bounds, z - delta sqrt(s |z|)")
    bounds_scale: Literal["range", "one"] = Field(
        "range", description="s in the bounds: the archive's range of each objective, or 1 (the paper)"
    )
    gain_within: Literal["bounds", "front"] = Field(
        "bounds", description="interactive: measure gains inside the bounds, or over the whole front (the paper)"
    )
    value_scale: Literal["range", "none"] = Field(
        "range", description="search in values scaled by the archive's range, or in values less the reference point"
    )
    sparsity_weight: NonNegative = Field(1.0, description="alpha, cost of a sparse front against its hypervolume")
    weight_divisions: Count = Field(
        10, description="steps on each edge of the grid of candidate weights; fewer where it would have over 100"
    )
    buffer_bins: Annotated[int, Field(ge=1, le=10_000)] = Field(100, description="directions of the performance buffer")
    buffer_size: Count = Field(4, description="policies kept in each direction")


class CheckpointConfig(Section):
    """What is kept to resume a run, and to branch off it."""

    keep: Count = Field(20, description="generations whose whole state is kept, the last ones")


class Config(Section):
    """One run."""

    env: str = Field("mo-mountaincarcontinuous-v0", description="environment id, `ID,option=value`; see `jmorl envs`")
    method: Literal["interactive", "pgmorl"] = Field(
        "interactive", description="ask every generation, or only at the end"
    )
    user: str = Field(
        "A",
        description="who decides: A, B, C, weights=0.6,0.4[,chebyshev], target=-80,-42, terminal, script=FILE",
    )
    seed: Annotated[int, Field(ge=0, lt=2**32)] = Field(1, description="of all randomness")
    population: PopulationConfig = PopulationConfig()
    ppo: PPOConfig = PPOConfig()
    evaluation: EvaluationConfig = EvaluationConfig()
    search: SearchConfig = SearchConfig()
    checkpoints: CheckpointConfig = CheckpointConfig()
    steps: Annotated[int, Field(ge=1, lt=2**63)] = Field(
        2_500_000, description="budget of environment steps used for learning"
    )
    reference_point: tuple[Finite, ...] = Field(
        (), description="of the reported hypervolume; empty: a tenth of the range below the first policies"
    )

    @field_validator("env")
    @classmethod
    def _known_environment(cls, env: str) -> str:
        objectives = len(envs.make(env).objectives)
        if objectives > MOST_OBJECTIVES:
            raise ValueError(f"{env!r} has {objectives} objectives; a run can have {MOST_OBJECTIVES} at most")
        return env

    @field_validator("user")
    @classmethod
    def _known_user(cls, user: str, info: ValidationInfo) -> str:
        parse_user(user, len(envs.make(info.data["env"]).objectives) if "env" in info.data else None)
        return user

    @field_validator("steps")
    @classmethod
    def _leaves_a_generation(cls, steps: int, info: ValidationInfo) -> int:
        if {"population", "ppo"} <= info.data.keys():
            population, ppo = info.data["population"], info.data["ppo"]
            iteration = population.agents * ppo.environments * ppo.rollout_steps
            if steps // iteration <= population.warmup_iterations:
                least = iteration * (population.warmup_iterations + 1)
                raise ValueError(f"{steps} steps end within the warm-up; a first generation starts at {least}")
        return steps

    @field_validator("reference_point")
    @classmethod
    def _one_per_objective(cls, point: tuple[float, ...], info: ValidationInfo) -> tuple[float, ...]:
        if point and "env" in info.data:
            objectives = len(envs.make(info.data["env"]).objectives)
            if len(point) != objectives:
                raise ValueError(f"{len(point)} values for {objectives} objectives")
        return point

    @property
    def steps_per_iteration(self) -> int:
        """P*E*T environment steps."""
        return self.population.agents * self.ppo.environments * self.ppo.rollout_steps

    @property
    def iteration_budget(self) -> int:
        """A generation starts while fewer iterations than this are done."""
        return self.steps // self.steps_per_iteration

    def learning_rate(self, iterations_done: int) -> float:
        """That of a generation, or of the warm-up, which begins after so many iterations of the budget."""
        share = min(iterations_done / self.iteration_budget, 1.0)
        return (1 - share) * self.ppo.learning_rate + share * self.ppo.final_learning_rate

    def digest(self) -> str:
        """A hash of every setting: equal digests are equal runs."""
        return hashlib.sha256(json.dumps(self.model_dump(mode="json"), sort_keys=True).encode()).hexdigest()[:16]

    def replace(self, **changes: Any) -> Self:
        """A validated copy; sections are given as dicts of what changes in them."""
        return _validated(type(self), _merged(self.model_dump(), changes))

    def to_toml(self) -> str:
        """The config as a file that `resolve` reads back to the same config."""
        return tomli_w.dumps(self.model_dump(mode="json"))


_PAPER_CAR = {
    "population": {"agents": 6, "warmup_iterations": 10, "iterations": 10},
    "ppo": {"environments": 4, "rollout_steps": 1000, "discount": 0.995},
    "steps": 2_500_000,
    "reference_point": (-999.0, -999.0),
}

# Chosen by measurement: benchmarks/README.md, "The default preset".
_TUNED_CAR = {
    **_PAPER_CAR,
    "ppo": {
        "environments": 4,
        "rollout_steps": 1000,
        "discount": 0.999,
        "gae_lambda": 0.98,
        "learning_rate": 1e-3,
        "final_learning_rate": 2e-4,
        "noise_correlation": 0.5,
        "action_bound_coefficient": 3.0,
    },
    "search": {"delta": 0.2},
}

_PAPER_CHEETAH = {
    "population": {"agents": 6, "warmup_iterations": 40, "iterations": 40},
    "ppo": {"environments": 4, "rollout_steps": 400, "discount": 0.99},
    "evaluation": {"episodes": 16, "scale_discount": 0.99},
    "steps": 5_000_000,
    "reference_point": (-100.0, -6000.0),
}

# As many steps in a batch, from more environments at once, and half as many updates from it. The first question waits
# until policies run: bounds around a policy that stands still or crawls shut out every gait that costs more.
_TUNED_CHEETAH = {
    **_PAPER_CHEETAH,
    "population": {"agents": 6, "warmup_iterations": 120, "iterations": 40},
    "ppo": {"environments": 16, "rollout_steps": 100, "minibatches": 16, "discount": 0.99},
}

# preset -> environment -> what differs from the defaults above
PRESETS: Mapping[str, Mapping[str, Mapping[str, Any]]] = {
    "default": {"mo-halfcheetah-v5": _TUNED_CHEETAH, "mo-mountaincarcontinuous-v0": _TUNED_CAR},
    "paper": {"mo-halfcheetah-v5": _PAPER_CHEETAH, "mo-mountaincarcontinuous-v0": _PAPER_CAR},
}


def resolve(preset: str = "default", file: Path | None = None, overrides: Mapping[str, Any] | None = None) -> Config:
    """Preset, then config file (TOML), then overrides (nested; strings are parsed), validated.

    Raises ConfigError with every problem of all three. An environment without an entry in the preset
    takes the general defaults.
    """
    problems = []
    if preset not in PRESETS:
        problems.append(f"preset: unknown preset {preset!r}; known: {', '.join(PRESETS)}")
    from_file: dict[str, Any] = {}
    if file is not None:
        try:
            from_file = tomllib.loads(file.read_text())
        except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
            problems.append(f"config: cannot read {file}: {error}")
    chosen = _merged(from_file, overrides or {})
    env = chosen.get("env", Config.model_fields["env"].default)
    base = PRESETS.get(preset, {}).get(envs.plain_id(env), {}) if isinstance(env, str) else {}
    return _validated(Config, _merged(base, chosen), problems)


def _merged(base: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """`changes` over `base`, section by section."""
    merged = dict(base)
    for name, value in changes.items():
        below = merged.get(name)
        merged[name] = _merged(below, value) if isinstance(below, Mapping) and isinstance(value, Mapping) else value
    return merged


def _validated(kind: type[C], values: Mapping[str, Any], problems: list[str] | None = None) -> C:
    problems = problems or []
    try:
        config = kind.model_validate(values)
    except pydantic.ValidationError as error:
        problems += [_sentence(each) for each in error.errors()]
    if problems:
        raise ConfigError(problems)
    return config


def _sentence(error: Any) -> str:
    """One pydantic error as `section.field: what is wrong`."""
    where = ".".join(str(part) for part in error["loc"])
    if error["type"] == "value_error":
        return f"{where}: {error['ctx']['error']}"
    return f"{where}: {error['msg'][0].lower()}{error['msg'][1:]}, not {error['input']!r}"

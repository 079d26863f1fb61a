"""Every setting of a run: frozen and validated.

A `Config` is made by `resolve`: preset, then config file, then flags, each overriding the one before. All
problems are reported at once, as a `ConfigError`. The letters P, E, T, K, L, M are those of the README.
"""

import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeVar

import numpy as np
import pydantic
import tomli_w
from pydantic import Field, ValidationInfo, field_validator

import envs
from envs.names import did_you_mean, nearest
from jmorl import config_format
from jmorl.decision.users import parse_user
from jmorl.learning.settings import EvaluationConfig, LearningConfig, PPOConfig
from jmorl.methods import registry
from jmorl.presets import PRESETS, merged
from jmorl.search.settings import MOST_OBJECTIVES, SearchConfig
from jmorl.search.weights import evenly_spaced_weights
from jmorl.settings import Count, Finite, NonNegative, Section

C = TypeVar("C", bound="Section")

# What pydantic's errors say of a value, by their types.
MUST = {
    **dict.fromkeys(("int_parsing", "int_parsing_size", "int_type", "int_from_float"), "a whole number"),
    **dict.fromkeys(("float_parsing", "float_type"), "a number"),
    "finite_number": "a finite number",
    "greater_than": "above {gt}",
    "greater_than_equal": "at least {ge}",
    "less_than": "below {lt}",
    "less_than_equal": "at most {le}",
    "string_type": "a text",
    "tuple_type": "numbers separated by commas",
    "too_short": "{min_length} number or more",
    **dict.fromkeys(("model_type", "model_attributes_type"), "a section, with settings of its own"),
}


class ConfigError(ValueError):
    """A config that cannot be run. `problems` has one line for each thing that is wrong."""

    def __init__(self, problems: list[str]):
        self.problems = problems
        super().__init__("\n".join(problems))


class PopulationConfig(Section):
    """How many agents are trained, and how long between two questions."""

    agents: Count = Field(6, description="P, agents trained side by side")
    warmup_iterations: Count = Field(10, description="K, PPO iterations before the first question")
    iterations: Count = Field(10, description="L, PPO iterations in a generation")
    weights: tuple[NonNegative, ...] = Field(
        (), description="weights of the first agents, M numbers for each agent in turn; empty: evenly spread"
    )


class CheckpointConfig(Section):
    """What is kept to resume a run, and to branch off it."""

    keep: Count = Field(20, description="generations whose whole state is kept, the last ones")


class Config(Section):
    """One run."""

    env: str = Field("mo-mountaincarcontinuous-v0", description="environment id, `ID,option=value`; see `jmorl envs`")
    method: str = Field(
        "interactive",
        description="how policies are searched for: interactive (ask between generations), pgmorl (ask at the end), "
        "fixed (each agent keeps its weights), or MODULE:NAME of your own",
    )
    user: str = Field(
        "A",
        description="who decides: A, B, C, weights=0.6,0.4[,chebyshev or concave=...], target=-80,-42, terminal, "
        "script=FILE; artificial ones may err (A,random=0.2), change their mind, or have limits: see the README",
    )
    ask: Literal["always", "unsure"] = Field(
        "unsure", description="whom: the user always, or only where their answers so far leave open what they prefer"
    )
    question: Literal["front", "few", "pair", "rank"] = Field(
        "front",
        description="what is asked: the best of the whole front, the best of the few policies between which a choice "
        "tells most, the better one of a pair, or to rank a few",
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

    @field_validator("method")
    @classmethod
    def _known_method(cls, method: str) -> str:
        registry.check(method)
        return method

    @field_validator("population")
    @classmethod
    def _weights_of_every_agent(cls, population: PopulationConfig, info: ValidationInfo) -> PopulationConfig:
        if population.weights and "env" in info.data:
            objectives = len(envs.make(info.data["env"]).objectives)
            expected = population.agents * objectives
            if len(population.weights) != expected:
                raise ValueError(
                    f"weights has {len(population.weights)} numbers, but {population.agents} agents with {objectives} "
                    f"objectives need {expected}"
                )
            if not np.reshape(population.weights, (-1, objectives)).any(axis=1).all():
                raise ValueError("weights has an agent with nothing but zeros")
        return population

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

    @field_validator("search")
    @classmethod
    def _blends_in_raw_units(cls, search: SearchConfig, info: ValidationInfo) -> SearchConfig:
        if search.final_blends and "evaluation" in info.data and info.data["evaluation"].units == "paper":
            raise ValueError("final_blends must be 0 in paper units: scores are never made anew there, but blends' are")
        return search

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
        """Return the learning rate of what is trained after so many iterations of the budget."""
        share = min(iterations_done / self.iteration_budget, 1.0)
        return (1 - share) * self.ppo.learning_rate + share * self.ppo.final_learning_rate

    @property
    def learning(self) -> LearningConfig:
        """The settings that the compiled programs depend on."""
        return LearningConfig(self.population.agents, self.ppo, self.evaluation)

    def first_weights(self) -> np.ndarray:  # [P, M]
        """Return the weights of the warm-up: those that are given, scaled to a sum of one, or evenly spread ones."""
        objectives = len(envs.make(self.env).objectives)
        if not self.population.weights:
            return evenly_spaced_weights(objectives, self.population.agents)
        given = np.reshape(self.population.weights, (-1, objectives))
        return np.asarray(given / given.sum(axis=1, keepdims=True))

    def identity(self) -> str:
        """Return a short hash of all settings that change results: equal identities are equal runs."""
        return config_format.identity(self.model_dump(mode="json"))

    def is_identified_by(self, stored: str) -> bool:
        """Return whether a stored identity, of this format or an earlier one, is that of these settings."""
        settings = self.model_dump(mode="json")
        return stored in (config_format.identity(settings), config_format.identity_of_format_1(settings))

    def replace(self, **changes: Any) -> Self:
        """Return a validated copy; sections are given as dicts of what changes in them."""
        return _validated(type(self), merged(self.model_dump(), changes))

    def to_toml(self) -> str:
        """Return the config as a file that `resolve` reads back to the same config."""
        return tomli_w.dumps({"format": config_format.FORMAT, **self.model_dump(mode="json")})


def resolve(preset: str = "default", file: Path | None = None, overrides: Mapping[str, Any] | None = None) -> Config:
    """Return preset, then config file (TOML), then overrides, validated.

    Overrides are nested, or named `section.field`; strings are parsed.
    An environment without an entry in the preset takes what that sets everywhere. A file that a run wrote has every
    setting; one that was added since means what was done before there was such a setting, whatever the preset. Raises
    ConfigError with every problem of all three.
    """
    problems = []
    if preset not in PRESETS:
        known = f"known: {', '.join(PRESETS)}{did_you_mean(nearest(preset, PRESETS))}"
        problems.append(f"preset: unknown preset {preset!r}; {known}")
    from_file: dict[str, Any] = {}
    if file is not None:
        try:
            from_file = _by_section(tomllib.loads(file.read_text(encoding="utf-8-sig")))
        except UnicodeDecodeError:
            problems.append(f"config: cannot read {file}: it is not a text in UTF-8, as TOML has to be")
        except (OSError, ValueError) as error:
            problems.append(f"config: cannot read {file}: {error}")
    written = config_format.format_of(from_file)
    from_file.pop("format", None)
    if written is not None and written > config_format.FORMAT:
        problems.append(
            f"config: {file} has format {written}; this jmorl knows up to {config_format.FORMAT}: update it"
        )
    given: dict[str, Any] = {}
    try:
        given = _by_section(overrides or {})
    except ValueError as error:
        problems.append(str(error))
    chosen = merged(from_file, given)
    env = chosen.get("env", Config.model_fields["env"].default)
    base = PRESETS[preset].settings(envs.plain_id(env) if isinstance(env, str) else "") if preset in PRESETS else {}
    if written is not None:
        base = config_format.before_settings_were_added()
    return _validated(Config, merged(base, chosen), problems)


def _by_section(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings, nested, whose names may be written as flags are: `population.warmup-iterations`.

    Raise ValueError for one given twice.
    """
    plain: dict[str, Any] = {}
    for written, value in settings.items():
        section, dot, rest = written.replace("-", "_").partition(".")
        inner = _by_section({rest: value}) if dot else _by_section(value) if isinstance(value, Mapping) else value
        both_are_sections = isinstance(inner, Mapping) and isinstance(plain.get(section), Mapping)
        twice = inner.keys() & plain[section].keys() if both_are_sections else {section} & plain.keys()
        if twice:
            raise ValueError(f"{min(twice)} is given twice")
        plain[section] = {**plain[section], **inner} if both_are_sections else inner
    return plain


def _validated(kind: type[C], values: Mapping[str, Any], problems: list[str] | None = None) -> C:
    problems = problems or []
    try:
        config = kind.model_validate(values)
    except pydantic.ValidationError as error:
        found = error.errors()
        within = {each["loc"][:-1] for each in found}
        # Of a list whose parts are wrong, its length is no news.
        problems += [_sentence(each) for each in found if each["type"] != "too_short" or each["loc"] not in within]
    if problems:
        raise ConfigError(problems)
    return config


def _sentence(error: Any) -> str:
    """One pydantic error as `section.field: what is wrong`."""
    where = ".".join(str(part) for part in error["loc"])
    match error["type"]:
        case "value_error":
            return f"{where}: {error['ctx']['error']}"
        case "extra_forbidden":
            return f"{where}: there is no such setting{did_you_mean(nearest(where, _setting_names(Config)))}"
        case "literal_error":
            known = re.findall("'([^']*)'", error["ctx"]["expected"])
            near = did_you_mean(nearest(str(error["input"]), known))
            return f"{where}: must be {error['ctx']['expected']}, not {error['input']!r}{near}"
    if error["type"] in MUST:
        return f"{where}: must be {MUST[error['type']].format(**error.get('ctx', {}))}, not {error['input']!r}"
    return f"{where}: {error['msg'][0].lower()}{error['msg'][1:]}, not {error['input']!r}"


def _setting_names(section: type[Section], prefix: str = "") -> Iterator[str]:
    """Every setting, as `ppo.epochs`, and every section."""
    for name, field in section.model_fields.items():
        yield f"{prefix}{name}"
        if isinstance(field.annotation, type) and issubclass(field.annotation, Section):
            yield from _setting_names(field.annotation, f"{prefix}{name}.")

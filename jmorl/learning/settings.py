"""The settings of the device side: all that a compiled program depends on besides the environment."""

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field, ValidationInfo, field_validator

from jmorl.settings import LARGEST, Count, NonNegative, Positive, Section


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
    initial_log_std: Annotated[float, Field(ge=-LARGEST, le=LARGEST)] = Field(
        0.0, description="log standard deviation of a new agent's actions"
    )
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
    confirmation_episodes: Annotated[int, Field(ge=0)] = Field(
        128, description="fresh episodes that score the finalists anew before the last question; 0: none (the paper)"
    )
    scale_discount: Annotated[float, Field(gt=0, le=1)] = Field(
        0.995, description="paper units: gamma of the sums whose running deviation divides rewards"
    )


@dataclass(frozen=True)
class LearningConfig:
    """What a population's compiled programs are made from. Runs with equal ones can share them."""

    agents: int  # P
    ppo: PPOConfig
    evaluation: EvaluationConfig

"""What the presets set, by environment: data only."""

from collections.abc import Mapping
from typing import Any

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

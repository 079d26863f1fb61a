"""The settings of the search."""

from typing import Annotated, Literal

from pydantic import Field

from jmorl.settings import Count, NonNegative, Section

MOST_OBJECTIVES = 31  # of a hypervolume that moocore takes


class SearchConfig(Section):
    """Which policy is trained next, and with which weights."""

    delta: NonNegative = Field(0.1, description="slack of the bounds, z - delta sqrt(s |z|)")
    bounds_scale: Literal["range", "one"] = Field(
        "range",
        description="s in the bounds: the archive's range of each objective, or 1 (the paper, in its own units)",
    )
    least_slack: NonNegative = Field(
        0.02, description="slack of the bounds at least, as a share of the archive's range; 0: none (the paper)"
    )
    least_within: Annotated[int, Field(ge=0)] = Field(
        3,
        description="interactive: widen the bounds until so many of the buffer lie within; 0: never (the paper)",
    )
    outside_share: Annotated[float, Field(ge=0, le=1)] = Field(
        0.17,
        description="interactive: share of the tasks that train scouts while the choice stays; 0: none (the paper)",
    )
    gain_within: Literal["bounds", "front"] = Field(
        "bounds",
        description="interactive: measure gains inside the bounds, or over the whole front (the paper, its own units)",
    )
    value_scale: Literal["range", "none"] = Field(
        "range", description="search in values scaled by the archive's range, or in values less the reference point"
    )
    optimism: NonNegative = Field(
        0.0, description="tasks by what may come: the expected values and so many times their spread; 0: PGMORL"
    )
    sparsity_weight: NonNegative = Field(1.0, description="alpha, cost of a sparse front against its hypervolume")
    weight_divisions: Count = Field(
        10, description="steps on each edge of the grid of candidate weights; fewer where it would have over 100"
    )
    final_blends: Annotated[int, Field(ge=0)] = Field(
        0,
        description="blends of policies that may join the front before the last question; 0: none (the paper)",
    )
    buffer_bins: Annotated[int, Field(ge=1, le=10_000)] = Field(100, description="directions of the performance buffer")
    buffer_size: Count = Field(4, description="policies kept in each direction")

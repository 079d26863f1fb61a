"""What every group of settings has in common: immutable, validated, refusing unknown names."""

from collections.abc import Mapping
from typing import Annotated, Any, get_args, get_origin

import numpy as np
import pydantic
from pydantic import Field, model_validator

Count = Annotated[int, Field(ge=1, le=2**31 - 1)]  # compiled programs count in 32 bits
LARGEST = float(np.finfo(np.float32).max)  # which they compute in
Positive = Annotated[float, Field(gt=0, le=LARGEST, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, le=LARGEST, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]


class Section(pydantic.BaseModel):
    """A group of settings: immutable, hashable, unknown names refused."""

    model_config = pydantic.ConfigDict(frozen=True, extra="forbid", validate_default=True)

    @classmethod
    def summary(cls) -> str:
        """Return what the settings are about, in a line; nothing where Python was told to drop such texts."""
        return (cls.__doc__ or "").partition("\n")[0].rstrip(".")

    @model_validator(mode="before")
    @classmethod
    def _split_lists(cls, values: Any) -> Any:
        """Split lists that are written as on the command line: `64,64`."""
        if not isinstance(values, Mapping):
            return values
        return {name: _split(cls, name, value) for name, value in values.items()}


def _split(section: type[Section], name: str, value: Any) -> Any:
    field = section.model_fields.get(name)
    if field is None or not isinstance(value, str):
        return value
    kinds = (field.annotation, *get_args(field.annotation))
    return (value.split(",") if value else []) if any(get_origin(kind) is tuple for kind in kinds) else value

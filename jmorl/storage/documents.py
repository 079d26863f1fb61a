"""JSON documents of a run, checked when they are read: whoever uses one relies on its fields."""

from collections.abc import Mapping
from typing import Any

from pydantic import TypeAdapter, ValidationError
from pydantic_core import from_json


class DocumentError(ValueError):
    """A document without the fields that it should have; the message names it and everything that is wrong."""


def json_object(text: bytes | str, name: str) -> dict[str, Any]:
    """Return the object that a JSON text holds. Raises DocumentError, calling the document `name`."""
    try:
        fields = from_json(text)
    except ValueError as error:
        raise DocumentError(f"{name} is not valid JSON: {error}") from None
    if not isinstance(fields, dict):
        raise DocumentError(f"{name} is not a JSON object")
    return fields


def check_fields(fields: Mapping[str, Any], shape: TypeAdapter[Any], name: str) -> None:
    """Raise DocumentError, calling the document `name`, unless the fields have the shape."""
    try:
        shape.validate_python(fields, strict=True)
    except ValidationError as error:
        problems = "; ".join(_problem(each) for each in error.errors())
        raise DocumentError(f"{name} is damaged: {problems}") from None


def _problem(error: Any) -> str:
    """Return one of pydantic's errors as `field: what is wrong`."""
    place = ".".join(map(str, error["loc"]))
    return f"{place} is missing" if error["type"] == "missing" else f"{place}: {error['msg'].lower()}"

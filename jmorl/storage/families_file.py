"""The file of a run's families: what lies between neighbours of the front that was blended last.

Each link has the ids of two neighbours, the score of the blend half-way between them, and its loss: how far it lies
below the line between them, as a share of the front's range. Families are the policies that links hold together whose
loss is small.
"""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import TypeAdapter
from typing_extensions import TypedDict

from jmorl.events import Blended
from jmorl.search.families import TOLERANCE, Link
from jmorl.storage.documents import check_fields, json_object


class _Link(TypedDict):
    ends: list[int]
    values: list[float]
    loss: float


class _Families(TypedDict):
    """What is relied on of the file; there is more."""

    generation: int
    links: list[_Link]
    families: list[list[int]]


_FAMILIES = TypeAdapter(_Families)


@dataclass(frozen=True)
class Families:
    """What a file tells."""

    generation: int  # of the blending
    links: tuple[Link, ...]
    families: tuple[tuple[int, ...], ...]  # ids


def families_document(event: Blended) -> dict[str, Any]:
    """Return what the file keeps of a blending."""
    blending = event.blending
    return {
        "generation": event.state.generation,
        "tolerance": TOLERANCE,
        "tried": blending.tried,
        "links": [asdict(link) | {"values": link.values.tolist()} for link in blending.links],
        "families": blending.families,
    }


def read_families(path: Path) -> Families:
    """Read the file. Raises OSError, and DocumentError naming the file."""
    document = json_object(path.read_bytes(), str(path))
    check_fields(document, _FAMILIES, str(path))
    links = tuple(
        Link((link["ends"][0], link["ends"][1]), np.array(link["values"]), link["loss"]) for link in document["links"]
    )
    return Families(document["generation"], links, tuple(tuple(each) for each in document["families"]))

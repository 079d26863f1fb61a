"""The file of notes: names, favourites and lines of text that somebody has given to a run and to its policies.

It is for people alone. It is no part of what a run is, and no run needs it: a file that cannot be read is told of, and
left as it is until somebody puts it right.
"""

import importlib.metadata
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, TypeAdapter
from typing_extensions import TypedDict

from jmorl.storage.documents import DocumentError, check_fields, json_object
from jmorl.storage.files import write_json
from jmorl.storage.layout import Layout
from jmorl.storage.versions import NewerFormat, check_format

FORMAT = 1
LONGEST_NAME, LONGEST_TEXT = 40, 2000  # characters


class _Note(TypedDict):
    name: Annotated[str, Field(max_length=LONGEST_NAME)]
    text: Annotated[str, Field(max_length=LONGEST_TEXT)]


class _PolicyNote(_Note):
    policy: Annotated[int, Field(ge=0)]
    favourite: bool


class _Notes(TypedDict):
    run: _Note
    policies: list[_PolicyNote]


_NOTES = TypeAdapter(_Notes)


class NotesError(ValueError):
    """A note that cannot be kept; the message says everything that is in its way."""


@dataclass(frozen=True)
class Note:
    """What somebody has noted about a run, or about a policy of it."""

    name: str = ""  # one line
    text: str = ""  # some lines
    favourite: bool = False  # of policies only

    @property
    def quoted(self) -> str:
        """Return the name as it stands in a text: `"careful one"`; nothing without a name."""
        return f'"{self.name}"' if self.name else ""

    def named(self, what: str) -> str:
        """Return what this is about with its name, if it has one: `policy 12 "careful one"`."""
        return f"{what} {self.quoted}".rstrip()


NOTHING = Note()


@dataclass(frozen=True)
class Notes:
    """All that is noted about a run."""

    run: Note = NOTHING
    policies: Mapping[int, Note] = field(default_factory=dict)  # id -> note; none that says nothing
    problem: str = ""  # why the file could not be read, a sentence

    def policy(self, policy_id: int) -> Note:
        """Return what is noted about a policy."""
        return self.policies.get(policy_id, NOTHING)

    @property
    def favourites(self) -> list[int]:
        """Return the ids of the favourites, in order."""
        return sorted(policy_id for policy_id, note in self.policies.items() if note.favourite)

    def before(self, policies: int) -> "Notes":
        """Return the notes about a run's first policies, which a branch shares with it."""
        return Notes(policies={policy_id: note for policy_id, note in self.policies.items() if policy_id < policies})


def read_notes(folder: Path) -> Notes:
    """Read the notes in a run folder. Without a file there are none; a damaged one has a problem in their place."""
    path = Layout(folder).notes
    try:
        document = json_object(path.read_bytes(), str(path))
        check_format(document, FORMAT, str(path))
        check_fields(document, _NOTES, str(path))
    except FileNotFoundError:
        return Notes()
    except OSError as error:
        return Notes(problem=f"{path} cannot be read: {error.strerror}")
    except (DocumentError, NewerFormat) as error:
        return Notes(problem=str(error))
    about = {each["policy"]: _tidy(each["name"], each["text"], each["favourite"]) for each in document["policies"]}
    return Notes(_tidy(document["run"]["name"], document["run"]["text"]), about)


def write_notes(folder: Path, notes: Notes) -> None:
    """Write or replace the notes in a run folder; without any there is no file. Raises OSError."""
    path = Layout(folder).notes
    if notes == Notes():
        path.unlink(missing_ok=True)
    else:
        write_json(path, _document(notes))


def change_note(
    folder: Path,
    policy: int | None,
    name: str | None = None,
    text: str | None = None,
    favourite: bool | None = None,
) -> None:
    """Change what is noted about a policy of the run in a folder, or about the run; None leaves a field as it is.

    Raises NotesError for what is too long, and for a file that cannot be read or written; nothing is changed then.
    """
    notes = read_notes(folder)
    if notes.problem:
        raise NotesError(f"{notes.problem}. Put it right, or delete it: nothing is noted before that")
    before = notes.run if policy is None else notes.policy(policy)
    note = _tidy(
        before.name if name is None else name,
        before.text if text is None else text,
        before.favourite if favourite is None else favourite,
    )
    _check_length(note)
    if policy is None:
        notes = replace(notes, run=note)
    else:
        others = {each: noted for each, noted in notes.policies.items() if each != policy}
        notes = replace(notes, policies=others if note == NOTHING else {**others, policy: note})
    try:
        write_notes(folder, notes)
    except OSError as error:
        raise NotesError(f"{Layout(folder).notes} cannot be written: {error.strerror}") from error


def _document(notes: Notes) -> dict[str, Any]:
    return {
        "format": FORMAT,
        "jmorl": importlib.metadata.version("jmorl"),
        "run": {"name": notes.run.name, "text": notes.run.text},
        "policies": [
            {"policy": policy_id, "name": note.name, "text": note.text, "favourite": note.favourite}
            for policy_id, note in sorted(notes.policies.items())
        ],
    }


def _tidy(name: str, text: str, favourite: bool = False) -> Note:
    """Return a note with its name on one line, and without characters that no screen shows."""
    words = filter(None, map(_printable, name.split()))
    lines = [_printable(line.expandtabs(4)).rstrip() for line in text.splitlines()]
    return Note(" ".join(words), "\n".join(lines).strip("\n"), favourite)


def _printable(text: str) -> str:
    return "".join(character for character in text if character.isprintable())


def _check_length(note: Note) -> None:
    fields = ("name", note.name, LONGEST_NAME), ("note", note.text, LONGEST_TEXT)
    problems = [
        f"the {what} has {len(text):,} characters, and may have {longest:,}"
        for what, text, longest in fields
        if len(text) > longest
    ]
    if problems:
        raise NotesError(f"Not kept: {'; '.join(problems)}")

"""Notes come back as they were given, and a file that is damaged keeps nothing from working."""

import json
import shutil

import pytest

from jmorl.storage.layout import Layout
from jmorl.storage.notes_file import Note, Notes, NotesError, change_note, read_notes, write_notes
from jmorl.storage.resume import branch, resume
from jmorl.storage.stored_run import read_run
from tests.resuming import follow, outcome

CAREFUL = Note("careful one", "Brakes early.\nNever slips.", favourite=True)
DAMAGED = {
    "half of it": ('{"format": 1, "ru', "is not valid JSON"),
    "a list": ("[]", "is not a JSON object"),
    "no text": ("\xff", "is not valid JSON"),
    "no format": ("{}", "format is missing"),
    "fields": (
        '{"format": 1, "run": {"name": 3}, "policies": [{"policy": -1, "name": "", "text": "", "favourite": 1}]}',
        "run.name: .*; run.text is missing; policies.0.policy: .*; policies.0.favourite: ",
    ),
    "too long": (
        json.dumps({"format": 1, "run": {"name": "n" * 41, "text": ""}, "policies": []}),
        "run.name: string should have at most 40 characters",
    ),
    "newer": ('{"format": 2, "jmorl": "9.9"}', "has format 2, written by jmorl 9.9"),
}


def damage(folder, text):
    (folder / "notes.json").write_bytes(text.encode("latin-1"))


def test_notes_come_back_and_each_change_leaves_the_others(tmp_path):
    assert read_notes(tmp_path) == Notes()
    change_note(tmp_path, 12, name=CAREFUL.name, text=CAREFUL.text)
    change_note(tmp_path, 12, favourite=True)
    change_note(tmp_path, 3, favourite=True)
    change_note(tmp_path, None, name="the slow way")
    notes = read_notes(tmp_path)
    assert notes == Notes(Note("the slow way"), {12: CAREFUL, 3: Note(favourite=True)})
    assert notes.favourites == [3, 12] and notes.policy(5) == Note()
    assert notes.policy(12).named("policy 12") == 'policy 12 "careful one"' and Note().named("run") == "run"


def test_what_says_nothing_any_more_is_gone(tmp_path):
    change_note(tmp_path, 12, name="careful one", favourite=True)
    change_note(tmp_path, 12, name="")
    assert read_notes(tmp_path).policies == {12: Note(favourite=True)}
    change_note(tmp_path, 12, favourite=False)
    assert not list(tmp_path.iterdir())


def test_a_name_is_one_line_and_nothing_moves_a_terminal(tmp_path):
    change_note(tmp_path, 1, name="  careful\n \x1b[31mone\x07 \u202e ", text="\n\na\tb \r\n\n\x1b[2Jc\ud800\n")
    assert read_notes(tmp_path).policy(1) == Note("careful [31mone", "a   b\n\n[2Jc")
    text = (tmp_path / "notes.json").read_text()
    (tmp_path / "notes.json").write_text(text.replace("careful", "\\u001b[31mcareful"))
    assert read_notes(tmp_path).policy(1).name == "[31mcareful [31mone"


def test_all_that_is_too_long_is_told_at_once_and_nothing_is_kept(tmp_path):
    change_note(tmp_path, 1, name="n" * 40, text="t" * 2000)
    before = (tmp_path / "notes.json").read_bytes()
    told = "Not kept: the name has 41 characters, and may have 40; the note has 2,001 characters, and may have 2,000"
    with pytest.raises(NotesError, match=told):
        change_note(tmp_path, 1, name="n" * 41, text="t" * 2001)
    assert (tmp_path / "notes.json").read_bytes() == before


@pytest.mark.parametrize("kind", DAMAGED)
def test_a_damaged_file_is_told_of_and_left_as_it_is(tmp_path, kind):
    text, message = DAMAGED[kind]
    damage(tmp_path, text)
    before = (tmp_path / "notes.json").read_bytes()
    with pytest.raises(NotesError, match=f"notes.json .*{message}.*[.] Put it right, or delete it"):
        change_note(tmp_path, 1, favourite=True)
    notes = read_notes(tmp_path)
    assert notes == Notes(problem=notes.problem) and str(tmp_path / "notes.json") in notes.problem
    assert (tmp_path / "notes.json").read_bytes() == before


def test_what_cannot_be_read_or_written_is_told_of(tmp_path):
    (tmp_path / "notes.json").mkdir()
    assert read_notes(tmp_path).problem == f"{tmp_path / 'notes.json'} cannot be read: Is a directory"
    with pytest.raises(NotesError, match="gone/notes.json cannot be written: No such file"):
        change_note(tmp_path / "gone", 1, favourite=True)


def test_a_branch_takes_over_the_notes_about_what_it_shares(whole, tmp_path):
    source = shutil.copytree(whole, tmp_path / "source")
    shared = sum(policy.generation <= 1 for policy in read_run(source).policies)
    for policy in (0, shared - 1, shared):
        change_note(source, policy, name=f"number {policy}", favourite=True)
    change_note(source, None, name="the first", text="Of this run alone.")
    branch(source, 1, tmp_path / "new").folder.close()
    assert read_notes(tmp_path / "new") == Notes(
        policies={policy: Note(f"number {policy}", favourite=True) for policy in (0, shared - 1)}
    )
    write_notes(source, Notes())
    branch(source, 1, tmp_path / "without").folder.close()
    assert not Layout(tmp_path / "without").notes.exists()


@pytest.mark.parametrize("kind", ["half of it", "newer"])
def test_no_run_needs_its_notes(whole, tmp_path, kind):
    source = shutil.copytree(whole, tmp_path / "source")
    damage(source, DAMAGED[kind][0])
    assert read_run(source).notes.problem
    continued = branch(source, 1, tmp_path / "new")
    assert any("notes.json" in note and "begins without notes" in note for note in continued.notes)
    path = follow(continued, events=3)
    damage(path, DAMAGED[kind][0])
    continued = resume(path)
    assert not any("notes.json" in note for note in continued.notes)
    follow(continued)
    (path / "notes.json").unlink()
    (path / "checkpoints" / "00000").symlink_to(whole / "checkpoints" / "00000")  # a branch has none before its own
    assert outcome(path)[1:] == outcome(whole)[1:]

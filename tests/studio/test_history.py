"""Runs in folders beside each other, as one tree."""

import json
import shutil

import pytest

from jmorl.storage.notes_file import change_note
from jmorl.storage.resume import branch
from jmorl.studio.history import free_folder, read_tree


@pytest.fixture
def runs(whole, tmp_path):
    """Copy the run; make two branches, a branch of one of them, and other folders."""
    shutil.copytree(whole, tmp_path / "first")
    for parent, generation, name in (("first", 2, "b"), ("first", 1, "a"), ("a", 1, "aa")):
        branch(tmp_path / parent, generation, tmp_path / name).folder.close()
    (tmp_path / "empty").mkdir()
    (tmp_path / "file").touch()
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken" / "config.toml").touch()
    (tmp_path / "broken" / "manifest.json").write_text("{")
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "config.toml").touch()
    (tmp_path / "other" / "manifest.json").write_text('{"format": 1}')
    return tmp_path


@pytest.mark.parametrize("opened", ["first", "a", "aa", "b"])
def test_every_branch_belongs_to_the_same_tree(runs, opened):
    tree = read_tree(runs / opened)
    assert [(each.name, each.depth, each.leaves_after) for each in tree] == [
        ("first", 0, -1),
        ("a", 1, 1),
        ("aa", 2, 1),
        ("b", 1, 2),
    ]
    assert [each.finished for each in tree] == [True, False, False, False]


def test_a_branch_has_the_questions_after_it_left(runs):
    lines = (runs / "first" / "decisions.jsonl").read_text().splitlines()
    generations = {each.name: [step.generation for step in each.steps] for each in read_tree(runs / "first")}
    assert generations == {"first": [json.loads(line)["generation"] for line in lines], "a": [], "aa": [], "b": []}


def test_without_its_parent_a_branch_is_the_first(runs):
    shutil.rmtree(runs / "first")
    assert [each.name for each in read_tree(runs / "aa")] == ["a", "aa"]


def test_a_free_folder_is_named_after_the_first_run(runs):
    assert free_folder(runs / "aa") == runs / "first-2"
    (runs / "first-2").mkdir()
    assert free_folder(runs / "first") == runs / "first-3"


def test_a_branch_has_the_name_that_it_was_given_beside_that_of_its_folder(runs):
    change_note(runs / "a", None, name="<b>slow</b>", text="With little fuel.")
    (runs / "b" / "notes.json").write_text("[")
    tree = {each.name: each for each in read_tree(runs / "first")}
    assert tree["a"].title == 'a "<b>slow</b>"' and tree["a"].noted.run.text == "With little fuel."
    assert tree["aa"].title == "aa" and "notes.json is not valid JSON" in tree["b"].noted.problem

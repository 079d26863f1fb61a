"""What is laid out keeps its place."""

from jmorl.studio.selection import Selection


def test_policies_keep_their_letters_and_the_oldest_makes_room():
    selection = Selection()
    for policy in (7, 8, 9):
        selection = selection.with_policy(policy)
    assert selection.letters == {7: "A", 8: "B", 9: "C"} and selection.focus == 9
    selection = selection.with_policy(8)
    assert selection.letters == {7: "A", 8: "B", 9: "C"} and selection.focus == 8
    selection = selection.with_policy(10)
    assert selection.letters == {10: "A", 8: "B", 9: "C"} and selection.focus == 10


def test_what_is_put_away_leaves_a_free_place():
    selection = Selection().with_policy(7).with_policy(8).without(7)
    assert selection.letters == {8: "B"} and selection.focus == 8
    assert selection.with_policy(9).letters == {9: "A", 8: "B"}
    assert selection.without(8).focus is None and not selection.without(8).letters
    assert selection.without(5).letters == selection.letters

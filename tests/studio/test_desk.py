"""What is laid out keeps its place."""

from jmorl.studio.desk import Desk


def test_policies_keep_their_letters_and_the_oldest_makes_room():
    desk = Desk()
    for policy in (7, 8, 9):
        desk = desk.with_policy(policy)
    assert desk.letters == {7: "A", 8: "B", 9: "C"} and desk.focus == 9
    desk = desk.with_policy(8)
    assert desk.letters == {7: "A", 8: "B", 9: "C"} and desk.focus == 8
    desk = desk.with_policy(10)
    assert desk.letters == {10: "A", 8: "B", 9: "C"} and desk.focus == 10


def test_what_is_put_away_leaves_a_free_place():
    desk = Desk().with_policy(7).with_policy(8).without(7)
    assert desk.letters == {8: "B"} and desk.focus == 8
    assert desk.with_policy(9).letters == {9: "A", 8: "B"}
    assert desk.without(8).focus is None and not desk.without(8).letters
    assert desk.without(5).letters == desk.letters

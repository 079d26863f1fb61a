"""The laws of the archive: the best of all that was offered, whatever the order."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from jmorl.search.archive import Archive
from jmorl.search.policy import Policy
from tests.search.policies import policies, policy

offers = (
    st.integers(2, 4)
    .flatmap(lambda m: arrays(float, st.tuples(st.integers(1, 12), st.just(m)), elements=st.integers(-2, 4).map(float)))
    .map(policies)
)


def as_set(archive: Archive) -> set[tuple[float, ...]]:
    return {tuple(member.values) for member in archive.members}


@given(offers)
def test_members_do_not_dominate_each_other_and_cover_all_that_was_offered(offered: list[Policy]) -> None:
    members = Archive().offer(offered).members
    for member in members:
        assert not any((other.values >= member.values).all() for other in members if other is not member)
    for each in offered:
        assert any((member.values >= each.values).all() for member in members)


@given(offers, st.randoms(use_true_random=False), st.integers(0, 12))
def test_order_and_grouping_do_not_matter(offered: list[Policy], random: object, cut: int) -> None:
    shuffled = list(offered)
    random.shuffle(shuffled)  # type: ignore[attr-defined]
    in_two_parts = Archive().offer(shuffled[:cut]).offer(shuffled[cut:])
    assert as_set(in_two_parts) == as_set(Archive().offer(offered))


@given(offers)
def test_offering_again_changes_nothing(offered: list[Policy]) -> None:
    archive = Archive().offer(offered)
    assert archive.offer(offered).members == archive.members
    assert archive.offer([]).members == archive.members


@given(offers)
def test_members_are_the_offered_records_in_their_order(offered: list[Policy]) -> None:
    archive = Archive().offer(offered)
    assert all(any(member is each for each in offered) for member in archive.members)
    assert all(a.id < b.id for a, b in pairwise(archive.members))


@given(offers)
def test_policy_and_score_never_drift_apart(offered: list[Policy]) -> None:
    scores = {each.id: each.values.copy() for each in offered}
    archive = Archive()
    for each in offered:
        archive = archive.offer([each])
    for member, values in zip(archive.members, archive.values, strict=True):
        np.testing.assert_array_equal(values, scores[member.id])
        assert member.snapshot == ("snapshot", member.id)


def test_equal_values_keep_the_first() -> None:
    first, second = policies([[1.0, 2.0], [1.0, 2.0]])
    assert Archive().offer([first, second]).members == (first,)
    assert Archive().offer([second]).offer([first]).members == (second,)


def test_archive_is_not_changed_by_an_offer() -> None:
    before = Archive().offer(policies([[1.0, 2.0]]))
    before.offer(policies([[5.0, 5.0]], first_id=1))
    assert as_set(before) == {(1.0, 2.0)}


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_values_that_are_not_finite_are_refused_by_name(bad: float) -> None:
    archive = Archive().offer(policies([[1.0, 2.0]]))
    with pytest.raises(ValueError, match="policy 17 has values"):
        archive.offer([policy(16, [0.0, 3.0]), policy(17, [bad, 3.0])])
    assert len(archive.members) == 1


@pytest.mark.parametrize("values", [[1.0], [1.0, 2.0, 3.0]])
def test_the_wrong_number_of_values_is_refused_by_name(values: list[float]) -> None:
    with pytest.raises(ValueError, match=r"policy 17 has values of shape \(\d,\), expected one for each of the 2"):
        Archive().offer([policy(17, values, objectives=2)])
    with pytest.raises(ValueError, match="policy 17 "):
        Archive().offer(policies([[1.0, 2.0]])).offer([policy(17, values)])

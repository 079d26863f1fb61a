"""The drift of the paper's units, with its golden result: what fixed policies reach, and when."""

import numpy as np

from benchmarks.drift import STANDING_STILL, first_hits, near_optimal_policies


def test_fixed_policies_reach_the_papers_targets_with_nothing_learned():
    """The drift: targets A, B and C are reached in generations 3, 5 and 3 by policies that never change."""
    six = near_optimal_policies()
    hits, deviations = first_hits(six)
    assert hits == {"A": 3, "B": 5, "C": 3}
    assert deviations[-1][0] > 1.5 * deviations[0][0]
    assert (np.diff(deviations, axis=0)[:5] > 0).all()


def test_with_policies_that_stand_still_the_same_targets_are_later_or_out_of_reach():
    six = near_optimal_policies()
    assert first_hits([*six[:5], STANDING_STILL])[0] == {"A": 4, "B": None, "C": 1}
    assert first_hits([*six[:3], *[STANDING_STILL] * 3])[0] == {"A": None, "B": None, "C": None}

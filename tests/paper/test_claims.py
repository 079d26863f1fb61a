"""What the paper says of its figures is judged statement by statement."""

import numpy as np
import pytest

from jmorl.paper.analysis import finals
from jmorl.paper.claims import conclusion, curve_checks, finals_checks, finals_told
from jmorl.paper.data import Claims
from jmorl.paper.plan import SHORTER
from jmorl.paper.results import Curves
from tests.experiments.made import ITERATION, record

SEEDS = (1, 7, 10)
STEPS = np.arange(1, 5) * 240_000


def curve(method, last, courses=None, user="A"):
    utility = np.stack(courses if courses is not None else [np.linspace(-90, each, 4) for each in last])
    return Curves(user, method, SEEDS, STEPS, utility)


def judged(claims, *rows):
    return conclusion(curve_checks(claims, rows))


@pytest.mark.parametrize(
    ("interactive", "expected"),
    [
        (
            (-50, -51, -52),
            "holds, because of 1 statements 1 are found here, 0 not clearly and 0 not. As it says: user A",
        ),
        ((-59, -59.5, -60), "holds in part, because of 1 statements 0 are found here, 1 not clearly and 0 not."),
        ((-60, -61, -60.5), "does not hold, because of 1 statements 0 are found here, 0 not clearly and 1 not."),
        ((-70, -71, -72), "Otherwise: user A, PGMORL ends higher (-11 [-13.5, -8.52] against PGMORL, clearly)."),
    ],
)
def test_curves_are_judged_by_their_ends_and_the_interval_of_the_difference(interactive, expected):
    claims = Claims("", {"A": "interactive"})
    assert expected in judged(claims, curve("interactive", interactive), curve("pgmorl", (-59, -61, -60)))


def test_curves_are_compared_with_the_better_row_of_pgmorl():
    rows = [curve("interactive", (-50, -51, -52)), curve("pgmorl", (-59, -60, -61)), curve(SHORTER, (-55, -56, -57))]
    assert "against PGMORL with warm-up 40, clearly" in judged(Claims("", {"A": "interactive"}), *rows)


def test_comparable_is_found_where_neither_is_clearly_ahead():
    rows = [curve("interactive", (-59, -62, -61)), curve("pgmorl", (-59, -60, -61))]
    assert "conclusion holds, " in judged(Claims("", {"A": "comparable"}), *rows)


def test_who_settles_stays_flat_and_varies():
    early, late = [np.array([-90.0, -50, -50, -50])] * 3, [np.array([-90.0, -70, -55, y]) for y in (-40, -45, -50)]
    rows = [curve("interactive", None, late), curve("pgmorl", None, early)]
    names = ("PGMORL settles earlier", "PGMORL stays flat", "interactive varies more", "interactive varies less")
    checks = curve_checks(Claims("", {"A": "interactive"}, names), rows)
    assert [check.holds for check in checks[1:]] == [True, True, True, False]
    assert "PGMORL settles after 0.48 M steps, the interactive method after 0.96 M" in checks[1].text
    checks = curve_checks(
        Claims("", {"A": "interactive"}, names), [curve("interactive", None, early), curve("pgmorl", None, late)]
    )
    assert [check.holds for check in checks[1:]] == [False, False, False, True]


def test_a_user_a_who_is_caught_up_with():
    ours, theirs = [np.array([-60.0, -55, -54, -54])] * 3, [np.array([-90.0, -70, -55, -50])] * 3
    claims = Claims("", {"A": "pgmorl", "C": "pgmorl"}, ("PGMORL catches up for A",))
    rows = [curve("interactive", None, ours), curve("pgmorl", None, theirs)]
    assert [check.holds for check in curve_checks(claims, rows)] == [True, True]
    others = [curve("interactive", None, ours, user="C"), curve("pgmorl", None, theirs, user="C")]
    assert len(curve_checks(claims, others)) == 1


def found_of(ends, front=((-100.0, -20.0), (-85.0, -40.0), (-70.0, -60.0)), weights=None):
    """Final policies of A, B and C, each of two runs."""
    weights = weights or {"A": (0.5, 0.5), "B": (0.7, 0.3), "C": (0.3, 0.7)}
    pgmorl = [record([list(front)])]
    return {
        user: finals([record([[end]]) for end in pair], pgmorl, weights[user], 10 * ITERATION)
        for user, pair in ends.items()
    }


def test_final_policies_of_all_users_are_held_against_each_other():
    apart = found_of(
        {"A": [(-71, -59), (-72, -58)], "B": [(-70.5, -59.5), (-71.5, -58.5)], "C": [(-73, -57), (-74, -56)]}
    )
    names = (
        "nobody is dominated",
        "clustered at objective 1",
        "the same pick for A and B",
        "interactive is better for C",
    )
    mutual, clustered, same, better = finals_checks(Claims("", {}, names), apart, {})
    assert mutual.holds and "0 of all 9 final policies are dominated" in mutual.text
    assert "lie at 9" in clustered.text
    assert same.holds == np.array_equal(apart["A"].enautilus, apart["B"].enautilus)
    assert better.holds == bool((apart["C"].interactive[:, 1] > apart["C"].enautilus[1]).all())
    beaten = {**apart, "C": found_of({"C": [(-71.2, -59.2), (-74, -56)]})["C"]}  # by A's first
    mutual = finals_checks(Claims("", {}, names), beaten, {})[0]
    assert not mutual.holds and "1 of all 9" in mutual.text


def test_figure_10_is_compared_with_figure_9():
    before = found_of({user: [(-71, -59), (-72, -58)] for user in "ABC"})
    now = found_of({"A": [(-71, -59), (-85, -39)], "B": [(-71, -59), (-72, -58)], "C": [(-99, -20), (-90, -30)]})
    claims = Claims("", {}, ("less concentrated", "shifted to objective 2"))
    assert [check.holds for check in finals_checks(claims, now, before)] == [True, True]
    assert [check.holds for check in finals_checks(claims, before, now)] == [False, False]
    assert [check.holds for check in finals_checks(claims, now, {})] == [None, None]


def test_whether_e_nautilus_dominates():
    worse = found_of({user: [(-110, -70), (-105, -65)] for user in "ABC"})
    dominates, spread = finals_checks(Claims("", {}, ("E-NAUTILUS dominates for A and B", "widely spread")), worse, {})
    assert dominates.holds and "2 of 2 for A and 2 of 2 for B" in dominates.text
    assert not spread.holds


def test_nothing_is_judged_without_all_users():
    assert finals_checks(Claims("", {}, ("nobody is dominated",)), {}, {}) == []
    assert "missing" in conclusion([]) and finals_told({}, {}) == ""


def test_final_policies_are_told_by_utility_and_dominance():
    ours = [record([[(-80.0, -40.0)]]), record([[(-95.0, -55.0)]])]
    found = finals(ours, [record([[(-90.0, -50.0)]])], (0.5, 0.5), 10 * ITERATION)
    text = finals_told({"A": found}, {"A": (0.5, 0.5)})
    assert "1 of 2 interactive runs end on a greater utility" in text
    assert "1 of them are dominated, and E-NAUTILUS's policy is dominated by one of them." in text

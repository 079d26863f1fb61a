"""Sentences follow from numbers: other numbers, other sentences."""

import pytest

from jmorl.paper.analysis import finals
from jmorl.paper.data import published
from jmorl.paper.results import Curves, target_row
from jmorl.paper.verdicts import ahead, curve_verdict, finals_verdict, table_verdict, target_verdict
from tests.paper.made import ITERATION, record

TABLE = published().tables["table1"]
TARGET, BUDGET = (-80.0, -50.0), 50 * ITERATION
SEEDS = (1, 7, 10)


def run_reaching(generation, sigma=None, **how):
    """A run of five generations that reaches the target in one of them; None: never."""
    born = [[(-100.0 + g, -70.0 + g)] for g in range(5)]
    if generation is not None:
        born[generation].append((-79.0, -49.0))
    return record(born, sigma=sigma, **how)


def row(method, generations, target="B", **how):
    records = [run_reaching(each, **how) for each in generations]
    return target_row(target, TARGET, method, SEEDS, records, BUDGET)


def test_a_clear_order_that_is_the_published_one():
    rows = [row("interactive", (1, 1, 2)), row("pgmorl", (None, 4, None))]
    text = target_verdict(TABLE, rows, "raw")
    assert "the interactive method is ahead, as in the paper" in text
    assert "3 and 1 of 3 runs reach it (published: 5 and 0 of 5)" in text
    assert "too few or too scattered" not in text
    text = table_verdict(TABLE, {"B": rows})
    assert "conclusion holds: the methods are in the published order for 1 of 1 targets" in text
    assert "the interactive method in 3 of 3 runs and PGMORL in 1 of 3 runs" in text


def test_an_order_the_other_way_round_shows_the_mechanism():
    rows = [row("interactive", (None, None, 1), candidates=1), row("pgmorl", (1, 1, 1))]
    text = target_verdict(TABLE, rows, "raw")
    assert "PGMORL is ahead, whereas in the paper the interactive method is" in text
    assert "In its runs that time out, 1 policies lie within the bounds (median), 100% of the generations" in text
    assert "does not hold" in table_verdict(TABLE, {"B": rows})


def test_methods_within_half_a_generation_are_comparable():
    rows = [row("interactive", (1, 2, 2)), row("pgmorl", (2, 1, 2))]
    assert "neither method is ahead" in target_verdict(TABLE, rows, "raw")
    assert ahead(3.0, 5.0) == "comparable" and ahead(6.0, 5.0) == "interactive" and ahead(-6.0, 5.0) == "pgmorl"


def test_in_paper_units_it_says_what_moving_units_did():
    sigma = [(40.0 + 20 * g, 20.0) for g in range(5)]
    rows = [row("interactive", (2, 2, 2), sigma=sigma), row("pgmorl", (2, 3, 4))]
    text = target_verdict(TABLE, rows, "paper")
    assert "3 of the interactive method's 3 successes would not be one" in text
    assert "None of PGMORL's successes is owed to units that moved." in text
    assert "units that moved" not in target_verdict(TABLE, rows, "raw")
    slower = [row("interactive", (4, None, None), sigma=sigma), row("pgmorl", (1, 1, 1))]
    text = target_verdict(TABLE, slower, "paper")
    assert "PGMORL uses 4.52 M steps fewer than published." in text and "In its runs that time out" in text


def test_missing_runs_are_said_to_be_missing():
    assert "missing" in target_verdict(TABLE, [row("pgmorl", (1, 1, 1))], "raw")
    assert "missing" in table_verdict(TABLE, {"B": [row("pgmorl", (1, 1, 1))]})
    assert "missing" in finals_verdict({}, {})


def curve(method, last):
    import numpy as np

    utility = np.stack([np.linspace(-90, each, 4) for each in last])
    return Curves("A", method, SEEDS, np.arange(4), utility, utility)


@pytest.mark.parametrize(
    ("interactive", "expected"),
    [
        ((-50, -51, -52), "the interactive method ends higher (difference +9 [+9, +9]); as the paper says."),
        ((-59, -62, -61), "neither is clearly ahead"),
        ((-70, -71, -72), "PGMORL ends higher (difference -11 [-11, -11]); the paper says that the interactive method"),
    ],
)
def test_curves_are_judged_by_their_ends_and_the_interval_of_the_difference(interactive, expected):
    text = curve_verdict({"A": "interactive"}, [curve("interactive", interactive), curve("pgmorl", (-59, -60, -61))])
    assert expected in text


def test_final_policies_are_judged_by_utility_and_dominance():
    pgmorl = [record([[(-90.0, -50.0)]])]
    ours = [record([[(-80.0, -40.0)]]), record([[(-95.0, -55.0)]])]
    found = finals(ours, pgmorl, (0.5, 0.5), 10 * ITERATION)
    text = finals_verdict({"A": found}, {"A": (0.5, 0.5)})
    assert "1 of 2 interactive runs end on a greater utility" in text
    assert "1 of them are dominated, and E-NAUTILUS's policy is dominated by one of them." in text

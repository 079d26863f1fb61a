"""Sentences on tables follow from numbers: other numbers, other sentences."""

from jmorl.experiments.targets import target_row
from jmorl.paper.data import published
from jmorl.paper.plan import SHORTER
from jmorl.paper.results import pair_of
from jmorl.paper.verdicts import ahead, table_verdict, target_verdict
from tests.experiments.made import ITERATION, record

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
    text = target_verdict(TABLE, rows)
    assert "the interactive method is ahead, as in the paper" in text and "(clearly) against PGMORL" in text
    assert "3 of 3 and 1 of 3 runs reach it (published: 5 and 0 of 5)" in text
    text = table_verdict(TABLE, {"B": rows})
    assert "conclusion holds, because the methods are in the published order for 1 of 1 targets (B)" in text
    assert "the interactive method in 3 of 3 runs and PGMORL in 1 of 3 runs" in text


def test_a_conclusion_does_not_rest_on_point_means_alone():
    rows = [row("interactive", (1, 1, 1)), row("pgmorl", (1, 1, 4))]
    assert "(not clearly)" in target_verdict(TABLE, rows)
    assert "conclusion holds in part" in table_verdict(TABLE, {"B": rows})


def test_an_order_the_other_way_round_is_no_agreement():
    rows = [row("interactive", (None, None, 1)), row("pgmorl", (1, 1, 1))]
    assert "PGMORL is ahead, whereas in the paper the interactive method is" in target_verdict(TABLE, rows)
    assert "does not hold" in table_verdict(TABLE, {"B": rows})


def test_methods_within_half_a_generation_are_comparable():
    rows = [row("interactive", (1, 2, 2)), row("pgmorl", (2, 1, 2))]
    assert "neither method is ahead" in target_verdict(TABLE, rows)
    assert ahead(3.0, 5.0) == "comparable" and ahead(6.0, 5.0) == "interactive" and ahead(-6.0, 5.0) == "pgmorl"


def test_half_a_generation_is_that_of_the_config_and_not_of_a_run():
    """Runs that end with the warm-up have no second generation to measure."""
    at_once = [record([[(-79.0, -49.0)]]) for _ in SEEDS]
    rows = [target_row("B", TARGET, name, SEEDS, at_once, BUDGET) for name in ("interactive", "pgmorl")]
    assert "neither method is ahead" in target_verdict(TABLE, rows)


def test_the_interactive_method_is_compared_with_the_better_row_of_pgmorl():
    rows = [row("interactive", (1, 1, 2)), row("pgmorl", (2, 4, None)), row(SHORTER, (2, 3, 3))]
    assert pair_of(rows).baseline.method == SHORTER
    text = target_verdict(TABLE, rows)
    assert "against PGMORL with warm-up 40, the better of PGMORL's two rows (the other, PGMORL: " in text
    swapped = [rows[0], row("pgmorl", (2, 2, 2)), rows[2]]
    assert pair_of(swapped).baseline.method == "pgmorl"
    assert pair_of(rows[1:]) is None


def test_a_run_that_broke_down_counts_as_not_reaching_the_target():
    broken = row("interactive", (None, 1, 1), fault="agent 2: loss is not finite")
    assert broken.faults == 3 and broken.times.successes == 2
    text = target_verdict(TABLE, [broken, row("pgmorl", (1, 1, 1))])
    assert "Runs that broke down, 3 of the interactive method's, count as not reaching it" in text


def test_missing_runs_are_said_to_be_missing():
    assert "missing" in target_verdict(TABLE, [row("pgmorl", (1, 1, 1))])
    assert "missing" in table_verdict(TABLE, {"B": [row("pgmorl", (1, 1, 1))]})

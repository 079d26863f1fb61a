"""The acceptance criterion in raw units, and what explains a difference in paper units: by rule from the numbers."""

from jmorl.paper.acceptance import acceptance_verdict, drift_told, explanations
from jmorl.paper.data import published
from tests.paper.test_verdicts import row

TABLE = published().tables["table1"]


def test_a_criterion_that_is_met_says_how_surely():
    text = acceptance_verdict(TABLE, [row("interactive", (1, 1, 1)), row("pgmorl", (3, 3, 4))])
    assert text.startswith(
        "Target B: met, in steps clearly. The interactive method succeeds in 3 of 3 runs, PGMORL in 3"
    )
    assert "best published row in 5 of 5" in text and "candidates" not in text and "can be continued" not in text
    assert "met, in steps not clearly." in acceptance_verdict(
        TABLE, [row("interactive", (1, 1, 1)), row("pgmorl", (1, 1, 4))]
    )


def test_a_criterion_that_is_not_met_shows_the_mechanism():
    rows = [row("interactive", (None, None, 1), candidates=1), row("pgmorl", (1, 1, 1))]
    text = acceptance_verdict(TABLE, rows)
    assert "not met: it succeeds less often than PGMORL and it succeeds less often than the best published row and it "
    assert "does not need fewer steps." in text
    assert (
        "In its runs that never arrive, policies that can be continued number 1 (median), 100% of the generations"
        in text
    )
    late = acceptance_verdict(TABLE, [row("interactive", (2, 2, 2)), row("pgmorl", (1, 1, 1))])
    assert (
        "not met: it does not need fewer steps." in late
        and "In its runs, policies that can be continued number 3" in late
    )


def test_for_target_a_steps_are_not_asked_for():
    rows = [row("interactive", (2, 2, 2), target="A"), row("pgmorl", (1, 1, 1), target="A")]
    assert "Target A: met. " in acceptance_verdict(TABLE, rows) and "not asked for here" in acceptance_verdict(
        TABLE, rows
    )
    assert "missing" in acceptance_verdict(TABLE, rows[1:])


def test_more_successes_than_published_are_owed_to_drift_if_no_trained_policy_would_do():
    sigma = [(40.0 + 20 * g, 20.0) for g in range(5)]
    lines = explanations(TABLE, [row("interactive", (1, 1, 1)), row("pgmorl", (2, 3, 4), sigma=sigma)])
    (line,) = lines  # the interactive method's successes and the order are the published ones
    assert line.startswith("Target B, PGMORL: 3 of 3 succeed (published: 0 of 5); it uses ")
    assert "Drift: 3 of the 3 successes are of no trained policy that would do" in line
    assert "3 of PGMORL's 3 successes are owed to moving units: no trained" in drift_told(
        row("pgmorl", (2, 3, 4), sigma=sigma)
    )


def test_successes_at_the_start_and_without_drift_point_to_what_is_not_copied():
    still = [(40.0, 20.0)] * 5
    interactive = row("interactive", (0, 0, 0), sigma=still)
    (start,) = explanations(TABLE, [interactive, row("pgmorl", (0, 0, 0), sigma=still)])[1:]
    assert "An uncopied defect: 3 of the successes come with generation 0" in start
    (line,) = explanations(TABLE, [interactive, row("pgmorl", (2, 3, 4), sigma=still)])
    assert "An uncopied defect, by elimination" in line
    assert drift_told(interactive) == "Target B: none of the interactive method's 3 successes is owed to moving units."


def test_fewer_successes_are_our_own_shortfall_unless_units_hide_them():
    still = [(40.0, 20.0)] * 5
    rows = [row("interactive", (None, 1, 1), sigma=still), row("pgmorl", (None,) * 3, sigma=still)]
    (line,) = explanations(TABLE, rows)
    assert "Our own shortfall: moving units hide no success. In its runs that never arrive, " in line
    falling = [(40.0, 20.0)] + [(20.0, 10.0)] * 4
    rows[0] = row("interactive", (None, 1, 1), sigma=falling)
    (line,) = explanations(TABLE, rows)
    assert "Drift: 1 of the runs that never arrive have a trained policy that would do" in line

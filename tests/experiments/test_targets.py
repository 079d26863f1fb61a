"""When runs reach a target, and what one contender saves against another: on made-up records."""

from jmorl.experiments.targets import compared, reached, target_row
from tests.experiments.made import ITERATION, record

TARGET, CAP = (-80.0, -50.0), 50 * ITERATION


def test_a_target_is_reached_by_one_policy_in_every_objective():
    run = record([[(-90, -50)], [(-70, -60), (-95, -40)], [(-80, -45), (-75, -48)]])
    hit = reached(run, (-80, -50))
    assert (hit.generation, hit.steps, hit.seconds) == (2, 30 * ITERATION, 12.0)
    assert (hit.policy, hit.policies) == (4, (3, 4))  # the last clears by (5, 2), where the other clears by (0, 5)
    assert reached(run, (-69, -45)) is None
    assert reached(run, (-90, -50)).generation == 0


def test_what_is_reached_after_the_cap_does_not_count():
    run = record([[(-90, -50)], [(-70, -60)]])
    assert reached(run, (-75, -65), cap=20 * ITERATION).generation == 1
    assert reached(run, (-75, -65), cap=20 * ITERATION - 1) is None


def row(name, seeds, generations, **how):
    """A contender whose runs reach the target in these generations; None: never."""
    records = []
    for generation in generations:
        born = [[(-100.0 + g, -70.0 + g)] for g in range(5)]
        if generation is not None:
            born[generation].append((-79.0, -49.0))
        records.append(record(born, **how))
    return target_row("A", TARGET, name, seeds, records, CAP)


def test_a_row_tells_runs_that_arrive_from_those_that_do_not():
    found = row("mine", (1, 2, 3), (0, None, 2))
    assert [(hit.generation, hit.steps) for _, hit in found.hits] == [(0, 10 * ITERATION), (2, 30 * ITERATION)]
    assert found.late == [found.records[1]] and found.times.reached == (10 * ITERATION, None, 30 * ITERATION)
    assert found.seconds == (4.0 + 5 * 4.0 + 12.0) / 3
    assert found.faults == 0 and row("mine", (1,), (0,), fault="loss is not finite").faults == 1


def test_a_run_that_broke_down_before_it_had_a_generation_has_nothing_to_look_at():
    found = target_row("A", TARGET, "mine", (1,), [record([], fault="loss is not finite")], CAP)
    assert found.hits == found.late == [] and (found.faults, found.seconds) == (1, 0.0)


def test_steps_are_compared_on_the_seeds_that_both_have():
    one, other = row("mine", (1, 2, 3), (1, 1, None)), row("theirs", (3, 1), (0, 3))
    saved = compared(one, other)
    assert (saved.count, saved.mean) == (2, (20 * ITERATION + 10 * ITERATION - CAP) / 2)
    assert compared(one, row("theirs", (4, 5), (0, 0))) is None

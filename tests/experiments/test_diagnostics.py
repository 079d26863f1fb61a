"""Diagnostics of runs, on made-up records."""

import numpy as np
import pytest

from jmorl.experiments.diagnostics import mechanism, waiting
from tests.experiments.made import record


def test_the_mechanism_counts_repeats_and_gains():
    run = record(
        [[(0.0, 0.0), (10.0, -10.0)], [(5.0, 0.0)], [(5.0, 0.0)]],
        parents={2: (0, (2.0, 2.0))},
        questions=[(1, 0), (2, 0), (3, 2)],
        candidates=1,
    )
    found = mechanism([run])
    assert (found.candidates, found.alone, found.repeated) == (1, 1.0, 0.5)
    front = np.array([[10.0, -10.0], [5.0, 0.0]])
    span = np.ptp(front, axis=0)
    assert found.predicted_gain == pytest.approx(np.mean(2 / span))
    assert found.realised_gain == pytest.approx(np.mean([5, 0] / span))
    asked = waiting([run])
    assert (asked.questions, asked.before_first, asked.between) == (3, 4.0, 4.0)


def test_who_is_asked_at_the_end_waits_for_the_whole_run():
    run = record([[(-90, -50)], [(-70, -60)], [(-70, -50)]], questions=[(3, 2)])
    asked = waiting([run])
    assert (asked.questions, asked.before_first) == (1, 12.0) and np.isnan(asked.between)

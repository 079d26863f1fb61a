"""What a generation is measured by."""

import numpy as np

from jmorl.search.metrics import front_metrics


def test_members_that_are_not_above_the_reference_point_are_counted():
    front = np.array([[0.0, 3.0], [1.0, 2.0], [2.0, 1.0], [3.0, 0.0]])
    weights = np.array([[0.5, 0.5]])
    assert front_metrics(front, np.array([-1.0, -1.0]), weights).below_reference == 0
    metrics = front_metrics(front, np.array([0.0, -1.0]), weights)  # the first is on it
    assert metrics.below_reference == 1
    assert metrics.hypervolume == front_metrics(front[1:], np.array([0.0, -1.0]), weights).hypervolume
    assert front_metrics(front, np.array([2.5, 2.5]), weights).below_reference == 4

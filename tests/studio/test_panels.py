"""A panel draws anew only where it must."""

from dataclasses import dataclass

import numpy as np

from jmorl.studio.panels.panel import Shown


@dataclass
class Record:
    values: np.ndarray


def test_only_what_differs_from_what_was_shown_last_is_new():
    shown, record = Shown(), Record(np.zeros(2))
    assert shown.is_new(record, None, 1000)  # nothing was shown before
    assert not shown.is_new(record, None, int("1000"))
    assert shown.is_new(record, 0, 1000)
    assert shown.is_new(record, None, 1000)
    assert shown.is_new(Record(record.values), None, 1000)  # another record, whatever it holds


def test_nothing_at_all_is_new_once():
    shown = Shown()
    assert shown.is_new(None, False) and not shown.is_new(None, False)

"""Strips cover every row once, and what they give back is in their order."""

import threading

import numpy as np
import pytest

from addon.core.strips import in_strips, on_all_processors


@pytest.mark.parametrize("count", [0, 1, 9, 10, 11, 95])
def test_every_row_once_and_results_in_order(count):
    seen = np.zeros(count, int)

    def work(rows):
        seen[rows] += 1
        return rows.start, rows.stop

    ends = in_strips(work, count, size=10)
    assert (seen == 1).all()
    assert ends == [(first, min(first + 10, count)) for first in range(0, count, 10)]


def test_strips_are_worked_on_side_by_side(monkeypatch):
    """Both wait for the other one: on one thread neither would be done."""
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    meeting = threading.Barrier(2, timeout=30)
    assert sorted(on_all_processors(lambda part: meeting.wait(), [0, 1])) == [0, 1]


def test_what_a_strip_raises_is_raised():
    def work(rows):
        raise ValueError(f"strip from {rows.start}")

    with pytest.raises(ValueError, match="strip from 0"):
        in_strips(work, 5)

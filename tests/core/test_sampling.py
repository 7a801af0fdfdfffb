"""What trace.py computes without a GPU: the place of samples in the pixel, the time left."""

import numpy as np
import pytest

from addon.core.trace import remaining, sample_offset


@pytest.mark.parametrize("samples", [2, 3, 4, 16, 64, 1000])
def test_samples_cover_the_pixel_and_their_mean_is_its_centre(samples):
    """A low-discrepancy sequence's mean goes to the centre like 1/n; random samples would be sqrt(n/12)/n off."""
    offsets = np.array([sample_offset(sample, samples) for sample in range(samples)])
    assert (np.abs(offsets) <= 0.5).all()
    assert len(np.unique(offsets, axis=0)) == samples
    assert (np.abs(offsets.mean(axis=0)) < 2.0 / samples).all()


def test_a_thousand_samples_are_spread_evenly():
    """Each of 4 x 4 cells of the pixel holds its sixteenth within a tenth of it."""
    offsets = np.array([sample_offset(sample, 1000) for sample in range(1000)])
    counts, _, _ = np.histogram2d(*offsets.T, bins=4, range=[[-0.5, 0.5]] * 2)
    assert np.abs(counts - 62.5).max() < 6.25


def test_one_sample_is_the_centre():
    assert sample_offset(0, 1) == (0.0, 0.0)
    assert sample_offset(0, 16) == (0.0, 0.0)


def test_time_left():
    assert remaining(0.1, 0.0) == "Starting"
    assert remaining(30.0, 0.25) == "1:30 left"
    assert remaining(59.6, 0.5) == "1:00 left"
    assert remaining(10.0, 1.0) == "0:00 left"

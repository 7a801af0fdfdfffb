"""What trace.py computes without a GPU: the place of samples around the pixel, the pixels at edges, the time left."""

import numpy as np
import pytest

from addon.core.antialiasing import BLACKMAN_HARRIS, EdgeFinder, sample_offset
from addon.core.status import Status
from addon.core.trace import remaining

WIDTH = 1.5


def window(x):
    """Blackman and Harris' window over [-WIDTH, WIDTH], as Cycles has it; its integral is 1."""
    terms = (a * np.cos(np.pi * k * x / WIDTH) for k, a in enumerate(BLACKMAN_HARRIS))
    return sum(terms) / BLACKMAN_HARRIS[0] / (2 * WIDTH)


@pytest.mark.parametrize("samples", [2, 3, 4, 16, 64, 1000])
def test_samples_cover_the_filter_and_their_mean_is_the_pixels_centre(samples):
    """A low-discrepancy sequence's mean goes to the centre like 1/n times the filter's span."""
    offsets = np.array([sample_offset(sample, WIDTH) for sample in range(samples)])
    assert (np.abs(offsets) <= WIDTH).all()
    assert len(np.unique(offsets, axis=0)) == samples
    assert (np.abs(offsets.mean(axis=0)) < 2.0 * 2 * WIDTH / samples).all()


def test_a_thousand_samples_have_the_filters_density():
    """Shares of eight intervals against the window, integrated by 10,000 midpoints. The discrepancy of one axis of the
    sequence is below 3 / n.
    """
    offsets = np.array([sample_offset(sample, WIDTH) for sample in range(1000)])
    edges = np.linspace(-WIDTH, WIDTH, 9)
    points = (np.arange(10_000) + 0.5) / 10_000 * 2 * WIDTH - WIDTH
    expected, _ = np.histogram(points, edges, weights=window(points) * 2 * WIDTH / 10_000)
    assert expected.sum() == pytest.approx(1.0, abs=1e-6)
    for axis in range(2):
        found, _ = np.histogram(offsets[:, axis], edges)
        assert np.abs(found / 1000 - expected).max() < 2 * 3 / 1000


def test_the_filters_width_scales_the_offsets():
    for sample in range(20):
        assert sample_offset(sample, 3.0) == pytest.approx(2 * np.array(sample_offset(sample, 1.5)))


def test_the_first_sample_is_the_centre():
    assert sample_offset(0, WIDTH) == pytest.approx((0.0, 0.0), abs=1e-15)


# Edges


def plain(columns, rows):
    """Rays that all escape along z, with no surface; position, velocity with status, surface."""
    arrays = [np.zeros((rows, columns, 4), np.float32) for _ in range(3)]
    arrays[1][...] = (0, 0, 1, Status.ESCAPED)
    return arrays


def tiles(columns, rows, width, height):
    for y in range(0, rows, height):
        for x in range(0, columns, width):
            yield x, y, slice(y, min(y + height, rows)), slice(x, min(x + width, columns))


def edges(arrays, width=64, height=64):
    rows, columns, _ = arrays[0].shape
    finder = EdgeFinder(columns, rows)
    for x, y, down, across in tiles(columns, rows, width, height):
        finder.add(x, y, *(array[down, across] for array in arrays))
    return finder


def marked(difference):
    """Both pixels at each step of a row of values."""
    step = np.diff(difference) != 0
    return np.concatenate([step, [False]]) | np.concatenate([[False], step])


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("what", ["status", "object", "direction", "normal", "depth"])
def test_every_kind_of_edge_is_found_on_both_sides(what, axis):
    arrays = plain(12, 12)
    position, velocity, surface = arrays
    rows, columns = np.mgrid[:12, :12]
    other = (rows if axis == 0 else columns) >= 5
    if what in ("normal", "object", "depth"):
        velocity[..., 3] = Status.HIT
        position[..., 0], position[..., 1], surface[..., 2] = 0.01 * columns, 0.01 * rows, 1.0
    if what == "status":
        velocity[other, 3] = Status.ABSORBED
    elif what == "object":
        surface[other, 3] = 1.0
    elif what == "direction":
        velocity[other, :3] = (np.sin(0.2), 0, np.cos(0.2))
    elif what == "normal":
        surface[other, :3] = (np.sin(0.5), 0, np.cos(0.5))
    else:
        position[other, 2] = -1.0
    line = marked(np.arange(12) >= 5)
    assert np.array_equal(edges(arrays).mask, np.broadcast_to(line[:, None] if axis == 0 else line, (12, 12)))


def test_smooth_changes_are_no_edges():
    """Directions 0.05 radians apart, a plane seen at a slant, and absorbed rays, whose direction means nothing."""
    sky = plain(30, 4)
    angle = 0.05 * np.arange(30)
    sky[1][..., 0], sky[1][..., 2] = np.sin(angle), np.cos(angle)
    assert not edges(sky).mask.any()
    floor = plain(30, 4)
    floor[1][..., 3] = Status.HIT
    floor[0][..., 0] = 0.1 * np.arange(30)
    floor[0][..., 1] = 0.3 * np.arange(4)[:, None]
    floor[2][..., :3] = (0, 0, 1)
    assert not edges(floor).mask.any()
    hole = plain(30, 4)
    hole[1][..., :3] = np.random.default_rng(1).normal(size=(4, 30, 3))
    hole[1][..., 3] = Status.ABSORBED
    assert not edges(hole).mask.any()


@pytest.mark.parametrize("size", [(16, 16), (8, 32), (5, 3), (41, 31)])
def test_the_tiles_make_no_difference(size):
    arrays = plain(41, 31)
    generator = np.random.default_rng(2)
    arrays[1][..., 3] = np.where(generator.random((31, 41)) < 0.05, Status.ABSORBED, Status.ESCAPED)
    whole = edges(arrays).mask
    assert whole.any() and not whole.all()
    assert np.array_equal(edges(arrays, *size).mask, whole)


@pytest.mark.parametrize("shape", [(6, 8), (7, 5), (1, 1)])
def test_quads_hold_every_pixel_whose_filter_reaches_an_edge(shape):
    rows, columns = shape
    for row in range(rows):
        for column in range(columns):
            finder = EdgeFinder(columns, rows)
            finder.mask[row, column] = True
            covered = np.zeros((rows + 1, columns + 1), bool)  # quads may stand out
            quads = finder.quads().astype(int)
            assert (quads % 2 == 0).all() and len(np.unique(quads, axis=0)) == len(quads)
            for x, y in quads:
                covered[y : y + 2, x : x + 2] = True
                reaches = abs(np.array([y, y + 1]) - row) <= 1, abs(np.array([x, x + 1]) - column) <= 1
                assert reaches[0].any() and reaches[1].any()
            assert covered[max(row - 1, 0) : min(row + 2, rows), max(column - 1, 0) : min(column + 2, columns)].all()
    assert len(EdgeFinder(columns, rows).quads()) == 0


def test_time_left():
    assert remaining(0.1, 0.0) == "Starting"
    assert remaining(30.0, 0.25) == "1:30 left"
    assert remaining(59.6, 0.5) == "1:00 left"
    assert remaining(10.0, 1.0) == "0:00 left"

"""A frame on disk: upright, complete, and whole or not at all."""

import numpy as np
import OpenEXR
import pytest

from addon.core.frame import Frame, Statistics
from addon.core.settings import PASS_CHANNELS, PASSES
from addon.core.status import Status

SIZE = 5, 3  # columns, rows


@pytest.fixture
def frame():
    """Every pass, filled with numbers that all differ."""
    generator = np.random.default_rng(1)
    columns, rows = SIZE
    return Frame(
        {name: generator.normal(size=(rows, columns, len(PASS_CHANNELS[name]))).astype(np.float32) for name in PASSES}
    )


def channels(path):
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return {name: np.array(channel.pixels) for name, channel in file.channels().items()}


def test_every_pass_comes_back_bit_for_bit_with_the_top_row_first(frame, tmp_path):
    frame.save(tmp_path / "picture.exr")
    found = channels(tmp_path / "picture.exr")
    assert len(found) == sum(len(letters) for letters in PASS_CHANNELS.values())
    for name, letters in PASS_CHANNELS.items():
        for index, letter in enumerate(letters):
            pixels = found[f"ViewLayer.{name}.{letter}"]
            assert pixels.dtype == np.float32
            # OpenEXR's first row is the top; ours is the bottom.
            assert np.array_equal(pixels, frame.passes[name][::-1, :, index]), name


def test_layer_name_is_the_users(frame, tmp_path):
    frame.save(tmp_path / "picture.exr", layer="Hole")
    assert "Hole.Combined.R" in channels(tmp_path / "picture.exr")


def test_only_the_picture_is_left_in_the_folder(frame, tmp_path):
    frame.save(tmp_path / "picture.exr")
    assert [path.name for path in tmp_path.iterdir()] == ["picture.exr"]


def test_a_second_save_replaces_the_first(frame, tmp_path):
    frame.save(tmp_path / "picture.exr")
    frame.passes["Combined"] += 1.0
    frame.save(tmp_path / "picture.exr")
    red = channels(tmp_path / "picture.exr")["ViewLayer.Combined.R"]
    assert np.array_equal(red, frame.passes["Combined"][::-1, :, 0])


class HalfWritten:
    """Stands in for OpenEXR.File on a disk that becomes full."""

    def __init__(self, header, channels):
        pass

    def write(self, path):
        with open(path, "wb") as file:
            file.write(b"half")
        raise RuntimeError("no space left")


def test_a_full_disk_leaves_the_old_picture_and_no_half_written_file(frame, tmp_path, monkeypatch):
    (tmp_path / "picture.exr").write_bytes(b"the old picture")
    monkeypatch.setattr(OpenEXR, "File", HalfWritten)
    with pytest.raises(OSError, match=r"Cannot write '.*picture\.exr': no space left"):
        frame.save(tmp_path / "picture.exr")
    assert [path.name for path in tmp_path.iterdir()] == ["picture.exr"]
    assert (tmp_path / "picture.exr").read_bytes() == b"the old picture"


def test_a_folder_that_is_not_there(frame, tmp_path):
    with pytest.raises(OSError):
        frame.save(tmp_path / "nowhere" / "picture.exr")
    assert not list(tmp_path.iterdir())


def test_a_folder_in_the_pictures_place(frame, tmp_path):
    (tmp_path / "picture.exr").mkdir()
    with pytest.raises(OSError):
        frame.save(tmp_path / "picture.exr")
    assert [path.name for path in tmp_path.iterdir()] == ["picture.exr"]


def test_size_is_columns_and_rows(frame):
    assert frame.size == SIZE


def test_rays_are_counted_over_all_statuses():
    assert Statistics(rays={Status.HIT: 3, Status.ESCAPED: 4}).ray_count == 7

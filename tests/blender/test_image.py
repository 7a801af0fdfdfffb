"""Frame -> Blender's images: same datablock, right way up, untouched numbers."""

import bpy
import numpy as np
import pytest


@pytest.fixture
def image(empty_file, extension):
    return extension("addon.image")


def gradient(width, height, channels=4):
    """float32, (height, width, channels): every number is different and some are above 1; alpha is 1."""
    pixels = np.arange(width * height * channels, dtype=np.float32).reshape(height, width, channels) / 10.0
    if channels == 4:
        pixels[..., 3] = 1.0
    return pixels


def read(image):
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(image.size[1], image.size[0], 4)


def test_numbers_are_kept_and_row_zero_is_the_bottom(image):
    pixels = gradient(5, 3)
    made = image.write_image("Nonlinear Rays", pixels)
    assert made.is_float
    assert np.array_equal(read(made), pixels)


def test_colour_space_is_scene_linear_and_not_data(image):
    made = image.write_image("Nonlinear Rays", gradient(5, 3))
    assert made.colorspace_settings.name == image.scene_linear()
    assert not made.colorspace_settings.is_data
    assert image.write_image("Depth", gradient(5, 3, 1), is_data=True).colorspace_settings.is_data


def test_second_picture_replaces_the_pixels_in_place(image):
    first = image.write_image("Nonlinear Rays", gradient(5, 3))
    address = first.as_pointer()
    second = image.write_image("Nonlinear Rays", 2.0 * gradient(5, 3))
    assert second.as_pointer() == address
    assert np.array_equal(read(second), 2.0 * gradient(5, 3))
    assert [one.name for one in bpy.data.images if one.name.startswith("Nonlinear Rays")] == ["Nonlinear Rays"]


def test_another_size_keeps_the_datablock(image):
    address = image.write_image("Nonlinear Rays", gradient(5, 3)).as_pointer()
    made = image.write_image("Nonlinear Rays", gradient(7, 4))
    assert made.as_pointer() == address
    assert np.array_equal(read(made), gradient(7, 4))


@pytest.mark.parametrize("packed", [False, True])
def test_an_image_saved_in_between_is_replaced_too(image, tmp_path, packed):
    made = image.write_image("Nonlinear Rays", gradient(5, 3))
    address = made.as_pointer()
    made.filepath_raw, made.file_format = str(tmp_path / "saved.png"), "PNG"
    made.save()
    if packed:
        made.pack()
    written = (tmp_path / "saved.png").read_bytes()
    made = image.write_image("Nonlinear Rays", gradient(6, 2))
    assert made.as_pointer() == address
    assert made.is_float
    assert made.colorspace_settings.name == image.scene_linear()
    assert np.array_equal(read(made), gradient(6, 2))
    assert (tmp_path / "saved.png").read_bytes() == written


@pytest.mark.parametrize("channels", [1, 3])
def test_fewer_channels_become_grey_or_colour(image, channels):
    pixels = gradient(4, 2, channels)
    rgba = image.to_rgba(pixels)
    assert np.array_equal(rgba[..., :3], np.broadcast_to(pixels, (2, 4, 3)))
    assert (rgba[..., 3] == 1.0).all()


def test_every_pass_becomes_an_image(image, extension):
    frame = extension("addon.core.frame").Frame({"Depth": gradient(4, 2, 1), "Combined": gradient(4, 2)})
    assert image.show_frame(frame).name == "Nonlinear Rays"
    assert "Nonlinear Rays Depth" in bpy.data.images


def test_png_goes_through_the_view_transform_and_leaves_the_settings(image, extension, empty_file, tmp_path):
    pixels = np.full((2, 2, 4), 0.5, np.float32)
    pixels[0] = (0.0, 0.0, 0.0, 1.0)  # the bottom row
    frame = extension("addon.core.frame").Frame({"Combined": pixels})
    empty_file.view_settings.view_transform = "Standard"
    empty_file.render.image_settings.file_format = "JPEG"
    image.save_png(frame, str(tmp_path / "picture.png"), empty_file)
    assert empty_file.render.image_settings.file_format == "JPEG"
    assert len(bpy.data.images) == 0
    saved = bpy.data.images.load(str(tmp_path / "picture.png"))
    saved.colorspace_settings.is_data = True
    assert read(saved)[1, 0, 0] == pytest.approx(0.7354, abs=0.01)  # sRGB's curve at 0.5
    assert read(saved)[0, 0, 0] == 0.0


def test_the_legend_has_the_colours_of_the_coloured_status(empty_file, extension):
    """A line for each number, from the top: a swatch of its colour, and beside it its number and meaning."""
    status = extension("addon.core.status").Status
    frame = extension("addon.core.frame").Frame(
        {
            "Combined": np.ones((1, len(status), 4), np.float32),
            "Status": np.arange(len(status), dtype=np.float32).reshape(1, -1, 1),
        }
    )
    extension("addon.image").show_frame(frame)
    assert bpy.ops.nonlinear_rays.status_legend() == {"FINISHED"}
    colored, legend = (bpy.data.images[f"Nonlinear Rays Status {name}"] for name in ("Colours", "Legend"))
    assert colored.colorspace_settings.is_data and legend.colorspace_settings.is_data
    colors, lines = read(colored)[0, :, :3], np.split(read(legend)[::-1, :, :3], len(status))
    assert len(np.unique(colors, axis=0)) == len(status)
    height = lines[0].shape[0]
    for color, line in zip(colors, lines, strict=True):
        assert (line[:, :height] == color).all()
        letters = line[:, height:] > line[0, -1]
        assert 0.01 < letters.mean() < 0.3
    assert len({line[:, height:].tobytes() for line in lines}) == len(status)

"""Pixels in scene-linear: against the sRGB formula, and against what Blender itself makes of a file."""

import bpy
import numpy as np
import pytest


@pytest.fixture
def scene_linear(extension, empty_file):
    return extension("addon.export.images").scene_linear


def srgb(value):
    """IEC 61966-2-1, one value at a time."""
    return value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4


def ramp(space="sRGB"):
    """A 256 × 2 image of every byte value, the lower row in red only."""
    image = bpy.data.images.new("Ramp", 256, 2, alpha=True)
    image.colorspace_settings.name = space  # changed later, Blender would make the generated pixels anew
    pixels = np.zeros((2, 256, 4), np.float32)
    pixels[1] = (np.arange(256) / 255.0)[:, None]
    pixels[0, :, 0] = np.arange(256) / 255.0
    pixels[..., 3] = 1.0
    image.pixels.foreach_set(pixels.ravel())
    return image


def test_generated_byte_image_is_linearised(scene_linear):
    pixels, warnings = scene_linear(ramp())
    assert (pixels.shape, pixels.dtype, warnings) == ((2, 256, 4), np.float32, [])
    expected = [srgb(value / 255.0) for value in range(256)]
    assert np.allclose(pixels[1, :, :3], np.array(expected)[:, None], atol=1e-6)
    assert np.array_equal(pixels[0, :, 1], np.zeros(256))  # row 0 is the bottom
    assert np.array_equal(pixels[..., 3], np.ones((2, 256)))


@pytest.mark.parametrize("packed", [False, True])
def test_png_from_disk_and_packed(scene_linear, tmp_path, packed):
    source = ramp()
    source.filepath_raw, source.file_format = str(tmp_path / "ramp.png"), "PNG"
    source.save()
    image = bpy.data.images.load(source.filepath_raw)
    if packed:
        image.pack()
        (tmp_path / "ramp.png").unlink()
        image.filepath = "//gone.png"
    pixels, _ = scene_linear(image)
    assert np.allclose(pixels[1, :, 0], [srgb(value / 255.0) for value in range(256)], atol=1e-6)


@pytest.mark.parametrize("space", ["Non-Color", "Linear Rec.709"])
def test_data_and_linear_bytes_stay(scene_linear, space):
    image = ramp(space)
    assert np.allclose(scene_linear(image)[0][1, :, 0], np.arange(256) / 255.0, atol=1e-6)


def test_other_linear_spaces_are_converted_as_blender_converts_floats(scene_linear, tmp_path):
    """The same numbers as an EXR file, which Blender's own colour management reads, and as bytes."""
    space = "ACES2065-1"
    colors = np.array([[51, 102, 204, 255], [255, 0, 0, 255]]) / 255.0
    byte_image = bpy.data.images.new("Bytes", 2, 1)
    byte_image.colorspace_settings.name = space
    byte_image.pixels.foreach_set(colors.astype(np.float32).ravel())
    raw = bpy.data.images.new("Raw", 2, 1, float_buffer=True, is_data=True)
    raw.pixels.foreach_set(colors.astype(np.float32).ravel())
    raw.filepath_raw, raw.file_format = str(tmp_path / "raw.exr"), "OPEN_EXR"
    raw.save()
    read = bpy.data.images.load(raw.filepath_raw)
    read.colorspace_settings.name = space
    assert scene_linear(byte_image)[0] == pytest.approx(scene_linear(read)[0], abs=2e-3)


def test_unknown_space_is_read_as_srgb_and_said(scene_linear):
    image = ramp("Filmic Log")
    pixels, warnings = scene_linear(image)
    assert pixels[1, 128, 0] == pytest.approx(srgb(128 / 255.0), abs=1e-6)
    assert warnings == [
        "Image 'Ramp': its colour space 'Filmic Log' is not known and is read as sRGB. Choose sRGB or linear."
    ]


def test_float_image_is_scene_linear_already(scene_linear):
    image = bpy.data.images.new("Float", 2, 1, float_buffer=True, alpha=False)
    values = np.array([[[0.25, 4.0, -0.5, 1.0], [1e4, 0.0, 0.5, 1.0]]], np.float32)
    image.pixels.foreach_set(values.ravel())
    assert np.array_equal(scene_linear(image)[0], values)


def test_premultiplied_exr_becomes_straight(scene_linear, tmp_path):
    image = bpy.data.images.new("Half", 1, 1, float_buffer=True, alpha=True, is_data=True)
    image.pixels.foreach_set(np.array([0.5, 0.25, 1.0, 0.5], np.float32))
    image.filepath_raw, image.file_format = str(tmp_path / "half.exr"), "OPEN_EXR"
    image.save()
    read = bpy.data.images.load(image.filepath_raw)
    read.colorspace_settings.name = "Non-Color"
    assert read.alpha_mode == "PREMUL"
    assert scene_linear(read)[0][0, 0] == pytest.approx([1.0, 0.5, 2.0, 0.5], rel=1e-3)
    read.alpha_mode = "CHANNEL_PACKED"
    assert scene_linear(read)[0][0, 0] == pytest.approx([0.5, 0.25, 1.0, 0.5], rel=1e-3)


def test_grey_file_has_three_channels(scene_linear, tmp_path):
    scene = bpy.context.scene
    settings = scene.render.image_settings
    settings.file_format, settings.color_mode = "PNG", "BW"
    ramp().save_render(str(tmp_path / "grey.png"), scene=scene)
    pixels, _ = scene_linear(bpy.data.images.load(str(tmp_path / "grey.png")))
    assert pixels.shape == (2, 256, 4)
    assert np.array_equal(pixels[..., 0], pixels[..., 2])
    assert np.ptp(pixels[1, :, 0]) > 0.5


def test_not_finite_pixels_are_black_and_counted(scene_linear):
    image = bpy.data.images.new("Bad", 2, 1, float_buffer=True)
    image.pixels.foreach_set(np.array([np.nan, 1, 1, 1, 0.5, 0.5, 0.5, 1], np.float32))
    pixels, warnings = scene_linear(image)
    assert np.isfinite(pixels).all()
    assert warnings == ["Image 'Bad': 1 of 2 pixels are not finite and were made black."]


def test_reading_does_not_mark_the_image_changed(scene_linear, tmp_path):
    source = ramp()
    source.filepath_raw, source.file_format = str(tmp_path / "ramp.png"), "PNG"
    source.save()
    image = bpy.data.images.load(source.filepath_raw)
    scene_linear(image)
    assert not image.is_dirty


def test_sequence_and_missing(scene_linear, tmp_path):
    source = ramp()
    source.filepath_raw, source.file_format = str(tmp_path / "ramp0001.png"), "PNG"
    source.save()
    image = bpy.data.images.load(source.filepath_raw)
    image.source = "SEQUENCE"
    pixels, warnings = scene_linear(image)
    assert pixels is None or warnings == [
        f"Image '{image.name}' is of the kind sequence: only its current frame is used."
    ]
    image.source, image.filepath = "FILE", "//nowhere.png"
    assert scene_linear(image) == (None, [])


def test_tiled_image_shows_its_first_tile(scene_linear, tmp_path):
    for tile in (1001, 1002):
        source = ramp()
        source.filepath_raw, source.file_format = str(tmp_path / f"ramp.{tile}.png"), "PNG"
        source.save()
    image = bpy.data.images.load(str(tmp_path / "ramp.1001.png"))
    image.source = "TILED"
    pixels, warnings = scene_linear(image)
    assert pixels.shape == (2, 256, 4)
    assert warnings == [f"Image '{image.name}' is of the kind tiled: only its first tile is used."]

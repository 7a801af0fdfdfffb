"""The samples, rendered by the extension's own command: files, statuses, and the size of the black hole's shadow."""

import contextlib
import hashlib
import io
import re
from dataclasses import dataclass, replace

import bpy
import numpy as np
import OpenEXR
import pytest

from tools.bpy_extension import REPOSITORY

SAMPLES = REPOSITORY / "sample_blends"
HIT, ESCAPED, ABSORBED = 1, 2, 3
SIZE = (160, 120)  # a quarter of the samples'
ENDS = {  # sample -> how its rays end
    "test_scene": {HIT, ESCAPED},
    "lorenz": {HIT, ESCAPED},
    "potential": {HIT, ESCAPED},
    "explosion": {HIT, ESCAPED},
    "schwarzschild": {HIT, ESCAPED, ABSORBED},
    "neutron_star": {HIT, ESCAPED},
    "suzanne": {HIT, ESCAPED, ABSORBED},
    "kerr": {HIT, ESCAPED, ABSORBED},
    "wormhole": {HIT, ESCAPED},
    "mirage": {HIT, ESCAPED},
    "luneburg": {HIT, ESCAPED},
    "volume_refraction": {HIT, ESCAPED},
}
PASSES = ("depth", "position", "normal", "object_index", "direction", "status", "steps")


@dataclass
class Rendered:
    name: str
    exit_status: int
    output: str
    errors: str
    files: dict[str, bytes]  # by name
    passes: dict[str, np.ndarray]  # (height, width, channels), row 0 at the bottom
    picture: np.ndarray  # the PNG: (height, width, 3), display values in [0, 1]

    @property
    def status(self):
        return self.passes["Status"][..., 0]


@pytest.fixture(scope="module", params=list(ENDS))
def sample(request, extension, tmp_path_factory):
    """Rendered, with all passes, small."""
    name, folder = request.param, tmp_path_factory.mktemp(request.param)
    scene = open_small(name)
    for pass_name in PASSES:
        setattr(scene.nonlinear_rays, f"pass_{pass_name}", True)
    output, errors = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(output), contextlib.redirect_stderr(errors):
        exit_status = extension("addon.commands").main(["render", "--frames", "1", "--output", str(folder)])
    files = {path.name: path.read_bytes() for path in folder.iterdir()}
    passes, picture = read_exr(folder / f"{name}_0001.exr"), read_png(folder / f"{name}_0001.png")
    yield Rendered(name, exit_status, output.getvalue(), errors.getvalue(), files, passes, picture)
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)


def open_small(name, percentage=15):
    """As much of its size: 96 × 72 pixels."""
    bpy.ops.wm.open_mainfile(filepath=str(SAMPLES / f"{name}.blend"), load_ui=False)
    bpy.context.scene.render.resolution_percentage = percentage
    bpy.context.scene.nonlinear_rays.samples = 1  # so that a pixel is one ray, in every pass
    return bpy.context.scene


def read_exr(path):
    passes = {}
    with OpenEXR.File(str(path), separate_channels=True) as file:
        for name, channel in file.parts[0].channels.items():
            _layer, pass_name, letter = name.rsplit(".", 2)
            passes.setdefault(pass_name, {})[letter] = np.array(channel.pixels)[::-1]
    return {
        name: np.stack([letters[letter] for letter in sorted(letters, key="RXGYVBZA".index)], axis=-1)
        for name, letters in passes.items()
    }


def read_png(path):
    image = bpy.data.images.load(str(path))
    width, height = image.size
    pixels = np.empty(width * height * image.channels, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(height, width, -1)[..., :3]


def test_it_renders_without_a_warning(sample):
    assert sample.exit_status == 0, sample.errors
    assert set(sample.files) == {f"{sample.name}_0001.png", f"{sample.name}_0001.exr"}
    assert "Warning" not in sample.output
    assert sample.errors == "" or all(line.startswith("Frame 1: ") for line in sample.errors.splitlines())


def test_every_number_is_one(sample):
    names = {name.replace("_", " ").title() for name in PASSES} | {"Combined"}
    assert set(sample.passes) == names
    for pixels in sample.passes.values():
        assert pixels.shape[:2] == (72, 96)
        assert np.isfinite(pixels).all()
    assert (sample.passes["Combined"][..., :3] >= 0).all()
    assert (sample.passes["Combined"][..., 3] == 1).all()


def test_rays_end_as_they_should(sample):
    count = {status: int((sample.status == status).sum()) for status in np.unique(sample.status)}
    assert set(count) == ENDS[sample.name]
    assert min(count.values()) > 0.02 * sample.status.size
    # What the command says is what the pass holds.
    said = {word: int(number) for number, word in re.findall(r"(\d+) rays \([\d.]+ %\) (\w+)", sample.output)}
    meant = {"hit": HIT, "escaped": ESCAPED, "were": ABSORBED}
    assert {meant[word]: number for word, number in said.items()} == count


def test_passes_agree_with_each_other(sample):
    hit = sample.status == HIT
    lengths = np.linalg.norm(sample.passes["Normal"], axis=-1)
    np.testing.assert_allclose(lengths[hit], 1, atol=1e-5)
    assert (lengths[~hit] == 0).all()
    assert (sample.passes["Position"][~hit] == 0).all()
    assert ((sample.passes["Depth"][..., 0] < 1e9) == hit).all()
    np.testing.assert_allclose(np.linalg.norm(sample.passes["Direction"], axis=-1), 1, atol=1e-5)
    if sample.name != "suzanne":  # all its objects have the pass index 0
        assert ((sample.passes["Object Index"][..., 0] > 0) == hit).all()
    black = (sample.passes["Combined"][..., :3] == 0).all(axis=-1)
    assert black[sample.status == ABSORBED].all()


def test_the_png_is_the_exr_in_srgb(sample):
    """Display values in 256 steps, with Blender's dither of one step, and half a step of rounding."""
    light = np.clip(sample.passes["Combined"][..., :3], 0, 1).astype(np.float64)
    display = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    assert np.abs(sample.picture - display).max() < 1.6 / 255
    assert np.abs((sample.picture - display).mean()) < 0.1 / 255


def test_the_file_is_left_as_it_is(sample, extension, tmp_path):
    path = SAMPLES / f"{sample.name}.blend"
    before = hashlib.sha256(path.read_bytes()).hexdigest()
    open_small(sample.name)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "copy.blend"))
    saved = bpy.data.is_dirty, datablocks()
    extension("addon.commands").main(["render", "--frames", "1", "--output", str(tmp_path)])
    assert hashlib.sha256(path.read_bytes()).hexdigest() == before
    assert (bpy.data.is_dirty, datablocks()) == saved


def datablocks():
    """Names by kind, but for the picture that Blender keeps of a render."""
    kinds = ("scenes", "images", "objects", "meshes", "worlds", "collections")
    return {kind: {item.name for item in getattr(bpy.data, kind)} - {"Render Result"} for kind in kinds}


# The shadow: a ray is absorbed where its angle to the hole is below psi, sin² psi = 27 M² / (r² + 54 M³ / r).


def shadow_angle(r):
    """psi, radians, for a camera at r masses whose directions are the chart's."""
    return np.arcsin(np.sqrt(27 / (r**2 + 54 / r)))


def angles_to_hole(camera, finer):
    """Angle, radians, between the hole at the world's origin and each pixel, finer × finer of them a pixel."""
    left, right, bottom, top = camera.window
    columns, rows = finer * camera.width, finer * camera.height
    x = left + (np.arange(columns) + 0.5) * (right - left) / columns
    y = bottom + (np.arange(rows) + 0.5) * (top - bottom) / rows
    directions = np.stack([*np.meshgrid(x, y), np.full((rows, columns), -1.0)], axis=-1)
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    to_hole = -camera.world_from_camera[:3, 3] @ camera.world_from_camera[:3, :3]
    return np.arccos(directions @ (to_hole / np.linalg.norm(to_hole)))


@pytest.fixture(scope="module")
def traced(extension):
    """traced(name, **settings) -> exported scene, absorbed pixels."""

    def trace(name, **changes):
        scene = open_small(name, 25)
        exported, settings = extension("addon.capture").capture(scene, scene.view_layers[0])
        settings = replace(settings, passes=("Status",), **changes)
        frame = extension("addon.core.trace").render(exported, settings)
        return exported, frame.passes["Status"][..., 0] == ABSORBED

    yield trace
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)


def radius(area):
    """Pixels: of the circle that has this area, in pixels."""
    return np.sqrt(area / np.pi)


def expected_radius(camera, finer=16):
    psi = shadow_angle(np.linalg.norm(camera.world_from_camera[:3, 3]))
    return radius((angles_to_hole(camera, finer) < psi).sum() / finer**2)


@pytest.mark.parametrize("name", ["schwarzschild", "suzanne"])
def test_the_shadow_has_its_size_and_place(traced, name):
    """As the sample is: the tolerance is half a pixel, and nothing stands before the shadow. Pixels whose centre is
    nearer to the outline than that may be on either side of it; the area then gives the radius far below a pixel.
    """
    exported, absorbed = traced(name)
    camera = exported.camera
    assert (camera.width, camera.height) == SIZE
    off_outline = angles_to_hole(camera, 1)[..., :] - shadow_angle(np.linalg.norm(camera.world_from_camera[:3, 3]))
    pixel = (camera.window[1] - camera.window[0]) / camera.width  # radians in the middle, the largest
    clear = np.abs(off_outline) > 0.5 * pixel
    assert (absorbed == (off_outline < 0))[clear].all()
    assert abs(radius(absorbed.sum()) - expected_radius(camera)) < 0.5


def test_eulers_shadow_is_wrong_by_the_first_order(traced):
    """Constant steps h: the error of the radius halves with h, and extrapolated to h = 0 it is the formula's, but for
    the pixels' own grid: counting centres gives the area of a circle of 20 pixels to some 5 pixels, 0.04 of radius.
    """
    measured = {}
    for step in (0.2, 0.1, 0.05):
        exported, absorbed = traced(
            "schwarzschild", integrator="euler", step_control="constant", step=step, steps_per_segment=10, segments=3000
        )
        measured[step] = radius(absorbed.sum())
    expected = expected_radius(exported.camera)
    errors = {step: expected - value for step, value in measured.items()}
    assert all(error > 0 for error in errors.values())  # Euler's rays leave the hole's pull too early
    assert 1.7 < errors[0.1] / errors[0.05] < 2.3
    assert abs(2 * measured[0.05] - measured[0.1] - expected) < 3 * 0.04


def test_the_papers_step_doubling_keeps_half_a_pixel(traced):
    """Section 4.2 with Euler's method: the tolerance is half a pixel a segment."""
    exported, absorbed = traced("schwarzschild", pipeline="paper", integrator="euler", step_control="doubling")
    assert abs(radius(absorbed.sum()) - expected_radius(exported.camera)) < 0.5

"""render() as its callers use it: sizes, tiles, samples, regions, progress, cancelling, and what it refuses."""

import dataclasses
import math
import threading
import time

import numpy as np
import pytest

from addon.core import device as gpu
from addon.core import trace
from addon.core.device import DeviceError
from addon.core.models import MODELS
from addon.core.scene import Camera, Environment, Image, Light, Material, Placement, Scene, SceneError
from addon.core.settings import Settings, SettingsError
from addon.core.status import Status
from addon.core.trace import Cancelled, render
from tests.shaders import scenes, truth

PASSES = ("Combined", "Depth", "Position", "Normal", "Object Index", "Direction", "Status", "Steps")


def lit(view, model=scenes.STRAIGHT, **options):
    return scenes.mixed(model, view, ambient=(1.0, 1.0, 1.0), environment=Environment((0.0, 0.0, 1.0)), **options)


@pytest.mark.parametrize("size", [(1, 1), (1, 7), (300, 2), (257, 259)])
def test_any_size_even_more_than_a_tile(size):
    """Tiles that do not divide the picture leave no seam, gap or overlap: every pixel is where numpy casts it."""
    scene = lit(scenes.camera(*size), count=6)
    frame = render(scene, scenes.papers(passes=PASSES))
    assert frame.size == size
    exact = truth.cast(scene)
    clear = exact.margin > 1e-3
    hit = frame.passes["Status"][..., 0] == Status.HIT
    assert np.array_equal(hit[clear], exact.hit[clear])
    assert np.array_equal(frame.passes["Object Index"][..., 0][clear], exact.object_index[clear])
    assert frame.statistics.ray_count == size[0] * size[1]


def test_the_picture_does_not_depend_on_the_tiles(monkeypatch):
    scene = lit(scenes.camera(37, 23), MODELS["schwarzschild"](mass=0.3))
    settings = scenes.papers(passes=PASSES, segments=300, tolerance=1e-2)
    whole = render(scene, settings).passes
    monkeypatch.setattr(trace, "TILE", 16)
    tiled = render(scene, settings).passes
    for name in PASSES:
        assert np.array_equal(whole[name], tiled[name]), name


@pytest.mark.parametrize("model", ["straight", "schwarzschild"])
def test_a_region_is_the_crop_of_the_whole(model):
    view = scenes.camera(40, 30)
    settings = scenes.papers(passes=PASSES, segments=300, tolerance=1e-2)
    values = {"mass": 0.3} if model == "schwarzschild" else {}
    whole = render(lit(view, MODELS[model](**values)), settings).passes
    x0, y0, x1, y1 = region = (7, 11, 33, 28)
    part = render(lit(dataclasses.replace(view, region=region), MODELS[model](**values)), settings)
    assert part.size == (26, 17)
    for name in PASSES:
        assert np.array_equal(part.passes[name], whole[name][y0:y1, x0:x1]), name


@pytest.mark.parametrize("axis", [0, 1])
def test_samples_are_averaged(axis):
    """A half plane that ends 0.2 pixels beside the centre of the picture's only pixel: the mean is the share of the
    samples that lie in it (test_sampling.py says how they are spread); a single sample sees all or nothing.
    """
    # x or z below -0.2: 32 % of the filter of 1.5 pixels
    edge = (
        scenes.quad((-2.2, 0, 0), (2, 0, 0), (0, 0, 9))
        if axis == 0
        else scenes.quad((0, 0, -2.2), (9, 0, 0), (0, 0, 2))
    )
    view = Camera(scenes.look_at((0, -5, 0), (0, 0, 0)), (-0.5, 0.5, -0.5, 0.5), 1, 1, "ORTHOGRAPHIC")
    glow = Material(base_color=(0, 0, 0), emission=(1.0, 1.0, 1.0))
    scene = Scene(view, scenes.STRAIGHT, triangles=edge, materials=(glow,))
    assert render(scene, scenes.papers()).passes["Combined"][0, 0, 0] == 0.0
    for samples in (4, 16, 64):
        frame = render(scene, scenes.papers(samples=samples, passes=("Combined", "Status")))
        share = np.mean([trace.sample_offset(sample, 1.5)[axis] < -0.2 for sample in range(samples)])
        assert frame.passes["Combined"][0, 0, 0] == pytest.approx(share, abs=1e-6)
        assert share == pytest.approx(0.32, abs=3.0 / samples)
        assert frame.statistics.ray_count == samples
        # Other passes are the centre's alone: a status is no average.
        assert frame.passes["Status"][0, 0, 0] == Status.ESCAPED


def test_samples_of_a_flat_colour_change_nothing():
    scene = Scene(scenes.camera(4, 4), scenes.STRAIGHT, environment=Environment((0.25, 0.5, 0.75)))
    # Three thirds are one within a rounding each.
    assert render(scene, scenes.papers(samples=3)).passes["Combined"] == pytest.approx(
        np.broadcast_to([0.25, 0.5, 0.75, 1.0], (4, 4, 4)), abs=2e-7
    )


# Progress and cancelling


def long_work(pipeline="paper"):
    """Minutes on a CPU: many segments of short steps."""
    steps = {"step": 1e-4, "segments": 100_000, "steps_per_segment": 50, "max_steps": 5_000_000}
    settings = Settings(pipeline=pipeline, integrator="euler", step_control="constant", **steps)
    return Scene(scenes.camera(128, 128, (0, -30, 0)), scenes.HOLE), settings


def test_progress_is_monotonic_and_ends_at_one(monkeypatch):
    monkeypatch.setattr(trace, "TILE", 16)
    calls = []
    thread = threading.get_ident()
    scene = lit(scenes.camera(40, 40), MODELS["schwarzschild"](mass=0.3))

    def progress(fraction, sentence):
        assert threading.get_ident() == thread
        calls.append((fraction, sentence))

    render(scene, scenes.papers(samples=2, segments=100, tolerance=1e-2), progress=progress)
    fractions = [fraction for fraction, _ in calls]
    assert len(fractions) > 9
    assert fractions == sorted(fractions)
    assert 0.0 <= fractions[0] < 0.2 and fractions[-1] == 1.0
    assert calls[-1][1] == "Done" and all(isinstance(sentence, str) for _, sentence in calls)


def test_cancel_before_the_start():
    scene, settings = long_work()
    with pytest.raises(Cancelled):
        render(scene, settings, cancelled=lambda: True)


@pytest.mark.parametrize("pipeline", ["paper", "fused"])
def test_cancel_is_prompt_and_the_device_is_free_again(pipeline):
    """Half a second after the start; the answer within one poll, and what was queued does not keep the next render."""
    scene, settings = long_work(pipeline)
    render(Scene(scenes.camera(2, 2), scenes.HOLE), dataclasses.replace(settings, segments=1))  # compiled
    asked = []
    begin = time.monotonic()

    def cancelled():
        if time.monotonic() - begin > 0.5:
            asked.append(time.monotonic())
        return bool(asked)

    with pytest.raises(Cancelled):
        render(scene, settings, cancelled=cancelled)
    assert time.monotonic() - asked[0] < 1.0
    render(Scene(scenes.camera(2, 2), scenes.STRAIGHT), scenes.papers())
    assert time.monotonic() - asked[0] < 10.0


def test_an_error_in_progress_reaches_the_caller_and_stops_the_work():
    scene, settings = long_work()

    def progress(fraction, sentence):
        raise ZeroDivisionError("the caller's own")

    with pytest.raises(ZeroDivisionError, match="the caller's own"):
        render(scene, settings, progress=progress)
    render(Scene(scenes.camera(2, 2), scenes.STRAIGHT), scenes.papers())


def test_two_threads_may_render_at_once():
    scene = lit(scenes.camera(16, 12))
    expected = render(scene, scenes.papers()).passes["Combined"]
    results = []
    threads = [
        threading.Thread(target=lambda: results.append(render(scene, scenes.papers()).passes["Combined"]))
        for _ in range(3)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(results) == 3 and all(np.array_equal(result, expected) for result in results)


# What is refused


def sized(width, height, region=None):
    return Scene(Camera(np.eye(4), (-1, 1, -1, 1), width, height, region=region), scenes.STRAIGHT)


@pytest.mark.parametrize("size", [(0, 10), (10, 0), (-5, 10), (100_000, 10), (10, 100_000)])
def test_impossible_sizes(size):
    with pytest.raises(SceneError, match=rf"The image is {size[0]} x {size[1]} pixels, but a side must lie in"):
        render(sized(*size), scenes.papers())


def test_an_empty_region():
    with pytest.raises(SceneError, match="0 x 5 pixels"):
        render(sized(10, 10, (3, 0, 3, 5)), scenes.papers())


@pytest.mark.parametrize("scale", [0.0, -1.0, math.nan, math.inf])
def test_impossible_scales(scale):
    with pytest.raises(SceneError, match=r"The model's scale is .*, but must be positive\. Change Scale"):
        render(dataclasses.replace(sized(4, 4), placement=Placement(scale=scale)), scenes.papers())


@pytest.mark.parametrize("broken", ["camera", "position", "rotation", "window"])
def test_places_that_are_not_numbers(broken):
    scene = sized(4, 4)
    if broken == "camera":
        scene.camera.world_from_camera[0, 3] = math.nan
    elif broken == "window":
        scene = dataclasses.replace(scene, camera=dataclasses.replace(scene.camera, window=(-1, math.nan, -1, 1)))
    else:
        bad = {"position": np.array([math.inf, 0, 0]), "rotation": np.full((3, 3), math.nan)}[broken]
        scene = dataclasses.replace(scene, placement=Placement(**{broken: bad}))
    with pytest.raises(SceneError, match="not a number"):
        render(scene, scenes.papers())


@pytest.mark.parametrize("observer", ["chart", "static"])
def test_no_camera_inside_the_horizon(observer):
    matrix = np.eye(4)
    matrix[2, 3] = 1.5
    scene = Scene(Camera(matrix, (-1, 1, -1, 1), 4, 4), scenes.HOLE)
    with pytest.raises(SceneError, match=r"r = 1\.5, inside the horizon"):
        render(scene, scenes.papers(observer=observer))


def test_the_error_pass_needs_a_step_control():
    with pytest.raises(SettingsError, match="'Error' needs a step control"):
        render(Scene(scenes.camera(4, 4), scenes.HOLE), scenes.papers(step_control="constant", passes=("Error",)))


def test_the_memory_limit(monkeypatch):
    with pytest.raises(
        SceneError, match=r"The frame needs 65\d\d\d MiB, but 4096 MiB are allowed\. Lower the resolution"
    ):
        render(sized(65536, 65536), scenes.papers())
    monkeypatch.setattr(trace, "memory_limit_bytes", 1 << 10)
    with pytest.raises(SceneError, match="Memory Limit"):
        render(sized(64, 64), scenes.papers())


def test_a_texture_beyond_the_device():
    def too_large(device):
        device.texture((device.texture_limit + 1, 1))

    with pytest.raises(DeviceError, match=r"A texture of \d+ x 1 is needed, but '.*' allows \d+"):
        gpu.run(too_large)


# What is left out


def everything():
    image = Image("grey", np.full((2, 2, 4), 0.5, np.float32))
    return scenes.mixed(
        MODELS["schwarzschild"](mass=0.3),
        scenes.camera(8, 6),
        lights=(Light("SUN", (1, 1, 1)),),
        materials=(Material(base_image=0),),
        images=(image,),
        ambient=(0.5, 0.5, 0.5),
        environment=Environment(faces=np.ones((6, 4, 4, 3), np.float32)),
    )


def texts_of(scene, settings, monkeypatch):
    """Everything that is given to the compiler for a frame, with an empty program cache."""
    texts = []
    original = gpu.compose

    def spy(choice):
        source = original(choice)
        texts.append(source.text)
        return source

    monkeypatch.setattr(gpu, "compose", spy)
    gpu.run(lambda device: device._programs.clear())
    frame = render(scene, settings)
    monkeypatch.setattr(gpu, "compose", original)
    return "\n".join(texts), frame.statistics


SURFACE = ("Combined", "Normal")
FEATURES = {
    # what is taken away, words of it in the shaders' texts, what the statistics call it
    "triangles": ({"triangles": scenes.Triangles.empty()}, {}, ("u_triangles", "u_corners"), "triangles"),
    "spheres": ({"spheres": scenes.spheres(np.zeros((0, 3)), 1.0)}, {}, ("u_spheres",), "spheres"),
    "lights": ({"lights": ()}, {}, ("u_lights", "light_at"), "lights"),
    "images": ({"materials": (Material(),)}, {}, ("u_image_texels", "sample_image"), "image textures"),
    "environment": ({"environment": Environment((1, 1, 1))}, {}, ("samplerCube",), "environment texture"),
    "surface": ({}, {"passes": ("Combined",)}, ("out_surface", "u_surface"), "surface passes"),
    "step control": ({}, {"step_control": "constant"}, ("u_tolerance", "u_full_x"), "step control"),
    "observer": ({}, {"observer": "chart"}, ("normalize(static_frame",), "observer"),
    "tally": ({}, {}, (), None),
}


@pytest.mark.parametrize("feature", [name for name in FEATURES if name != "tally"])
def test_what_a_scene_does_not_have_is_neither_compiled_nor_uploaded(feature, monkeypatch):
    scene_change, settings_change, words, phrase = FEATURES[feature]
    settings = {"passes": SURFACE, "observer": "static", "segments": 20}
    full_text, full = texts_of(everything(), scenes.papers(**settings), monkeypatch)
    text, statistics = texts_of(
        dataclasses.replace(everything(), **scene_change), scenes.papers(**(settings | settings_change)), monkeypatch
    )
    for word in words:
        assert word in full_text and word not in text
    assert phrase not in full.left_out and phrase in statistics.left_out
    assert len(text) < len(full_text)
    if scene_change:
        assert statistics.texture_bytes < full.texture_bytes


def test_an_empty_scene_compiles_and_uploads_nothing_of_objects(monkeypatch):
    text, statistics = texts_of(Scene(scenes.camera(4, 4), scenes.HOLE), scenes.papers(segments=5), monkeypatch)
    for word in ("first_hit", "u_materials", "u_color", "out_tally", "u_surface"):
        assert word not in text
    assert statistics.texture_bytes == 0


def test_a_straight_model_does_not_integrate():
    frame = render(lit(scenes.camera(4, 4)), scenes.papers(passes=("Steps",), max_steps=100_000))
    assert (frame.passes["Steps"] == 1).all()
    assert "integration" in frame.statistics.left_out


# Values are uniforms


def test_moving_anything_compiles_nothing():
    def programs():
        return gpu.run(lambda device: device.program_count)

    settings = scenes.papers(passes=("Combined", "Depth"), segments=400)
    scene = everything()
    first = render(scene, settings).passes["Combined"]
    count = programs()
    changes = (
        {"model": MODELS["schwarzschild"](mass=0.1)},
        {"camera": scenes.camera(8, 6, (1.0, -7.0, 0.5), half=0.4)},
        {"camera": scenes.camera(20, 10)},
        {"lights": (Light("POINT", (99, 9, 9), (0, -5, 3)), Light("AREA", (9, 9, 9)))},
        {"placement": Placement(np.array([0.1, 0.2, 0.3]), scenes.rotation(1, 2, 3), 1.7)},
        {"ambient": (0.3, 0.2, 0.1)},
        {"triangles": scenes.random_soup(100, seed=77)},
        {"materials": (Material(base_color=(0.1, 0.2, 0.3), base_image=0),)},
    )
    for change in changes:
        picture = render(dataclasses.replace(scene, **change), settings).passes["Combined"]
        assert programs() == count, change
        assert picture.shape != first.shape or not np.array_equal(picture, first), change
    for change in ({"tolerance": 1e-2}, {"step": 0.01}, {"segments": 7}, {"escape_radius": 50.0}, {"samples": 2}):
        render(scene, dataclasses.replace(settings, **change))
        assert programs() == count, change


def test_statistics_say_what_happened():
    frame = render(lit(scenes.camera(16, 12)), scenes.papers(passes=("Combined", "Steps")))
    statistics = frame.statistics
    assert statistics.ray_count == 16 * 12 and set(statistics.rays) == {Status.HIT, Status.ESCAPED}
    assert all(value >= 0 for value in statistics.milliseconds.values()) and statistics.milliseconds
    assert statistics.device and statistics.steps == (1, 1.0)


def test_warnings_of_scene_and_packing_are_handed_on():
    scene = dataclasses.replace(lit(scenes.camera(4, 4)), warnings=("from the export",))
    scene.triangles.positions[0, 0, 0] = math.nan
    frame = render(scene, scenes.papers())
    assert frame.warnings[0] == "from the export" and "were skipped" in frame.warnings[1]

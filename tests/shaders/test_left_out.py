"""What a scene does not need is not in the programs' text, not uploaded and not drawn; what compiles anew, what never.

Watched is what reaches the device: the text given to the compiler, the bytes of textures with content, the draws.
"""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from addon.core import device as gpu
from addon.core.models import MODELS
from addon.core.pipelines.fused import FusedPipeline
from addon.core.pipelines.paper import PaperPipeline
from addon.core.scene import Environment, Image, Light, Material, Placement, Spheres, Triangles
from addon.core.settings import Settings
from addon.core.trace import OUTPUTS, camera_uniforms, make_request, pack_for, render
from tests.shaders import scenes

PIPELINES = ("paper", "fused")
WORMHOLE = MODELS["wormhole"](throat_radius=0.5)
GRID = MODELS["refraction"](medium="grid", grid=np.ones((4, 5, 6), np.float32))


def sky(size=8):
    return Environment(faces=np.random.default_rng(1).random((6, size, size, 3), dtype=np.float32))


def everything(model=scenes.HOLE, **options):
    """A scene that needs every part but a volume, and a second sky unless the model has a far side."""
    pixels = np.random.default_rng(3).random((9, 16, 4), dtype=np.float32)
    return scenes.mixed(
        model,
        scenes.camera(16, 12),
        materials=(Material(base_image=0),),
        images=(Image("noise", pixels),),
        lights=(Light("POINT", (90.0, 80.0, 70.0), (3.0, -5.0, 4.0)),),
        ambient=(0.5, 0.5, 0.5),
        environment=sky(),
        far_environment=sky(4),
        **options,
    )


def with_everything(pipeline, **changes):
    """Settings that ask for every output. Numbers of segments and of draws do not depend on time or on rays."""
    settings = {
        "pipeline": pipeline,
        "integrator": "dormand_prince_54" if pipeline == "fused" else "euler",
        "step_control": "embedded" if pipeline == "fused" else "doubling",
        "tolerance": 1e-3,
        "segments": 4,
        "steps_per_segment": 2,
        "early_termination": "off",
        "batch_size": 64,
        "observer": "static",
        "passes": ("Combined", "Normal", "Depth", "Error", "Frequency Shift"),
    }
    return Settings(**(settings | changes))


class Watched:
    """What a frame gives to the device."""

    def __init__(self):
        self.text, self.bytes, self.draws = "", 0, 0


@pytest.fixture
def watch(egl, monkeypatch):
    """watch(scene, settings) -> Watched, of a frame that finds no program compiled."""

    def frame(scene, settings):
        watched = Watched()
        originals = {name: getattr(gpu.Device, name) for name in ("texture", "cube", "volume")}

        def texture(device, size, data=None, dtype="f4", components=4):
            watched.bytes += 0 if data is None else size[0] * size[1] * components * gpu.BYTES[dtype]
            return originals["texture"](device, size, data, dtype, components)

        def cube(device, faces, mipmaps=False):
            made = originals["cube"](device, faces, mipmaps)
            levels = faces.shape[1].bit_length() if mipmaps else 1
            watched.bytes += sum(72 * max(faces.shape[1] >> level, 1) ** 2 for level in range(levels))
            return made

        def volume(device, data, dtype="f4"):
            watched.bytes += data.size * gpu.BYTES[dtype]
            return originals["volume"](device, data, dtype)

        def compose(choice, original=gpu.compose):
            source = original(choice)
            watched.text += source.text
            return source

        def draw(program, *given, original=gpu.Program.draw):
            watched.draws += 1
            return original(program, *given)

        gpu.run(lambda device: device._programs.clear())
        with monkeypatch.context() as patch:
            patch.setattr(gpu, "compose", compose)
            patch.setattr(gpu.Program, "draw", draw)
            for name, spy in (("texture", texture), ("cube", cube), ("volume", volume)):
                patch.setattr(gpu.Device, name, spy)
            watched.frame = render(scene, settings)
        return watched

    return frame


# What is taken away: the scene before; changes of the scene; changes of the settings; words that go from the text, in
# both pipelines; whether bytes are saved; whether the paper's pipeline, which has a pass for each task, draws less.
PARTS = {
    "triangles": (
        everything(), {"triangles": Triangles.empty()}, {},
        ("u_triangles", "u_corners", "meet_triangle", "edge1"), True, True,
    ),
    "spheres": (
        everything(), {"spheres": Spheres.empty()}, {},
        ("u_spheres", "meet_sphere", "half_chord"), True, True,
    ),
    "objects": (
        everything(), {"triangles": Triangles.empty(), "spheres": Spheres.empty()}, {},
        ("first_hit", "u_empty_space", "u_materials", "u_lights", "u_image_texels", "shade("), True, True,
    ),
    "textures": (
        everything(), {"materials": (Material(),)}, {},
        ("u_image_table", "u_image_texels", "sample_image", "vec4 bilinear("), True, False,
    ),
    "lights": (everything(), {"lights": ()}, {}, ("u_lights", "light_at", "Illumination"), True, False),
    "environment": (
        everything(), {"environment": Environment((1.0, 1.0, 1.0))}, {}, ("samplerCube", "u_sky;"), True, False,
    ),
    "second sky": (everything(WORMHOLE), {"far_environment": None}, {}, ("u_far_sky", "far_environment"), True, False),
    "a second sky's picture": (
        everything(WORMHOLE), {"far_environment": Environment((1.0, 1.0, 1.0))}, {}, ("samplerCube u_far_sky",),
        True, False,
    ),
    "volume": (
        everything(GRID), {"model": MODELS["refraction"](medium="fisheye")}, {}, (" sampler3D", "u_grid"), True, False,
    ),
    "integration": (
        everything(), {"model": scenes.STRAIGHT}, {"passes": ("Combined", "Normal")},
        ("u_tolerance", "u_smallest_step", "next_step", "u_empty_space"), "fused", True,
    ),
    "combined": (
        everything(), {}, {"passes": ("Normal", "Depth", "Error", "Frequency Shift")},
        ("environment(", "samplerCube", "shade(", "light_at", "sample_image", "out_color"),
        True, True,
    ),
    "surface passes": (
        everything(), {}, {"passes": ("Combined", "Depth", "Error", "Frequency Shift")}, ("out_surface",), False, False,
    ),
    "tally": (everything(), {}, {"passes": ("Combined", "Normal", "Frequency Shift")}, ("out_tally",), False, False),
    "frequency shift": (
        everything(), {}, {"passes": ("Combined", "Normal", "Depth", "Error")}, ("out_frequency", "frequency_shift"),
        False, False,
    ),
    "observer": (everything(), {}, {"observer": "chart"}, ("normalize(static_frame",), False, False),
    "step control": (
        everything(), {}, {"step_control": "constant", "passes": ("Combined", "Normal", "Depth", "Frequency Shift")},
        ("u_tolerance", "next_step"), False, True,
    ),
}  # fmt: skip


# What the statistics call it, where not by the same name; None: they do not tell.
PHRASES = {
    "objects": "triangles",
    "textures": "image textures",
    "environment": "environment texture",
    "second sky": "sky of the far side",
    "a second sky's picture": None,
    "combined": None,
    "tally": "tally of steps and errors",
}


@pytest.mark.parametrize("pipeline", PIPELINES)
@pytest.mark.parametrize("part", PARTS)
def test_what_is_not_there_is_not_compiled_uploaded_or_drawn(part, pipeline, watch):
    scene, scene_changes, setting_changes, words, saves_bytes, draws_less = PARTS[part]
    phrase = PHRASES.get(part, part)
    full = watch(scene, with_everything(pipeline))
    less = watch(replace(scene, **scene_changes), with_everything(pipeline, **setting_changes))
    for word in words:
        assert word in full.text or (part, word, pipeline) in ELSEWHERE, word
        assert word not in less.text, word
    assert len(less.text) < len(full.text)
    assert less.bytes < full.bytes if saves_bytes in (True, pipeline) else less.bytes == full.bytes
    assert phrase is None or (phrase in less.frame.statistics.left_out and phrase not in full.frame.statistics.left_out)
    if pipeline == "paper":
        assert less.draws < full.draws if draws_less else less.draws == full.draws
    else:
        assert less.draws == full.draws == 1  # one program does all
    print(f"{part}, {pipeline}: {full.bytes} -> {less.bytes} bytes, {full.draws} -> {less.draws} draws")


# Words of one pipeline only.
ELSEWHERE = {
    ("integration", "next_step", "fused"),
    ("step control", "next_step", "fused"),
    ("objects", "u_empty_space", "paper"),
    ("integration", "u_empty_space", "paper"),
}

FUSED_PARTS = {
    "filtering": (
        {"filter_textures": False},
        ("textureLod", "u_image_mips", "u_mip_table", "dFdx", "Footprint", "u_pixel_cone"),
        True,
    ),
    "further samples": ({"edge_samples": 1}, ("u_quads",), True),
}


@pytest.mark.parametrize("part", FUSED_PARTS)
def test_what_the_fused_pipeline_adds_can_be_left_out(part, watch):
    changes, words, saves_bytes = FUSED_PARTS[part]
    full = watch(everything(), with_everything("fused", edge_samples=2))
    less = watch(everything(), with_everything("fused", **({"edge_samples": 2} | changes)))
    for word in words:
        assert word in full.text and word not in less.text, word
    assert (less.bytes < full.bytes) == saves_bytes
    phrase = {"filtering": "filtering of textures", "further samples": "further samples at edges"}[part]
    assert phrase in less.frame.statistics.left_out and phrase not in full.frame.statistics.left_out


@pytest.mark.parametrize("words", [("u_mip_table", "u_image_mips", "filtered_image"), ("filtered_sky",)])
def test_only_what_is_there_is_filtered(words, watch):
    scene = everything()
    without = {"images": (), "materials": (Material(),)} if len(words) == 3 else {"environment": Environment()}
    text = watch(replace(scene, **without), with_everything("fused")).text
    for word in words:
        assert word not in text
    assert "Footprint" in text
    nothing = replace(scene, images=(), materials=(Material(),), environment=Environment())
    assert "Footprint" not in watch(nothing, with_everything("fused")).text


def test_the_statistics_count_the_bytes_of_the_scene(watch):
    """Tables, images with their levels, skies with theirs: a third more, less what a level of one texel a face would be
    if it could be halved.
    """
    for pipeline, model in itertools.product(PIPELINES, (scenes.HOLE, GRID)):
        watched = watch(everything(model), with_everything(pipeline))
        assert watched.frame.statistics.texture_bytes == pytest.approx(watched.bytes, abs=72 * 2)


# What compiles


def programs(scene, settings):
    """The keys of the programs of a frame; no device is asked."""
    asked = frozenset(OUTPUTS[name] for name in settings.passes if name in OUTPUTS)
    request = make_request(scene, settings, pack_for(scene, settings), camera_uniforms(scene), asked)
    pipeline = (FusedPipeline if settings.pipeline == "fused" else PaperPipeline).__new__(
        FusedPipeline if settings.pipeline == "fused" else PaperPipeline
    )
    pipeline.request, pipeline.settings = request, request.settings
    if settings.pipeline == "fused":
        return {pipeline._choose_program()}
    pipeline.doubling = request.settings.step_control == "doubling"
    pipeline._choose_programs()
    return set(pipeline.choices())


CHOICES = [
    (name, dict(zip([option.name for option in model.options], keys, strict=True)))
    for name, model in MODELS.items()
    for keys in itertools.product(*[[key for key, _, _ in option.choices] for option in model.options])
]


@pytest.mark.parametrize("pipeline", PIPELINES)
@pytest.mark.parametrize(("name", "chosen"), CHOICES, ids=str)
def test_no_slider_of_a_model_compiles_anything(name, chosen, pipeline):
    extras = {"grid": np.ones((3, 3, 3), np.float32)} if chosen.get("medium") == "grid" else {}
    scene = scenes.mixed(MODELS[name](**chosen, **extras), count=2)
    settings = with_everything(pipeline, observer="chart")
    before = programs(scene, settings)
    for parameter in MODELS[name].parameters:
        for value in (parameter.soft_minimum, parameter.soft_maximum, 0.9 * parameter.default + 0.05):
            value = min(max(value, parameter.minimum), parameter.maximum)
            try:
                moved = MODELS[name](**chosen, **extras, **{parameter.name: value})
            except ValueError:  # not with the others' defaults
                continue
            assert programs(replace(scene, model=moved), settings) == before, (parameter.name, value)


def test_no_slider_of_a_hole_with_nothing_but_a_sky_compiles_anything():
    """Its program is another one, for orbits; also for the mass of 0 that the slider begins with."""
    scene = replace(everything(), triangles=Triangles.empty(), spheres=Spheres.empty())
    settings = with_everything("fused", integrator="automatic")
    before = programs(scene, settings)
    for mass in (0.0, 1e-6, 0.3, 2.0):
        assert programs(replace(scene, model=MODELS["schwarzschild"](mass=mass)), settings) == before, mass
    assert programs(everything(), settings) != before


NEVER = {
    "another mass": {"model": MODELS["schwarzschild"](mass=0.1)},
    "another camera": {"camera": scenes.camera(8, 6, (1.0, -7.0, 0.5), half=0.4)},
    "another resolution": {"camera": scenes.camera(64, 20)},
    "a region": {"camera": scenes.camera(16, 12, region=(2, 3, 9, 8))},
    "other lights": {"lights": (Light("SUN", (9, 9, 9)), Light("AREA", (9, 9, 9)))},
    "another place": {"placement": Placement(np.array([0.1, 0.2, 0.3]), scenes.rotation(1, 2, 3), 1.7)},
    "another ambient light": {"ambient": (0.3, 0.2, 0.1)},
    "more triangles": {"triangles": scenes.random_soup(100, seed=77)},
    "more spheres": {"spheres": scenes.spheres([[1.0, 1.0, 1.0]] * 9, 0.1)},
    "other materials": {"materials": (Material(base_color=(0.1, 0.2, 0.3), base_image=0), Material())},
    "another image": {"images": (Image("one", np.ones((1, 1, 4), np.float32), "CLIP", "CLOSEST"),)},
    "another sky": {"environment": sky(16)},
}
NEVER_SETTINGS = {
    "tolerance": 1e-2, "chord_tolerance": 1e-4, "step": 0.01, "segments": 7, "steps_per_segment": 3, "max_steps": 77,
    "escape_radius": 50.0, "samples": 2, "filter_width": 3.0, "batch_size": 5, "failed_rays": "marker",
}  # fmt: skip


@pytest.mark.parametrize("pipeline", PIPELINES)
def test_no_value_compiles_anything(pipeline):
    settings = with_everything(pipeline)
    before = programs(everything(), settings)
    for name, change in NEVER.items():
        assert programs(replace(everything(), **change), settings) == before, name
    for name, value in NEVER_SETTINGS.items():
        assert programs(everything(), replace(settings, **{name: value})) == before, name


ALWAYS = {
    "another model": {"model": WORMHOLE},
    "no triangles": {"triangles": Triangles.empty()},
    "no spheres": {"spheres": Spheres.empty()},
    "no lights": {"lights": ()},
    "no images": {"materials": (Material(),)},
    "a sky of one colour": {"environment": Environment((1, 1, 1))},
    "straight light": {"model": scenes.STRAIGHT},
}
ALWAYS_SETTINGS = {
    "integrator": "bogacki_shampine_32", "step_control": "constant", "observer": "moving",
    "passes": ("Combined", "Normal", "Error"),
}  # fmt: skip


@pytest.mark.parametrize("pipeline", PIPELINES)
def test_other_parts_are_other_programs(pipeline):
    settings = with_everything(pipeline)
    before = programs(everything(), settings)
    for name, change in ALWAYS.items():
        moved = (
            replace(settings, step_control="constant", passes=("Combined",)) if name == "straight light" else settings
        )
        assert programs(replace(everything(), **change), moved) != before, name
    for name, value in ALWAYS_SETTINGS.items():
        change = {name: value}
        if name == "step_control":
            change["passes"] = ("Combined", "Normal", "Depth", "Frequency Shift")
        assert programs(everything(), replace(settings, **change)) != before, name
    orthographic = replace(everything().camera, kind="ORTHOGRAPHIC")
    assert programs(replace(everything(), camera=orthographic), settings) != before
    for name, value in (("filter_textures", False), ("edge_samples", 9)):
        assert (programs(everything(), replace(settings, **{name: value})) != before) == (pipeline == "fused"), name


@pytest.mark.parametrize("pipeline", PIPELINES)
def test_a_second_frame_compiles_nothing(pipeline, egl):
    def count():
        return gpu.run(lambda device: device.program_count)

    settings = with_everything(pipeline)
    render(everything(), settings)
    before = count()
    render(replace(everything(), **NEVER["another mass"], **NEVER["another camera"]), settings)
    assert count() == before

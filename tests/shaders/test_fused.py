"""The fused pipeline: the answers of the paper's pipeline and of closed forms; nothing that a scene does not need."""

import dataclasses

import numpy as np
import pytest

from addon.core import textures
from addon.core.compose import compose
from addon.core.empty_space import build as build_space
from addon.core.models import MODELS
from addon.core.pipelines import fused as fused_pipeline
from addon.core.pipelines.fused import FusedPipeline
from addon.core.pipelines.tile import Stopwatch
from addon.core.scene import Environment, Image, Light, Material, Placement, Scene
from addon.core.settings import Settings
from addon.core.status import Status
from addon.core.trace import camera_uniforms, gpu, jobs, make_request, pack_for, render, trace_rays
from tests.shaders import scenes, truth
from tests.shaders.model_checks import parallel_rays

PASSES = ("Combined", "Depth", "Position", "Normal", "Object Index", "Direction", "Status", "Steps")
EMBEDDED = {"integrator": "dormand_prince_54", "step_control": "embedded"}


def lit(model=scenes.STRAIGHT, view=None, **options):
    return scenes.mixed(
        model,
        view or scenes.camera(48, 36),
        ambient=(0.5, 0.5, 0.5),
        environment=Environment((0.0, 0.0, 1.0)),
        lights=(Light("POINT", (90.0, 80.0, 70.0), (3.0, -5.0, 4.0)),),
        **options,
    )


def both(scene, **settings):
    """The frames' passes of the paper's pipeline and of the fused one."""
    return (render(scene, Settings(pipeline=pipeline, **settings)).passes for pipeline in ("paper", "fused"))


@pytest.mark.parametrize("count", [0, 1, 5, 40, 3000])
@pytest.mark.parametrize("with_spheres", [True, False])
def test_brute_force_and_tree_hit_the_same_objects(count, with_spheres):
    """Straight rays: one and the same chord, the same arithmetic in each object. Every index is equal."""
    scene = lit(view=scenes.camera(96, 72), count=max(count, 1))
    if not count:
        scene = dataclasses.replace(scene, triangles=type(scene.triangles).empty())
    if count == 3000:
        scene = dataclasses.replace(scene, triangles=scenes.random_soup(count, size=0.05))
    if not with_spheres:
        scene = dataclasses.replace(scene, spheres=type(scene.spheres).empty())
    paper, fused = both(scene, passes=PASSES)
    assert np.array_equal(paper["Object Index"], fused["Object Index"])
    assert np.array_equal(paper["Status"], fused["Status"])
    for name in ("Combined", "Position", "Normal", "Direction"):
        assert np.abs(paper[name] - fused[name]).max() < 2e-5, name
    hit = fused["Status"][..., 0] == Status.HIT
    away = np.linalg.norm(fused["Position"] - [0.0, -8.0, 1.0], axis=-1)[hit]
    assert fused["Depth"][..., 0][hit] == pytest.approx(away, rel=1e-5)  # the length of the ray


@pytest.mark.parametrize(
    ("model", "settings"),
    [
        (MODELS["schwarzschild"](mass=0.2), {"tolerance": 1e-5}),
        (MODELS["schwarzschild"](mass=0.2), {**EMBEDDED, "tolerance": 1e-5}),
        (MODELS["schwarzschild"](mass=0.2), {"step_control": "constant", "integrator": "verlet", "step": 0.05}),
        (MODELS["lorenz"](strength=2e-4, reach=60.0), {**EMBEDDED, "tolerance": 1e-3}),
    ],
    ids=["nystrom", "dormand-prince", "constant", "lorenz"],
)
def test_what_passes_through_empty_space_would_have_met_nothing(model, settings, monkeypatch):
    """The same objects as where no space is known to be empty and every piece of a ray goes down the tree. Pieces begin
    elsewhere then, and each is right within the chord tolerance of 1e-6: no pixel's middle is so near to an edge.
    """
    scene = dataclasses.replace(lit(model, scenes.camera(192, 144)), triangles=scenes.random_soup(300, size=0.3))
    chosen = Settings(pipeline="fused", passes=PASSES, chord_tolerance=1e-6, **settings)
    quick = render(scene, chosen).passes

    def nowhere_empty(boxes):
        space = build_space(boxes)
        return dataclasses.replace(space, clear=np.zeros_like(space.clear))

    monkeypatch.setattr(textures.empty_space, "build", nowhere_empty)
    slow = render(scene, chosen).passes
    assert (slow["Status"] == Status.HIT).mean() > 0.1 and (slow["Status"] == Status.ESCAPED).mean() > 0.1
    assert np.array_equal(quick["Status"], slow["Status"])
    assert np.array_equal(quick["Object Index"], slow["Object Index"])


@pytest.mark.parametrize("factor", [1e-6, 1e5])
def test_hits_do_not_depend_on_the_unit_of_length(factor):
    """All lengths and the hole's mass times a factor: what is squared on the way keeps within float32's range. A pixel
    whose middle is within the tolerance of an edge may differ.
    """
    scene = lit(MODELS["schwarzschild"](mass=0.3), scenes.camera(96, 72))
    other = dataclasses.replace(
        scenes.scaled(scene, factor), placement=Placement(), model=MODELS["schwarzschild"](mass=0.3 * factor)
    )
    first, second = (render(one, Settings(passes=PASSES)).passes["Object Index"] for one in (scene, other))
    assert (first > 0).mean() > 0.1
    assert (first != second).sum() <= 0.001 * (first > 0).sum()


@pytest.mark.parametrize("radius", [3.0, 0.1])
def test_a_small_sphere_is_met_where_float32_hardly_tells_its_places_apart(radius):
    """From a distance of 1000, where places are rounded by 6e-5 and a piece is as long as the way. The light is all but
    straight, and a pixel's ray passes the centre at its own distance: but for the tolerance, 1e-3 of length, and as
    much for what it is bent, 5e-4, and rounding, 2e-4.
    """
    medium = MODELS["refraction"](medium="linear", index=1.2, gradient=1e-9)
    view = scenes.camera(160, 120, (0.0, -1000.0, 0.0), (0.0, 0.0, 0.0), half=2.0 * radius / 1000.0)
    scene = Scene(view, medium, spheres=scenes.spheres([[0.0, 0.0, 0.0]], [radius]), materials=(Material(),))
    hit = render(scene, Settings(passes=PASSES, tolerance=1e-6)).passes["Object Index"][..., 0] > 0
    x, y = np.meshgrid((np.arange(160) - 79.5) / 40.0, (np.arange(120) - 59.5) / 40.0)  # radii
    off = np.hypot(x, y)
    band = 2e-3 / radius + 0.01
    assert hit[off < 1.0 - band].all() and not hit[off > 1.0 + band].any()


@pytest.mark.parametrize("kind", ["PERSPECTIVE", "ORTHOGRAPHIC"])
def test_straight_rays_meet_what_numpy_casts(kind):
    view = scenes.camera(64, 48, (5.0, -6.0, 4.0), (0.2, 0.1, -0.3))
    if kind == "ORTHOGRAPHIC":
        view = dataclasses.replace(view, kind=kind, window=(-3, 3, -2.2, 2.3))
    scene = lit(view=view)
    passes = render(scene, Settings(pipeline="fused", passes=PASSES)).passes
    exact = truth.cast(scene)
    clear = exact.margin > 1e-4
    assert np.array_equal(passes["Object Index"][..., 0][clear], exact.object_index[clear])


@pytest.mark.parametrize("control", ["constant", "doubling", "doubling, ten steps a chord", "embedded"])
def test_curved_rays_give_the_papers_picture(control):
    """Each pipeline may be wrong by a chord's tolerance: edges differ by as much, and nothing else. Ten steps of a high
    order go far in the paper's pipeline, where they are one chord: its sagitta limits them.
    """
    settings = {
        "constant": {"step_control": "constant", "integrator": "verlet", "step": 0.02, "steps_per_segment": 2},
        "doubling": {"step_control": "doubling", "integrator": "verlet", "tolerance": 1e-4, "steps_per_segment": 1},
        "doubling, ten steps a chord": {
            "step_control": "doubling",
            "integrator": "dormand_prince_54",
            "tolerance": 1e-4,
            "steps_per_segment": 10,
        },
        "embedded": {**EMBEDDED, "tolerance": 1e-4},
    }[control]
    scene = lit(MODELS["schwarzschild"](mass=0.2))
    tolerance = 1e-4
    paper, fused = both(scene, passes=PASSES, segments=4000, chord_tolerance=tolerance, escape_radius=12.0, **settings)
    same = paper["Object Index"] == fused["Object Index"]
    assert same.mean() > 0.99
    hit = same & (fused["Status"] == Status.HIT)
    off = np.linalg.norm(paper["Position"] - fused["Position"], axis=-1)[hit[..., 0]]
    assert np.percentile(off, 90) < 10 * 8 * tolerance and np.median(off) < 8 * tolerance
    sky = same & (paper["Status"] == Status.ESCAPED) & (fused["Status"] == Status.ESCAPED)
    turned = np.linalg.norm(paper["Direction"] - fused["Direction"], axis=-1)[sky[..., 0]]
    assert np.percentile(turned, 90) < 30 * tolerance
    assert (paper["Status"] == fused["Status"]).mean() > 0.99


def test_chords_follow_the_ray_whatever_the_steps():
    """Where long accurate steps are cut by dense output, hits lie where short chords put them."""
    scene = lit(MODELS["schwarzschild"](mass=0.3))
    fine = render(scene, Settings(pipeline="fused", passes=PASSES, tolerance=1e-5, **EMBEDDED)).passes
    for chord_tolerance in (1e-3, 1e-4):
        settings = Settings(
            pipeline="fused", passes=PASSES, tolerance=1e-4, chord_tolerance=chord_tolerance, **EMBEDDED
        )
        passes = render(scene, settings).passes
        same = (passes["Object Index"] == fine["Object Index"]) & (fine["Status"] == Status.HIT)
        assert same.sum() > 0.98 * (fine["Status"] == Status.HIT).sum()
        off = np.linalg.norm(passes["Position"] - fine["Position"], axis=-1)[same[..., 0]]
        assert np.median(off) < 8 * chord_tolerance


def crossings(x, v, force, depth, balls):
    """Times at which x + v t + force t^2 / 2 meets the plane z = depth, or spheres; and those of near misses."""
    times = [np.roots([0.5 * force[2], v[2], x[2] - depth])]
    for centre, radius in zip(balls.centres, balls.radii, strict=True):
        away = x - centre
        quartic = [0.25 * force @ force, force @ v, v @ v + force @ away, 2.0 * v @ away, away @ away - radius**2]
        times.append(np.roots(quartic))
    times = np.concatenate(times)
    return times.real[times.imag == 0.0], times.real[(times.imag != 0.0) & (np.abs(times.imag) < 0.02)]


def test_parabolas_meet_planes_and_spheres_where_they_go_in():
    """Light that falls and rises again, n^2 linear in z: rays that dip through a plane below meet its first side first.
    Closed forms: a quadratic for the plane, quartics for spheres. Rays that pass within 0.02 of tau of touching
    something are left out. Position: twenty roundings of 10 lengths, over the sine of the angle of incidence.
    """
    index, gradient, depth = 1.2, 0.1, -0.3
    view = scenes.camera(64, 48, (0.0, -4.0, 0.0), (0.0, 0.0, 0.0))
    balls = scenes.spheres([(0.6, 1.0, 0.5), (-0.8, 0.0, 0.3), (0.0, 12.0, 5.0)], [0.3, 0.05, 2.0])
    scene = Scene(
        view,
        MODELS["refraction"](medium="linear", index=index, gradient=gradient),
        triangles=scenes.quad((0.0, 0.0, depth), (60.0, 0.0, 0.0), (0.0, 60.0, 0.0)),
        spheres=balls,
        materials=(Material("White"),),
    )
    passes = render(scene, Settings(passes=PASSES)).passes
    hit, place = passes["Status"].ravel() == Status.HIT, passes["Position"].reshape(-1, 3)
    origins, directions = (values.reshape(-1, 3) for values in truth.camera_rays(view))
    force, compared, worst = np.array([0.0, 0.0, 0.5 * gradient]), 0, 0.0
    for i, (x, v) in enumerate(zip(origins, index * directions, strict=True)):
        real, near = crossings(x, v, force, depth, balls)
        real = np.sort(real[real > 0.0])
        touches = len(real) > 1 and np.diff(real[:2])[0] < 0.04
        if touches or (near > 0.0).any():
            continue
        assert hit[i] == (len(real) > 0)
        if hit[i]:
            end = v + real[0] * force
            exact = x + real[0] * (0.5 * (v + end))
            normals = [np.array([0.0, 0.0, 1.0]), *(exact - balls.centres)]
            sine = min(abs(n @ end) / np.linalg.norm(n) / np.linalg.norm(end) for n in normals)
            worst = max(worst, np.linalg.norm(place[i] - exact) * sine / (20 * 2.0**-24 * 10.0))
            compared += 1
    print(f"{compared} hits, {worst:.2f} of what rounding may do")
    assert compared > 1000 and worst < 1.0


def test_hits_of_long_steps_lie_on_the_ray():
    """Lorenz, whose force changes fast along a step of Nystrom's method: a cubic through its ends strays by four times
    the tolerance. Against DOP853 at the tau of the hit; the ray and the piece may each be wrong by the tolerance.
    """
    model = MODELS["lorenz"](strength=2e-5, reach=60.0)
    generator = np.random.default_rng(2)
    balls = scenes.spheres(generator.uniform(-9.0, 9.0, (150, 3)), 0.7)
    view = scenes.camera(48, 36, (0.0, -27.0, 4.5), (0.0, 0.0, 0.0), half=0.4)
    scene = Scene(view, model, spheres=balls, materials=(Material("White"),))
    settings = Settings(passes=PASSES)
    passes = render(scene, settings).passes
    hits = np.flatnonzero(passes["Status"].ravel() == Status.HIT)[::9]
    origins, directions = (values.reshape(-1, 3) for values in truth.camera_rays(view))
    ratios = []
    for i in hits:
        tau = float(passes["Depth"].ravel()[i])
        state = truth.integrate(model, np.concatenate([origins[i], directions[i]])[None], tau)[0]
        off = np.linalg.norm(passes["Position"].reshape(-1, 3)[i] - state[:3])
        ratios.append(off / (settings.tolerance * tau))
    print(f"{len(hits)} hits, off by up to {max(ratios):.2f} of the tolerance")
    assert len(hits) > 40 and max(ratios) < 2.0


@pytest.mark.parametrize("b", [5.4, 6.0, 10.0, 30.0])
def test_rays_meet_darwins_deflection(b):
    """From 1e4 M with the sphere at 1e3 M, what is missing outside it is 1.5 b^3 / r^4 and below 1e-7."""
    settings = Settings(pipeline="fused", tolerance=1e-5, escape_radius=1e3, **EMBEDDED)
    ends = trace_rays(scenes.HOLE, [[-1e4, b, 0.0]], [[1.0, 0.0, 0.0]], settings)
    assert ends.status[0] == Status.ESCAPED
    angle = -np.arctan2(float(ends.direction[0, 1]), float(ends.direction[0, 0])) % (2 * np.pi)
    condition = 1.0 + b * abs(truth.darwin(b + 0.01) - truth.darwin(b - 0.01)) / 0.02
    assert angle == pytest.approx(truth.darwin(b) % (2 * np.pi), abs=1e-5 * condition)


def test_capture_and_escape():
    settings = Settings(pipeline="fused", tolerance=1e-4, **EMBEDDED)
    b = np.array([0.0, 3.0, 5.18, 5.21, 8.0])
    positions = np.stack([np.full(5, -1e3), b, np.zeros(5)], axis=1)
    ends = trace_rays(scenes.HOLE, positions, np.tile([1.0, 0.0, 0.0], (5, 1)), settings)
    assert ends.status.tolist() == [Status.ABSORBED] * 3 + [Status.ESCAPED] * 2


def test_the_step_limit_and_too_small_steps_are_named():
    rays = np.array([[-20.0, 8.0, 0.0]]), np.array([[1.0, 0.0, 0.0]])
    few = Settings(pipeline="fused", max_steps=3, tolerance=1e-6, **EMBEDDED)
    ends = trace_rays(scenes.HOLE, *rays, few)
    assert ends.status[0] == Status.STEP_LIMIT and ends.steps[0] == 3
    constant = Settings(pipeline="fused", step_control="constant", max_steps=7, step=0.1)
    assert trace_rays(scenes.HOLE, *rays, constant).steps[0] == 7


def test_many_rays_are_cut_into_rows():
    """More rays than a tile takes: every one ends as it does when it is traced alone. Drivers compile for whole and for
    partly covered blocks apart, and round apart.
    """
    generator = np.random.default_rng(3)
    positions = generator.normal((0.0, -20.0, 0.0), 1.0, (70_000, 3))
    directions = generator.normal(size=(70_000, 3))
    settings = Settings(pipeline="fused", tolerance=1e-3, **EMBEDDED)
    ends = trace_rays(scenes.HOLE, positions, directions, settings)
    for row in (0, 255, 256, 33_333, 69_999):
        alone = trace_rays(scenes.HOLE, positions[row : row + 1], directions[row : row + 1], settings)
        assert alone.status[0] == ends.status[row]
        assert alone.direction[0] == pytest.approx(ends.direction[row], abs=1e-4)


def test_the_picture_does_not_depend_on_the_tiles(monkeypatch):
    scene = lit(MODELS["schwarzschild"](mass=0.3), scenes.camera(70, 45))
    settings = Settings(pipeline="fused", passes=PASSES, tolerance=1e-3, **EMBEDDED)
    whole = render(scene, settings).passes
    sizes = iter([(16, 8), (32, 8), (8, 32)] * 1000)
    monkeypatch.setattr(FusedPipeline, "tile_size", lambda self: next(sizes))
    tiled = render(scene, settings).passes
    for name in PASSES:
        assert np.array_equal(whole[name], tiled[name]), name


def test_tiles_of_any_size_cover_a_picture_once():
    generator = np.random.default_rng(1)
    for columns, rows in ((1, 1), (7, 100), (64, 64), (101, 37)):
        seen = np.zeros((rows, columns), int)
        for x, y, width, height, sample in jobs(columns, rows, 3, lambda: tuple(generator.integers(1, 40, 2))):
            seen[y : y + height, x : x + width] += 10**sample
        assert (seen == 111).all()


def test_a_tile_shrinks_after_a_long_draw_and_grows_after_a_short_one():
    pipeline = FusedPipeline.__new__(FusedPipeline)
    pipeline.size, pipeline._tile = (10_000, 10_000), (64, 64)
    pipeline._learn(64, 64, 1e-4)
    assert pipeline.tile_size() == (128, 128)
    pipeline._tile = (64, 64)
    pipeline._learn(64, 64, 0.02)
    assert pipeline.tile_size() == (128, 64)
    pipeline._learn(128, 64, 0.04)
    assert pipeline.tile_size() == (128, 64)
    pipeline._learn(128, 64, 0.2)
    assert pipeline.tile_size() == (64, 32)
    pipeline._learn(5, 5, 1e-6)  # what is left at an edge says nothing
    assert pipeline.tile_size() == (64, 32)


def test_the_next_frame_begins_with_half_of_the_tile_that_the_last_one_had_time_for(egl):
    scene, settings = lit(scenes.HOLE, scenes.camera(300, 200)), Settings(**EMBEDDED)
    request = make_request(scene, settings, pack_for(scene, settings), camera_uniforms(scene), frozenset({"color"}))

    def frame(device):
        pipeline = FusedPipeline(device, request, (300, 200), Stopwatch())
        first = pipeline.tile_size()
        pipeline.trace(*first, (0, 0))
        device.tile_sizes[pipeline.choice] = (256, 128)
        return first

    gpu.run(lambda device: device.tile_sizes.clear())
    assert gpu.run(frame) == (fused_pipeline.FIRST_TILE, fused_pipeline.FIRST_TILE)
    assert gpu.run(frame) == (256, 64)


# Left out


def choice(scene, outputs=("color",), **settings):
    settings = Settings(pipeline="fused", **{**EMBEDDED, **settings})
    request = make_request(
        scene, settings, pack_for(scene, settings), camera_uniforms(scene), frozenset(outputs), reach=10.0
    )
    pipeline = gpu.run(lambda device: FusedPipeline(device, request, (4, 4), Stopwatch()))
    return compose(pipeline.choice).text, set(pipeline.textures)


def full():
    pixels = np.zeros((4, 4, 4), np.float32)
    return lit(
        scenes.HOLE,
        materials=(Material(base_image=0),),
        images=(Image("grey", pixels),),
    )


def test_everything_is_there_where_it_is_needed():
    text, uploaded = choice(full())
    for word in ("meet_triangle", "meet_sphere", "sample_image", "light_at", "u_tree", "curve_through", "advance_from"):
        assert word in text, word
    assert uploaded == {
        "u_tree", "u_empty_space", "u_triangles", "u_corners", "u_spheres", "u_materials", "u_lights", "u_image_table",
        "u_image_texels", "u_mip_table", "u_image_mips",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "words", "textures"),
    [
        ({"triangles": None}, ["meet_triangle", "u_triangles"], {"u_triangles", "u_corners"}),
        ({"spheres": None}, ["meet_sphere", "u_spheres"], {"u_spheres"}),
        ({"lights": ()}, ["light_at", "u_lights"], {"u_lights"}),
        (
            {"images": (), "materials": (Material(),)},
            ["sample_image"],
            {"u_image_table", "u_image_texels", "u_mip_table", "u_image_mips"},
        ),
        (
            {"triangles": None, "spheres": None},
            ["u_tree", "u_empty_space", "Curve", "Probe", "shade(", "stray("],
            {"u_tree", "u_empty_space", "u_materials", "u_lights"},
        ),
        (
            {"model": scenes.STRAIGHT},
            ["advance", "rhs(s)", "Curve", "u_tolerance", "absorbed(s)"],
            {"u_empty_space"},
        ),
    ],
    ids=["triangles", "spheres", "lights", "images", "objects", "integration"],
)
def test_left_out(changes, words, textures):
    scene = full()
    changes = {name: type(getattr(scene, name)).empty() if value is None else value for name, value in changes.items()}
    text, uploaded = choice(dataclasses.replace(scene, **changes))
    for word in words:
        assert word not in text, word
    assert not uploaded & textures


def test_without_the_combined_pass_there_is_no_sky_and_no_shading():
    text, uploaded = choice(full(), outputs=("depth",))
    assert "environment" not in text and "shade" not in text and "u_materials" not in text
    assert uploaded - {"u_corners"} == {"u_tree", "u_empty_space", "u_triangles", "u_spheres"}


def test_unasked_outputs_are_left_out():
    text, _ = choice(full())
    for word in ("out_surface", "out_tally", "out_frequency", "invariants(end)"):
        assert word not in text, word
    text, _ = choice(full(), outputs=("color", "surface", "steps", "drift"))
    for word in ("out_surface", "out_tally", "invariants(end)"):
        assert word in text, word


def test_a_triangle_takes_no_more_than_160_bytes():
    """Tree, corners, normals and uvs; a large mesh, for a row of texels is 32 KiB."""
    scene = Scene(scenes.camera(), scenes.STRAIGHT, triangles=scenes.random_soup(20_000, size=0.02))
    packed = pack_for(scene, Settings(pipeline="fused"))
    materials = packed.arrays["u_materials"].nbytes
    assert (packed.bytes - materials) / 20_000 <= 160


@pytest.mark.parametrize("model", sorted(MODELS))
def test_every_model_runs(model):
    scene = lit(MODELS[model](), scenes.camera(8, 6, (0.0, -12.0, 1.0)))
    passes = render(scene, Settings(pipeline="fused", passes=PASSES, tolerance=1e-3, max_steps=500, **EMBEDDED)).passes
    for name in PASSES:
        assert np.isfinite(passes[name]).all(), name
    assert (passes["Status"] > Status.RUNNING).all()


# Long rays: drawn a part at a time


@pytest.mark.parametrize("control", ["constant", "doubling", "embedded"])
def test_rays_that_are_taken_up_again_end_as_if_never_left(control, monkeypatch):
    """All numbers to the bit; in a sky, where no chord ends with a draw."""
    settings = {
        "constant": {"integrator": "runge_kutta_4", "step": 0.1},
        "doubling": {"integrator": "verlet", "tolerance": 1e-4},
        "embedded": {"integrator": "dormand_prince_54", "tolerance": 1e-6},
    }[control]
    scene = Scene(scenes.camera(31, 23, (0, -12, 0)), scenes.HOLE, environment=Environment((0.2, 0.3, 0.4)))
    passes = tuple(each for each in PASSES if each not in ("Normal", "Object Index"))
    settings = Settings(pipeline="fused", step_control=control, passes=passes, **settings)
    monkeypatch.setattr(fused_pipeline, "STEPS_A_DRAW", 100_000)
    whole = render(scene, settings).passes
    monkeypatch.setattr(fused_pipeline, "STEPS_A_DRAW", 7)
    parts = render(scene, settings).passes
    assert whole["Steps"].max() > 21  # three draws at least
    for name in passes:
        assert np.array_equal(whole[name], parts[name]), name


@pytest.mark.parametrize("integrator", ["euler", "dormand_prince_54"])
@pytest.mark.parametrize("steps_per_segment", [1, 10, 50])
def test_no_bunch_of_steps_jumps_over_the_hole(integrator, steps_per_segment):
    """Well below b = 3 sqrt(3) M every ray is absorbed, however long the steps that a loose tolerance allows."""
    settings = Settings(
        pipeline="fused",
        integrator=integrator,
        step_control="doubling",
        tolerance=1e-2,
        steps_per_segment=steps_per_segment,
        segments=5000,
    )
    ends = trace_rays(scenes.HOLE, *parallel_rays(np.linspace(0.0, 4.0, 200)), settings)
    assert (ends.status == Status.ABSORBED).all()

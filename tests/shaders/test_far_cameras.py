"""Shadows seen obliquely from far away, pixel by pixel on their rims, against what the rays conserve in float64.

From r = 1e6 M one rounding of a direction in float32 is three pixels of a picture that the shadow fills. What float32
leaves where nothing cancels is a few roundings of a pixel's place in the window, 1024 eps = 6e-5 pixels each, and those
of the point at the bounding sphere, where a ray begins: 3e-5 M from 1000 M, of pixels of 0.02 M. Together below 0.01
pixels, which is the bound.
"""

from dataclasses import replace

import numpy as np
import pytest

from addon.core.aim import far_camera
from addon.core.models import MODELS
from addon.core.observers import chart_directions, directions_at_rest
from addon.core.scene import Camera, Placement, Scene
from addon.core.settings import Settings
from addon.core.status import Status
from addon.core.trace import camera_uniforms, render, trace_rays
from tests.shaders import scenes
from tests.shaders.test_model_kerr import captured, constants_on_axis

PIXELS = 1024
SIDE = 12  # pixels of the picture around a place of the rim
WRONG = 0.01  # pixels that a ray may be on the wrong side of the rim
HOLE = scenes.HOLE
KERR = MODELS["kerr"](spin=0.9)
BACK = np.array([0.6, -0.48, 0.64])  # from the hole to the camera: oblique
VELOCITY = (0.3, -0.5, 0.2)
TURNED = scenes.rotation(0.4, -0.9, 2.0)
EPS = 2.0**-24


def far_scene(model, r, aside=(0.0, 0.0), placement=None, kind="PERSPECTIVE", turn=0.0, velocity=(0.0, 0.0, 0.0)):
    """A camera at r model lengths, whose picture of 1024 pixels is 20 lengths wide there.

    aside : pixels that the window is shifted by;  turn : radians by which the camera looks past the hole
    velocity : of the observer, world space: the camera looks where he sees the hole
    """
    placement = placement or Placement()
    place = placement.rotation @ (r * BACK) * placement.scale + placement.position
    ahead = (placement.position - place) / np.linalg.norm(placement.position - place)
    matrix = scenes.look_at(place, place + directions_at_rest(-np.array(velocity), ahead[None])[0])
    cosine, sine = np.cos(turn), np.sin(turn)
    matrix[:3, :3] = matrix[:3, :3] @ [[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]]
    pixel = 20.0 / PIXELS * (placement.scale if kind == "ORTHOGRAPHIC" else 1.0 / (r * cosine))
    middle = np.array(aside) * pixel
    if kind == "ORTHOGRAPHIC":  # the rays that he sees as parallel are so at rest, too
        to_hole = matrix[:3, :3].T @ (placement.position - place)
        along = matrix[:3, :3].T @ directions_at_rest(np.array(velocity), -matrix[None, :3, 2])[0]
        middle += (to_hole - along * to_hole[2] / along[2])[:2]
    else:
        middle[0] += sine / cosine
    edges = pixel * PIXELS / 2 * np.array([-1.0, 1.0])
    return Scene(Camera(matrix, (*(middle[0] + edges), *(middle[1] + edges)), PIXELS, PIXELS, kind), model, placement)


def rays(scene, x, y):
    """Positions and directions, model space, float64, (n, 3), of places in the picture, pixels."""
    camera, placement = scene.camera, scene.placement
    left, right, bottom, top = camera.window
    u, v = left + x * (right - left) / camera.width, bottom + y * (top - bottom) / camera.height
    matrix = camera.world_from_camera
    if camera.kind == "PERSPECTIVE":
        positions = np.tile(matrix[:3, 3], (len(x), 1))
        directions = np.stack([u, v, -np.ones_like(u)], axis=1) @ matrix[:3, :3].T
    else:
        positions = np.stack([u, v, np.zeros_like(u)], axis=1) @ matrix[:3, :3].T + matrix[:3, 3]
        directions = np.tile(-matrix[:3, 2], (len(x), 1))
    directions = placement.directions_to_model(directions)
    return placement.points_to_model(positions), directions / np.linalg.norm(directions, axis=1, keepdims=True)


def inside(scene, settings, x, y):
    """bool, (n,): whether light of these places in the picture falls in, by what its ray conserves."""
    positions, directions = rays(scene, x, y)
    velocity = scene.placement.directions_to_model(settings.observer_velocity)
    directions = chart_directions(scene.model, settings.observer, tuple(velocity), positions, directions)
    states = scene.model.initial_states(positions, directions)
    if scene.model.name == "kerr":
        energy, around, carter = constants_on_axis(scene.model, states).T
        return captured(scene.model.spin, -around / energy, carter / energy**2)
    h_squared = np.sum(np.cross(positions, directions) ** 2, axis=1)
    r = np.linalg.norm(positions, axis=1)
    return h_squared < 27.0 * (1.0 - 2.0 * h_squared / r**3)


def rim(scene, settings, count=6):
    """Places on the rim, (count, 2), pixels: from a place within it outwards."""
    span = np.linspace(0.0, PIXELS, 33)
    grid = np.stack(np.meshgrid(span, span), axis=-1).reshape(-1, 2)
    middle = grid[inside(scene, settings, *grid.T)].mean(axis=0)
    angle = 2.0 * np.pi * np.arange(count) / count + 0.3
    across = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    low, high = np.zeros(count), np.full(count, float(PIXELS))
    for _ in range(20):
        half = 0.5 * (low + high)
        within = inside(scene, settings, *(middle + half[:, None] * across).T)
        low, high = np.where(within, half, low), np.where(within, high, half)
    return middle + low[:, None] * across


def wrong_pixels(scene, settings, found):
    """How many pixels around the rim are on its wrong side, though they are farther than WRONG from it.
    found : the scene of a region -> Status
    """
    wrong = edges = 0
    for place in rim(scene, settings):
        x0, y0 = (int(value) - SIDE // 2 for value in place)
        part = replace(scene, camera=replace(scene.camera, region=(x0, y0, x0 + SIDE, y0 + SIDE)))
        y, x = (values.ravel() + 0.5 for values in np.mgrid[y0 : y0 + SIDE, x0 : x0 + SIDE])
        near = np.array([[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]]) * WRONG
        truth = np.array([inside(scene, settings, x + dx, y + dy) for dx, dy in near])
        status = found(part)
        assert np.isin(status, (Status.ABSORBED, Status.ESCAPED)).all()
        wrong += int((truth != (status == Status.ABSORBED)).all(axis=0).sum())
        edges += int(0 < truth[0].sum() < truth[0].size)
    assert edges == len(rim(scene, settings))
    return wrong


def picture(settings):
    settings = replace(settings, passes=("Status",))
    return lambda part: render(part, settings).passes["Status"].ravel()


def seen(observer, **options):
    return Settings(observer=observer, observer_velocity=VELOCITY if observer == "moving" else (0, 0, 0), **options)


@pytest.mark.parametrize("r", [2e3, 1e5, 1e6])
@pytest.mark.parametrize(
    ("model", "observer"),
    [*((HOLE, name) for name in HOLE.observers), *((KERR, name) for name in KERR.observers)],
    ids=lambda value: getattr(value, "name", value),
)
def test_the_rim_is_as_sharp_from_far_away(model, observer, r):
    settings = seen(observer)
    scene = far_scene(model, r, velocity=settings.observer_velocity)
    assert wrong_pixels(scene, settings, picture(settings)) == 0


@pytest.mark.parametrize(
    "options",
    [
        {"aside": (300.0, -200.0)},
        {"turn": 0.5},
        {"kind": "ORTHOGRAPHIC"},
        {"kind": "ORTHOGRAPHIC", "aside": (300.0, -200.0), "turn": 0.5},
        *(
            {"kind": kind, "placement": Placement(np.array([3.0, -2.0, 5.0]) * scale, TURNED, scale)}
            for kind in ("PERSPECTIVE", "ORTHOGRAPHIC")
            for scale in (1e-4, 1e4)
        ),
    ],
    ids=str,
)
@pytest.mark.parametrize("observer", ["static", "moving"])
def test_windows_models_and_projections(options, observer):
    """A shifted window, a camera that looks past the hole, a model that is turned, moved and scaled, parallel rays."""
    settings = seen(observer)
    scene = far_scene(KERR, 1e6, velocity=settings.observer_velocity, **options)
    assert wrong_pixels(scene, settings, picture(settings)) == 0


@pytest.mark.parametrize("kind", ["PERSPECTIVE", "ORTHOGRAPHIC"])
def test_matrices_in_float32(kind):
    """As Blender gives them: their columns are unit and perpendicular to 1e-7, which is 0.1 M at this distance."""
    settings = seen("static")
    scene = far_scene(KERR, 1e6, kind=kind, placement=Placement(rotation=TURNED.astype(np.float32).astype(float)))
    matrix = scene.camera.world_from_camera.astype(np.float32).astype(float)
    scene = replace(scene, camera=replace(scene.camera, world_from_camera=matrix))
    assert wrong_pixels(scene, settings, picture(settings)) == 0


@pytest.mark.parametrize("model", [HOLE, KERR], ids=["schwarzschild", "kerr"])
def test_the_papers_pipeline(model):
    settings = scenes.papers(observer="static", integrator="dormand_prince_54", step_control="embedded", tolerance=1e-5)
    assert wrong_pixels(far_scene(model, 1e6), settings, picture(settings)) == 0


@pytest.mark.parametrize(("model", "pipeline"), [(HOLE, "fused"), (KERR, "fused"), (KERR, "paper")])
def test_what_a_ray_conserves_does_not_drift_on_the_way_in(model, pipeline):
    """The drift is that of the steps, as from 500 M: not the rounding of the camera's place, 0.03 of L from 1e6 M."""
    options = {"integrator": "dormand_prince_54", "step_control": "embedded", "tolerance": 1e-6, "observer": "static"}
    settings = Settings(pipeline=pipeline, passes=("Drift", "Status"), **options)

    def drift(r):
        scene = far_scene(model, r)
        frame = render(replace(scene, camera=replace(scene.camera, width=48, height=48)), settings)
        assert frame.statistics.rays.keys() == {Status.ABSORBED, Status.ESCAPED}
        escaped = frame.passes["Status"] == Status.ESCAPED
        return float(np.percentile(frame.passes["Drift"][escaped], 90))

    near, far = drift(500.0), drift(1e6)
    print(f"{model.name}, {pipeline}: {near:.1e} from 500 M, {far:.1e} from 1e6 M")
    assert far < 3.0 * near + 1e-5


@pytest.mark.parametrize("observer", KERR.observers)
def test_given_rays(observer):
    """trace_rays() takes positions and directions in float64, so that they may come from far away, too."""
    settings = seen(observer)

    def traced(part):
        x0, y0, x1, y1 = part.camera.region
        y, x = (values.ravel() + 0.5 for values in np.mgrid[y0:y1, x0:x1])
        return trace_rays(part.model, *rays(part, x, y), settings).status

    assert wrong_pixels(far_scene(KERR, 1e6, velocity=settings.observer_velocity), settings, traced) == 0


@pytest.mark.parametrize("kind", ["PERSPECTIVE", "ORTHOGRAPHIC"])
@pytest.mark.parametrize("name", ["straight", "wormhole", "refraction"])
def test_where_rays_enter(glsl, name, kind):
    """The point at the bounding sphere, of 10 lengths: within some ten roundings of its radius, whatever the distance,
    times the condition of where a ray meets a sphere.
    """
    model = MODELS[name]()
    scene = far_scene(model, 1e6, aside=(100.0, 50.0), turn=-0.2, kind=kind)
    y, x = (values.ravel() + 0.5 for values in np.mgrid[0:PIXELS:40, 0:PIXELS:40])
    camera = kind.lower()
    found = glsl(
        ["common/ray_start", f"camera/{camera}", f"camera/moment_{camera}", "observers/chart", *model.shader_files()],
        "vec3 o, d; float tau; camera_ray(pixel.xy, o, d); out_result.xyz = ray_start(pixel.xy, o, d, 10.0, tau).x;",
        {"pixel": np.stack([x, y], axis=1)},
        uniforms=camera_uniforms(scene)
        | far_camera(scene.camera, scene.placement, model, "chart", np.zeros(3))
        | {"u_inner_radius": 10.0, "u_bends_within": 0.0}
        | model.uniforms(),
        flags=model.flags(),
        generated=model.generated(),
    )["result"][:, :3]
    positions, directions = rays(scene, x, y)
    nearest = np.cross(directions, np.cross(positions, directions))
    inwards = np.linalg.norm(nearest, axis=1) < 9.9
    before = np.sqrt(np.maximum(100.0 - np.sum(nearest**2, axis=1), 1.0))
    expected = nearest - before[:, None] * directions
    error = (np.linalg.norm(found - expected, axis=1) * before / 10.0)[inwards].max()
    print(f"{name}, {kind}: {error / (10 * EPS):.1f} roundings, bound 10")
    assert inwards.sum() > 100
    assert error < 10 * 10 * EPS

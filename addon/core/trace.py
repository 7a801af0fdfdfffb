"""render(scene, settings) -> Frame;  trace_rays(model, positions, directions, settings) -> RayEnds."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from . import device as gpu
from .frame import Frame, Statistics
from .models import Model
from .pipelines.paper import PaperPipeline
from .pipelines.tile import IntegratorShader, ModelShader, Request, Stopwatch, TileEnds
from .scene import Camera, Scene, SceneError
from .settings import PASS_CHANNELS, Settings, SettingsError
from .status import Status
from .tableaus import TABLEAUS
from .textures import Packed, pack

TILE = 256  # pixels a side: small enough for short draws, large enough to keep a GPU busy
RAYS_A_ROW = 256  # trace_rays folds its rays into a picture of this width
LONGEST_SIDE = 65536
memory_limit_bytes = 4 << 30  # what a frame may take in arrays and textures; the preferences set it

OUTPUTS = {  # what a pipeline has to write for a pass
    "Combined": "color",
    "Depth": "depth",
    "Normal": "surface",
    "Object Index": "surface",
    "Steps": "steps",
    "Error": "error",
}


class Cancelled(Exception):
    """The caller's cancelled() said so; nothing was written."""


@dataclass(frozen=True, eq=False)
class RayEnds:
    """How n rays ended, in model space.

    position         float32, (n, 3), model lengths: where the ray ended
    direction        float32, (n, 3), unit
    parameter        float32, (n,), tau
    status           int32, (n,), values of Status
    steps            int32, (n,), steps of the integrator, half steps and repeated ones counted
    invariant_drift  float32, (n,), largest change of an invariant, as a part of the largest invariant
    error            float32, (n,), radians, the step control's own estimate, summed; 0 for constant steps
    """

    position: np.ndarray
    direction: np.ndarray
    parameter: np.ndarray
    status: np.ndarray
    steps: np.ndarray
    invariant_drift: np.ndarray
    error: np.ndarray


def render(
    scene: Scene,
    settings: Settings,
    *,
    progress: Callable[[float, str], None] | None = None,
    cancelled: Callable[[], bool] | None = None,
) -> Frame:
    """Blocks; callable from any thread (the GPU has a thread of its own). progress(fraction in [0, 1], sentence) and
    cancelled() are called in the calling thread. Raises Cancelled, SceneError, SettingsError, device.DeviceError.
    """
    check(scene, settings)
    watch = Stopwatch()
    columns, rows = scene.camera.size
    asked = frozenset(OUTPUTS[name] for name in settings.passes if name in OUTPUTS)
    with watch.stage("pack"):
        packed = pack(scene, groups=settings.cull_batches)
    check_memory(columns, rows, settings, packed)
    request = make_request(scene, settings, packed, camera_uniforms(scene), asked)
    tile = (min(TILE, columns), min(TILE, rows))
    pipeline = gpu.run(lambda device: PaperPipeline(device, request, tile, watch))

    passes = {name: np.zeros((rows, columns, len(PASS_CHANNELS[name])), np.float32) for name in settings.passes}
    counts = np.zeros(len(Status), np.int64)
    steps = [0, 0.0]
    x_corner, y_corner, _, _ = scene.camera.pixel_box
    jobs = [
        (x, y, sample)
        for y in range(0, rows, TILE)
        for x in range(0, columns, TILE)
        for sample in range(settings.samples)
    ]
    begin = time.perf_counter()
    for number, (x, y, sample) in enumerate(jobs):
        width, height = min(TILE, columns - x), min(TILE, rows - y)
        u, v = sample_offset(sample, settings.samples)

        def report(fraction: float, done: int = number) -> None:
            if progress is not None:
                part = (done + fraction) / len(jobs)
                progress(part, remaining(time.perf_counter() - begin, part))

        ends = _trace_tile(pipeline, width, height, (x_corner + x + u, y_corner + y + v), report, cancelled)
        store(passes, ends, scene, (slice(y, y + height), slice(x, x + width)), sample, settings.samples)
        counts += np.bincount(ends.velocity[..., 3].astype(np.int64).ravel(), minlength=len(Status))
        if ends.tally is not None:
            steps[0] = max(steps[0], int(ends.tally[..., 1].max()))
            steps[1] += float(ends.tally[..., 1].sum(dtype=np.float64))
    if progress is not None:
        progress(1.0, "Done")
    statistics = Statistics(
        rays={status: int(counts[status]) for status in Status if counts[status]},
        milliseconds=watch.milliseconds,
        texture_bytes=pipeline.uploaded_bytes,
        left_out=left_out(request),
        steps=(steps[0], steps[1] / counts.sum()) if steps[0] else None,
        device=gpu.describe(),
    )
    return Frame(passes, statistics, (*scene.warnings, *packed.warnings))


def trace_rays(
    model: Model,
    positions: np.ndarray,
    directions: np.ndarray,
    settings: Settings,
    *,
    scene: Scene | None = None,
    cancelled: Callable[[], bool] | None = None,
) -> RayEnds:
    """The same shaders on given rays.

    positions, directions : (n, 3), model space; directions need not be unit, and are the observer's
    scene : its objects are hit by the rays; its camera, model and sky are not used
    Raises SettingsError, ValueError for wrong shapes or values that are not finite, device.DeviceError.
    """
    positions, directions = _rays(positions, directions)
    n = len(positions)
    if n == 0:
        return _empty_ends()
    rows = math.ceil(n / RAYS_A_ROW)
    columns = min(n, RAYS_A_ROW)
    camera = Camera(np.eye(4), (-1, 1, -1, 1), columns, rows)
    scene = Scene(camera, model) if scene is None else replace(scene, camera=camera, model=model)
    folded = [_folded(rays, rows, columns) for rays in (positions, directions)]
    asked = {"steps", "drift"} | ({"error"} if settings.step_control != "constant" else set())
    packed = pack(scene, groups=settings.cull_batches)
    reach = float(np.linalg.norm(positions, axis=1).max())
    request = make_request(scene, settings, packed, {}, frozenset(asked), reach, (folded[0], folded[1]), "given")
    pipeline = gpu.run(lambda device: PaperPipeline(device, request, (columns, rows), Stopwatch()))
    ends = _trace_tile(pipeline, columns, rows, (0.0, 0.0), lambda fraction: None, cancelled)

    def flat(values: np.ndarray) -> np.ndarray:
        return values.reshape(rows * columns, -1)[:n]

    velocity = flat(ends.velocity)
    length = np.linalg.norm(velocity[:, :3].astype(np.float64), axis=1, keepdims=True)
    tally = flat(ends.tally)
    return RayEnds(
        position=flat(ends.position)[:, :3],
        direction=(velocity[:, :3] / np.maximum(length, 1e-300)).astype(np.float32),
        parameter=flat(ends.position)[:, 3],
        status=velocity[:, 3].astype(np.int32),
        steps=tally[:, 1].astype(np.int32),
        invariant_drift=tally[:, 3],
        error=tally[:, 2],
    )


def check(scene: Scene, settings: Settings) -> None:
    """Refuse what cannot be rendered, before any memory is taken."""
    columns, rows = scene.camera.size
    if not (1 <= columns <= LONGEST_SIDE and 1 <= rows <= LONGEST_SIDE):
        raise SceneError(
            f"The image is {columns} x {rows} pixels, but a side must lie in [1, {LONGEST_SIDE}]. "
            "Change the resolution."
        )
    if not (math.isfinite(scene.placement.scale) and scene.placement.scale > 0):
        raise SceneError(f"The model's scale is {scene.placement.scale:g}, but must be positive. Change Scale.")
    if not np.isfinite(scene.camera.world_from_camera).all() or not np.isfinite(scene.placement.position).all():
        raise SceneError("The camera's or the model's place is not a number. Clear its transform or its drivers.")
    if "Error" in settings.passes and settings.step_control == "constant":
        raise SettingsError("Pass 'Error' needs a step control that estimates it. Set Step Control to Step Doubling.")
    position = scene.placement.points_to_model(scene.camera.world_from_camera[:3, 3])
    problem = scene.model.observer_problem(settings.observer, position)
    if problem:
        raise SceneError(problem)


def check_memory(columns: int, rows: int, settings: Settings, packed: Packed) -> None:
    picture = 4 * columns * rows * sum(len(PASS_CHANNELS[name]) for name in settings.passes)
    tile = 16 * 20 * min(TILE, columns) * min(TILE, rows)  # at most 20 textures of 4 floats
    needed = picture + tile + 2 * packed.bytes
    if needed > memory_limit_bytes:
        raise SceneError(
            f"The frame needs {needed / 2**20:.0f} MiB, but {memory_limit_bytes / 2**20:.0f} MiB are allowed. "
            "Lower the resolution, ask for fewer passes, or raise Memory Limit in the preferences."
        )


def make_request(
    scene: Scene,
    settings: Settings,
    packed: Packed,
    camera: dict[str, object],
    outputs: frozenset[str],
    reach: float | None = None,
    rays: tuple[np.ndarray, np.ndarray] | None = None,
    camera_file: str | None = None,
) -> Request:
    """Gather what the pipeline needs. reach : how far from the model's centre rays begin, model lengths."""
    model, placement = scene.model, scene.placement
    if reach is None:
        reach = float(np.linalg.norm(placement.points_to_model(scene.camera.world_from_camera[:3, 3])))
    # A little more than the objects reach, so that rounding puts none of them outside.
    radius = settings.escape_radius or max(model.flat_radius(), 1.01 * packed.bounds_radius, 1e-6)
    step = settings.step or model.default_step()
    if not model.curved:  # one chord from the camera to the far side of the bounding sphere
        radius = max(1.01 * packed.bounds_radius, 1e-6)
        step = 1.01 * (reach + radius)
        if scene.camera.kind == "ORTHOGRAPHIC":
            step += 2.0 * _window_reach(scene)
        settings = replace(
            settings, integrator="euler", step_control="constant", segments=1, steps_per_segment=1, max_steps=1
        )
    values: dict[str, object] = dict(model.uniforms())
    values |= camera
    values["u_ambient"] = tuple(scene.ambient)
    values["u_light_count"] = packed.light_count
    values["u_sky_color"] = tuple(scene.environment.color)
    values["u_world_from_model"] = _column_major(placement.rotation)
    observer = settings.observer if model.has_static_frame else "chart"
    return Request(
        settings=settings,
        camera=camera_file or scene.camera.kind.lower(),
        model=ModelShader(model.shader_files(), model.flags(), model.generated(), model.textures()),
        integrator=integrator_shader(model.own_integrator() or settings.integrator),
        observer=observer,
        packed=packed,
        cube=scene.environment.faces if "color" in outputs else None,
        uniforms=values,
        first_step=step,
        escape_radius=radius,
        outputs=outputs,
        rays=rays,
    )


def integrator_shader(name: str) -> IntegratorShader:
    """Files for the simple methods, printed text for the tableaus."""
    tableau = TABLEAUS.get(name)
    if tableau is None:
        return IntegratorShader(files=(f"integrators/{name}",))
    order = 0 if tableau.embedded is None else tableau.embedded_order + 1
    return IntegratorShader(generated=((f"integrators/{name}", tableau.as_glsl()),), error_order=order)


def camera_uniforms(scene: Scene) -> dict[str, object]:
    camera, placement = scene.camera, scene.placement
    left, right, bottom, top = camera.window
    window = np.array((left, bottom, (right - left) / camera.width, (top - bottom) / camera.height))
    if camera.kind == "ORTHOGRAPHIC":
        window = window / placement.scale
    axes = placement.directions_to_model(camera.world_from_camera[:3, :3].T).T
    return {
        "u_camera_position": tuple(placement.points_to_model(camera.world_from_camera[:3, 3])),
        "u_camera_axes": _column_major(axes),
        "u_window": tuple(window),
    }


def sample_offset(sample: int, samples: int) -> tuple[float, float]:
    """Where in the pixel a sample lies, as an offset from its centre: the R2 sequence; 0 for a single one."""
    if samples == 1:
        return 0.0, 0.0
    plastic = 1.32471795724474602596
    return (0.5 + sample / plastic) % 1.0 - 0.5, (0.5 + sample / plastic**2) % 1.0 - 0.5


def store(passes: dict, ends: TileEnds, scene: Scene, where: tuple[slice, slice], sample: int, samples: int) -> None:
    """Put a tile into the frame, in world space. Combined is the mean of all samples; the others are the first's."""
    if "Combined" in passes:
        passes["Combined"][where] += ends.color / samples
    if sample:
        return
    rotation, scale = scene.placement.rotation, scene.placement.scale
    status = ends.velocity[..., 3:4]
    hit = status == Status.HIT
    values = {"Status": status}
    if "Position" in passes:
        world = ends.position[..., :3].astype(np.float64) @ rotation.T * scale + scene.placement.position
        values["Position"] = np.where(hit, world, 0.0)
    if "Direction" in passes:
        v = ends.velocity[..., :3].astype(np.float64) @ rotation.T
        values["Direction"] = v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-300)
    if ends.surface is not None:
        values["Normal"] = ends.surface[..., :3].astype(np.float64) @ rotation.T
        values["Object Index"] = ends.surface[..., 3:4]
    if ends.tally is not None:
        values["Depth"] = np.where(hit, ends.tally[..., 0:1], 1e10)  # Blender's depth of the background
        values["Steps"] = ends.tally[..., 1:2]
        values["Error"] = ends.tally[..., 2:3]
    for name in passes:
        if name != "Combined" and name in values:
            passes[name][where] = values[name]


def left_out(request: Request) -> tuple[str, ...]:
    """What this scene did not need, a phrase each, for the statistics, the log and the panel."""
    packed = request.packed
    absent = {
        "triangles": not packed.triangle_count,
        "spheres": not packed.sphere_count,
        "image textures": "u_image_table" not in packed.arrays,
        "lights": not packed.light_count,
        "environment texture": request.cube is None,
        "integration": request.settings.max_steps == 1,
        "step control": request.settings.step_control == "constant",
        "observer": request.observer == "chart",
        "surface passes": "surface" not in request.outputs,
        "tally of steps and errors": not request.outputs & {"depth", "steps", "error", "drift"},
    }
    return tuple(name for name, is_absent in absent.items() if is_absent)


def remaining(elapsed: float, fraction: float) -> str:
    """A sentence for the progress bar."""
    if fraction <= 0.01:
        return "Starting"
    seconds = int(elapsed * (1.0 - fraction) / fraction + 0.5)
    return f"{seconds // 60}:{seconds % 60:02d} left"


def _trace_tile(pipeline, columns, rows, offset, report, cancelled) -> TileEnds:
    """One tile as one job of the GPU's thread, while this thread reports and listens for a cancel."""
    stop = threading.Event()
    latest = [0.0]

    def poll() -> None:
        report(latest[0])
        if cancelled is not None and cancelled():
            stop.set()
            raise Cancelled

    def job(device: gpu.Device) -> TileEnds | None:
        return pipeline.trace(columns, rows, offset, lambda fraction: latest.__setitem__(0, fraction), stop.is_set)

    try:
        poll()
        return gpu.run(job, poll)
    except BaseException:
        stop.set()
        raise


def _window_reach(scene: Scene) -> float:
    left, right, bottom, top = scene.camera.window
    return max(math.hypot(x, y) for x in (left, right) for y in (bottom, top)) / scene.placement.scale


def _column_major(matrix: np.ndarray) -> tuple[float, ...]:
    return tuple(np.asarray(matrix, np.float64).T.ravel())


def _rays(positions, directions) -> tuple[np.ndarray, np.ndarray]:
    positions, directions = np.asarray(positions, np.float32), np.asarray(directions, np.float32)
    for name, rays in (("positions", positions), ("directions", directions)):
        if rays.ndim != 2 or rays.shape[1] != 3:
            raise ValueError(f"'{name}' has the shape {rays.shape}, but needs (n, 3). Reshape it.")
        if not np.isfinite(rays).all():
            raise ValueError(f"'{name}' holds values that are not finite. Remove these rays.")
    if len(positions) != len(directions):
        raise ValueError(
            f"There are {len(positions)} positions but {len(directions)} directions. Give as many of both."
        )
    if len(directions) and not np.linalg.norm(directions, axis=1).min() > 0:
        raise ValueError("A direction is zero. Remove this ray.")
    return positions, directions


def _folded(rays: np.ndarray, rows: int, columns: int) -> np.ndarray:
    """(n, 3) -> (rows, columns, 4); the rest repeats the last ray."""
    out = np.zeros((rows * columns, 4), np.float32)
    out[: len(rays), :3] = rays
    out[len(rays) :, :3] = rays[-1]
    return out.reshape(rows, columns, 4)


def _empty_ends() -> RayEnds:
    zero, none = np.zeros((0, 3), np.float32), np.zeros(0, np.float32)
    return RayEnds(zero, zero, none, none.astype(np.int32), none.astype(np.int32), none, none)

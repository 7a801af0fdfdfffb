"""render(scene, settings) -> Frame;  trace_rays(model, positions, directions, settings) -> RayEnds."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from . import device as gpu
from .aim import far_camera, moments
from .antialiasing import EdgeFinder, sample_offset
from .frame import Frame, Statistics
from .memory import TILE, frame_bytes
from .models import Model
from .models.borders import NO_BORDERS
from .nystrom import NYSTROM_METHODS
from .pipelines.fused import FusedPipeline
from .pipelines.paper import PaperPipeline
from .pipelines.tile import IntegratorShader, ModelShader, Request, Stopwatch, TileEnds
from .rosenbrock import ROSENBROCK_METHODS, ROUNDING
from .scene import Camera, Scene, SceneError
from .settings import PASS_CHANNELS, Settings, SettingsError
from .status import Status
from .tableaus import TABLEAUS
from .textures import Packed, pack

RAYS_A_ROW = 256  # trace_rays folds its rays into a picture of this width
LONGEST_SIDE = 65536
BRIGHTEST = 65504.0  # radiance that stands for infinity
ARRIVED = (Status.HIT, Status.ESCAPED)  # rays whose picture depends on what the model conserves
memory_limit_bytes = 4 << 30  # what a frame may take in arrays and textures; the preferences set it

OUTPUTS = {  # what a pipeline has to write for a pass
    "Combined": "color",
    "Depth": "depth",
    "Normal": "surface",
    "Object Index": "surface",
    "Steps": "steps",
    "Error": "error",
    "Drift": "drift",
    "Frequency Shift": "frequency",
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
    rejected         int32, (n,), those of them that step control took back; 0 for constant steps
    invariant_drift  float32, (n,), largest change of an invariant, as a part of the largest invariant
    error            float32, (n,), radians, the step control's own estimate, summed; 0 for constant steps
    """

    position: np.ndarray
    direction: np.ndarray
    parameter: np.ndarray
    status: np.ndarray
    steps: np.ndarray
    rejected: np.ndarray
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
    edges = None
    if settings.refines_edges:
        edges, asked = EdgeFinder(columns, rows), asked | {"surface"}
    with watch.stage("pack"):
        packed = pack_for(scene, settings)
    check_memory(scene, settings, packed)
    request = make_request(scene, settings, packed, camera_uniforms(scene), asked)
    pipeline = make_pipeline(request, (columns, rows), min(TILE, columns), min(TILE, rows), watch)

    passes = {name: np.zeros((rows, columns, len(PASS_CHANNELS[name])), np.float32) for name in settings.passes}
    counts = np.zeros(len(Status), np.int64)
    steps = [0, 0.0]
    worst_drift = 0.0
    x_corner, y_corner, _, _ = scene.camera.pixel_box
    pixels, total = 0, columns * rows * settings.samples
    first_part = 0.5 if edges else 1.0  # of the progress; how many edges there are is known after it
    begin = time.perf_counter()
    for x, y, width, height, sample in jobs(columns, rows, settings.samples, pipeline.tile_size):
        u, v = sample_offset(sample, settings.filter_width)

        def report(fraction: float, done: int = pixels, more: int = width * height) -> None:
            if progress is not None:
                part = first_part * (done + fraction * more) / total
                progress(part, remaining(time.perf_counter() - begin, part))

        ends = _trace_tile(pipeline, width, height, (x_corner + x + u, y_corner + y + v), report, cancelled)
        store(passes, ends, scene, (slice(y, y + height), slice(x, x + width)), sample, settings.samples)
        pixels += width * height
        counts += np.bincount(ends.velocity[..., 3].astype(np.int64).ravel(), minlength=len(Status))
        if ends.tally is not None:
            steps[0] = max(steps[0], int(ends.tally[..., 1].max()))
            steps[1] += float(ends.tally[..., 1].sum(dtype=np.float64))
            arrived = np.isin(ends.velocity[..., 3], ARRIVED)
            worst_drift = max(worst_drift, float(ends.tally[..., 3].max(where=arrived, initial=0.0)))
        if edges and sample == 0:
            edges.add(x, y, ends.position, ends.velocity, ends.surface)
    mean_steps = steps[1] / counts.sum()
    if edges:

        def report_edges(fraction: float) -> None:
            if progress is not None:
                part = first_part + (1.0 - first_part) * fraction
                progress(part, remaining(time.perf_counter() - begin, part))

        counts += refine(pipeline, passes["Combined"], edges.quads(), scene, settings, report_edges, cancelled)
    if progress is not None:
        progress(1.0, "Done")
    statistics = Statistics(
        rays={status: int(counts[status]) for status in Status if counts[status]},
        milliseconds=watch.milliseconds,
        texture_bytes=pipeline.uploaded_bytes,
        left_out=left_out(request),
        steps=(steps[0], mean_steps) if steps[0] else None,
        worst_drift=worst_drift if "Drift" in settings.passes else None,
        prolonged=pipeline.prolonged if pipeline.prolonged[0] else None,
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

    positions, directions : (n, 3), model space, in float64 where rays begin far away; directions need not be unit, and
    are the observer's
    scene : its objects are hit by the rays; its camera, model and sky are not used
    Raises SettingsError, SceneError where a ray begins where the observer cannot be, ValueError for wrong shapes or
    values that are not finite, device.DeviceError.
    """
    positions, directions = _rays(positions, directions)
    n = len(positions)
    if n == 0:
        return _empty_ends()
    if settings.observer != "chart":  # a ray of the chart is nobody's: where it cannot go on, its status says so
        problem = model.observer_problem(settings.observer, positions)
        if problem:
            raise SceneError(problem)
    rows = math.ceil(n / RAYS_A_ROW)
    columns = min(n, RAYS_A_ROW)
    camera = Camera(np.eye(4), (-1, 1, -1, 1), columns, rows)
    scene = Scene(camera, model) if scene is None else replace(scene, camera=camera, model=model)
    asked = {"steps", "drift"} | ({"error", "rejected"} if settings.step_control != "constant" else set())
    packed = pack_for(scene, settings)
    reach = float(np.linalg.norm(positions, axis=1).max())
    request = make_request(scene, settings, packed, {}, frozenset(asked), reach, (positions, directions))
    pipeline = make_pipeline(request, (columns, rows), columns, rows, Stopwatch())
    whole = TileEnds(*(np.empty((rows, columns, 4), np.float32) for _ in range(2)))
    whole.tally, whole.rejected = np.empty_like(whole.position), np.zeros_like(whole.position)
    for x, y, width, height, _ in jobs(columns, rows, 1, pipeline.tile_size):
        ends = _trace_tile(pipeline, width, height, (x, y), lambda fraction: None, cancelled)
        for name in ("position", "velocity", "tally", "rejected"):
            part = getattr(ends, name)
            if part is not None:
                getattr(whole, name)[y : y + height, x : x + width] = part

    def flat(values: np.ndarray) -> np.ndarray:
        return values.reshape(rows * columns, -1)[:n]

    velocity = flat(whole.velocity)
    length = np.linalg.norm(velocity[:, :3].astype(np.float64), axis=1, keepdims=True)
    tally = flat(whole.tally)
    return RayEnds(
        position=flat(whole.position)[:, :3],
        direction=(velocity[:, :3] / np.maximum(length, 1e-300)).astype(np.float32),
        parameter=flat(whole.position)[:, 3],
        status=velocity[:, 3].astype(np.int32),
        steps=tally[:, 1].astype(np.int32),
        rejected=flat(whole.rejected)[:, 0].astype(np.int32),
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
    placement, camera = scene.placement, scene.camera
    places = (camera.world_from_camera, camera.window, placement.position, placement.rotation)
    if not all(np.isfinite(place).all() for place in places):
        raise SceneError("The camera's or the model's place is not a number. Clear its transform or its drivers.")
    if "Error" in settings.passes and settings.step_control == "constant":
        raise SettingsError("Pass 'Error' needs a step control that estimates it. Set Step Control to Step Doubling.")
    position = scene.placement.points_to_model(scene.camera.world_from_camera[:3, 3])
    problem = scene.model.observer_problem(settings.observer, position)
    if problem:
        raise SceneError(problem)


def check_memory(scene: Scene, settings: Settings, packed: Packed) -> None:
    """Refuse what is too large, before the memory is taken."""
    needed = frame_bytes(scene, settings, packed)
    if needed > memory_limit_bytes:
        raise SceneError(
            f"The frame needs {needed / 2**20:.0f} MiB, but {memory_limit_bytes / 2**20:.0f} MiB are allowed. "
            "Lower the resolution, ask for fewer passes, or raise Memory Limit in the preferences."
        )


def pack_for(scene: Scene, settings: Settings) -> Packed:
    """What the chosen pipeline reads of the scene."""
    fused = settings.pipeline == "fused"
    return pack(scene, groups=settings.cull_batches and not fused, tree=fused, mipmaps=settings.filters_textures)


def make_pipeline(request: Request, size: tuple[int, int], columns: int, rows: int, watch: Stopwatch):
    """The chosen pipeline for a picture of this size; the paper's works on tiles of columns x rows."""
    if request.settings.pipeline == "fused":
        return gpu.run(lambda device: FusedPipeline(device, request, size, watch))
    return gpu.run(lambda device: PaperPipeline(device, request, (columns, rows), watch))


def jobs(
    columns: int, rows: int, samples: int, tile_size: Callable[[], tuple[int, int]]
) -> Iterator[tuple[int, int, int, int, int]]:
    """Tiles that cover a picture, as x, y, width, height and sample. Each is as large as tile_size() says by then;
    those of a row are of one height.
    """
    y = height = 0
    while (y := y + height) < rows:
        height = min(tile_size()[1], rows - y)
        x = width = 0
        while (x := x + width) < columns:
            width = min(tile_size()[0], columns - x)
            for sample in range(samples):
                yield x, y, width, height, sample


def make_request(
    scene: Scene,
    settings: Settings,
    packed: Packed,
    camera: dict[str, object],
    outputs: frozenset[str],
    reach: float | None = None,
    rays: tuple[np.ndarray, ...] | None = None,
) -> Request:
    """Gather what the pipeline needs. reach : how far from the model's centre rays begin, model lengths.
    rays : positions and directions, float64, (n, 3), instead of the camera's
    """
    model, placement = scene.model, scene.placement
    if settings.observer not in model.observers:
        raise SettingsError(
            f"Model '{model.name}' has no observer '{settings.observer}'. Choose one of {model.observers}."
        )
    window = _window_reach(scene) if scene.camera.kind == "ORTHOGRAPHIC" else 0.0  # rays begin all over it
    distance = reach
    if reach is None:
        distance = float(np.linalg.norm(placement.points_to_model(scene.camera.world_from_camera[:3, 3])))
        reach = distance + window
    far = 0.0 if settings.step_control == "constant" else reach
    # A little more than the objects reach, so that rounding puts none of them outside.
    radius = settings.escape_radius or max(model.escape_radius(far), 1.01 * packed.bounds_radius, 1e-6)
    step = settings.step or model.default_step()
    if not model.curved:  # one chord from the camera to the far side of the bounding sphere
        radius = max(1.01 * packed.bounds_radius, 1e-6)
        step = 1.01 * (distance + radius) + 2.0 * window
        settings = replace(
            settings, integrator="euler", step_control="constant", segments=1, steps_per_segment=1, max_steps=1
        )
    if model.own_integrator():  # it estimates no error, and its refractions would look like errors to step doubling
        settings = replace(settings, step_control="constant")
    values: dict[str, object] = dict(model.uniforms())
    values |= camera
    values["u_ambient"] = tuple(scene.ambient)
    values["u_light_count"] = packed.light_count
    values["u_sky_color"] = tuple(scene.environment.color)
    values["u_world_from_model"] = _column_major(placement.rotation)
    velocity = placement.directions_to_model(settings.observer_velocity)
    values["u_observer_velocity"] = tuple(velocity)
    observer = settings.observer
    if observer == "static" and not model.has_static_frame:
        observer = "chart"
    inner_radius = min(radius, max(model.flat_radius(), 1.01 * packed.bounds_radius))
    kind = scene.camera.kind.lower() if rays is None else "given"
    if rays is None:
        values |= far_camera(scene.camera, placement, model, observer, velocity)
    else:  # those that begin within the inner radius need no moment
        far = reach > inner_radius
        rays = (*rays, moments(model, observer, velocity, *rays) if far else np.zeros_like(rays[0]))
    far_sky = scene.far_environment if model.has_far_side and "color" in outputs else None
    if far_sky is not None:
        values["u_far_sky_color"] = tuple(far_sky.color)
        values["u_far_world_from_model"] = values["u_world_from_model"]  # a name of its own: both may be in one program
        far_sky = replace(far_sky, faces=finite_sky(far_sky.faces))
    # What is stiff may decay within far less way than the model has a step for.
    smallest_part = 1e-9 if settings.integrator in ROSENBROCK_METHODS else 1e-6
    objects = packed.triangle_count or packed.sphere_count
    model_files, model_flags = model.shader_files(), model.flags() | ({"FAR_SIDE"} if model.has_far_side else set())
    if math.isinf(model.last_parameter()):
        model_files = (*model_files, "models/endless")
    orbit = takes_orbits(model, settings, packed)
    if orbit:  # its steps are no lengths; what stalls is told by the chart itself
        model_files = (*NO_BORDERS.files, "captures/none", *model_files, *model.orbit_files())
        model_flags |= {"ORBIT"}
    else:
        model_files = (*model.borders().files, model.capture_file(), *model_files)
    return Request(
        settings=settings,
        camera=kind,
        model=ModelShader(
            model_files, model_flags, model.generated(), model.textures(), {} if objects else model.files_of_long_rays()
        ),
        integrator=integrator_shader(
            integrator_for(model, settings), settings.pipeline == "fused" or settings.step_control == "embedded"
        ),
        errors="errors/orbit" if orbit else "errors/grown",
        advance=model.borders().advance,
        observer=observer,
        packed=packed,
        cube=finite_sky(scene.environment.faces) if "color" in outputs else None,
        uniforms=values,
        first_step=step,
        smallest_step=0.0 if orbit else smallest_part * min(step, model.default_step()),
        escape_radius=radius,
        bends_within=model.bends_within,
        inner_radius=inner_radius,
        outputs=outputs,
        rays=rays and tuple(_folded(part, *reversed(scene.camera.size)) for part in rays),
        flat_frame=not model.has_static_frame and (observer == "moving" or "frequency" in outputs),
        far_sky=far_sky,
        straight=not model.curved,
    )


def finite_sky(faces: np.ndarray | None) -> np.ndarray | None:
    """Faces without NaN and infinity, which EXR files may hold and filtering would spread."""
    return None if faces is None else np.nan_to_num(faces, nan=0.0, posinf=BRIGHTEST, neginf=0.0)


def suits(integrator: str, model: Model) -> bool:
    """Whether the integrator can take steps of the model's rays."""
    return integrator not in NYSTROM_METHODS or model.force_of_position()


def integrator_for(model: Model, settings: Settings) -> str:
    """The integrator that takes the steps. Raises SettingsError where the chosen one cannot."""
    name = settings.integrator
    if not suits(name, model):
        raise SettingsError(
            f"Integrator '{name}' needs a force of the position alone, which model '{model.name}' does not "
            "have. Choose 'automatic' or another one."
        )
    if name == "automatic":
        name = "nystrom_64" if suits("nystrom_64", model) and model.smooth() else "dormand_prince_54"
    return model.own_integrator() or name


def takes_orbits(model: Model, settings: Settings, packed: Packed) -> bool:
    """Whether rays are integrated in the model's chart for orbits, which gives their ends, but not the way there, on
    which objects would be met; with steps of its own that adapt to their errors.
    """
    free = settings.integrator == "automatic" and settings.step is None
    adapts = settings.pipeline == "fused" and settings.step_control == "embedded"
    return free and adapts and not (packed.triangle_count or packed.sphere_count) and bool(model.orbit_files())


def integrator_shader(name: str, continued: bool = False) -> IntegratorShader:
    """Files for the simple methods, printed text for the others. continued : as integrators/continued.glsl has it"""
    method = (TABLEAUS | NYSTROM_METHODS | ROSENBROCK_METHODS).get(name)
    if method is None:
        return IntegratorShader(files=(f"integrators/{name}", *(("integrators/continued",) if continued else ())))
    printed = ((f"integrators/{name}", method.as_glsl(continued)),)
    order = 0 if method.embedded is None else method.embedded_order + 1
    if name in ROSENBROCK_METHODS:
        return IntegratorShader(("integrators/linearised",), printed, order, ROUNDING)
    if name in NYSTROM_METHODS:
        return IntegratorShader((), printed, order, step_share=method.step_share, second_derivatives=True)
    return IntegratorShader((), printed, order)


def camera_uniforms(scene: Scene) -> dict[str, object]:
    camera, placement = scene.camera, scene.placement
    left, right, bottom, top = camera.window
    window = np.array((left, bottom, (right - left) / camera.width, (top - bottom) / camera.height))
    if camera.kind == "ORTHOGRAPHIC":
        window = window / placement.scale
    axes = placement.directions_to_model(camera.world_from_camera[:3, :3].T).T
    pixel = float(max(abs(window[2:])))
    return {
        "u_camera_position": tuple(placement.points_to_model(camera.world_from_camera[:3, 3])),
        "u_camera_axes": _column_major(axes),
        "u_window": tuple(window),
        "u_pixel_cone": (0.0, pixel) if camera.kind == "PERSPECTIVE" else (pixel, 0.0),
    }


def refine(
    pipeline: FusedPipeline,
    picture: np.ndarray,
    quads: np.ndarray,
    scene: Scene,
    settings: Settings,
    report: Callable[[float], None],
    cancelled: Callable[[], bool] | None,
) -> np.ndarray:
    """More samples for some 2 x 2 quads of a picture, (rows, columns, 4), in place, as many at a time as a tile may
    have pixels. quads : (n, 2), columns and rows of their lower left pixels. Returns how many rays ended in which
    status.
    """
    counts = np.zeros(len(Status), np.int64)
    rows, columns, _ = picture.shape
    x_corner, y_corner, _, _ = scene.camera.pixel_box
    more = settings.edge_samples - settings.samples
    first = 0
    while first < len(quads):
        wide, high = (math.ceil(side / 2) for side in pipeline.tile_size())
        high = min(high, math.ceil((len(quads) - first) / wide))
        listed = quads[first : first + wide * high]
        corners = listed[np.minimum(np.arange(wide * high), len(listed) - 1)].reshape(high, wide, 2)
        at = corners.repeat(2, axis=0).repeat(2, axis=1).astype(int)
        at[:, 1::2, 0] += 1
        at[1::2, :, 1] += 1
        real = (np.arange(wide * high) < len(listed)).reshape(high, wide).repeat(2, axis=0).repeat(2, axis=1)
        real &= (at[..., 0] < columns) & (at[..., 1] < rows)  # the rest fills up the tile, or the picture's edge
        summed = np.zeros((2 * high, 2 * wide, 4), np.float32)
        for sample in range(settings.samples, settings.edge_samples):
            u, v = sample_offset(sample, settings.filter_width)

            def within(fraction: float, done: int = first, sample: int = sample, batch: int = len(listed)) -> None:
                report((done + batch * (sample - settings.samples + fraction) / more) / len(quads))

            offset = x_corner + u, y_corner + v
            ends = _trace_tile(pipeline, 2 * wide, 2 * high, offset, within, cancelled, corners)
            summed += ends.color
            counts += np.bincount(ends.velocity[real][:, 3].astype(np.int64), minlength=len(Status))
        pixels = at[real][:, 1], at[real][:, 0]
        picture[pixels] = (settings.samples * picture[pixels] + summed[real]) / settings.edge_samples
        first += len(listed)
    return counts


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
        values["Drift"] = ends.tally[..., 3:4]
    if ends.frequency is not None:
        values["Frequency Shift"] = ends.frequency[..., 0:1]
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
        "positions along the rays": "ORBIT" in request.model.flags,
        "step control": request.settings.step_control == "constant",
        "observer": request.observer == "chart",
        "sky of the far side": request.far_sky is None,
        "volume": not any(data.ndim == 4 for data in request.model.textures.values()),
        "filtering of textures": not filters_textures(request),
        "further samples at edges": not request.settings.refines_edges,
        "frequency shift": "frequency" not in request.outputs,
        "surface passes": "surface" not in request.outputs,
        "tally of steps and errors": not request.outputs & {"depth", "steps", "error", "drift"},
    }
    return tuple(name for name, is_absent in absent.items() if is_absent)


def filters_textures(request: Request) -> bool:
    far = request.far_sky is not None and request.far_sky.faces is not None
    textures = far or request.cube is not None or "u_mip_table" in request.packed.arrays
    return request.settings.filters_textures and "color" in request.outputs and textures


def remaining(elapsed: float, fraction: float) -> str:
    """A sentence for the progress bar."""
    if fraction <= 0.01:
        return "Starting"
    seconds = int(elapsed * (1.0 - fraction) / fraction + 0.5)
    return f"{seconds // 60}:{seconds % 60:02d} left"


def _trace_tile(pipeline, columns, rows, offset, report, cancelled, corners=None) -> TileEnds:
    """One tile as one job of the GPU's thread, while this thread reports and listens for a cancel."""
    listed = {} if corners is None else {"corners": corners}
    stop = threading.Event()
    latest = [0.0]

    def poll() -> None:
        report(latest[0])
        if cancelled is not None and cancelled():
            stop.set()
            raise Cancelled

    def job(device: gpu.Device) -> TileEnds | None:
        return pipeline.trace(
            columns, rows, offset, lambda fraction: latest.__setitem__(0, fraction), stop.is_set, **listed
        )

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
    positions, directions = np.asarray(positions, np.float64), np.asarray(directions, np.float64)
    for name, rays in (("positions", positions), ("directions", directions)):
        if rays.ndim != 2 or rays.shape[1] != 3:
            raise ValueError(f"'{name}' has the shape {rays.shape}, but needs (n, 3). Reshape it.")
        if not np.isfinite(rays.astype(np.float32)).all():
            raise ValueError(f"'{name}' holds values that are not finite. Remove these rays.")
    if len(positions) != len(directions):
        raise ValueError(
            f"There are {len(positions)} positions but {len(directions)} directions. Give as many of both."
        )
    if len(directions) and not np.linalg.norm(directions.astype(np.float32), axis=1).min() > 0:
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
    return RayEnds(zero, zero, none, *(none.astype(np.int32) for _ in range(3)), none, none)

"""The paper's pipeline, pass by pass: Sections 3 and 4 of GPU-Based Nonlinear Ray Tracing (2004).

    ray setup
    for every segment:
        integrate (or, adaptively: a full and two half integrations, then the new step size)
        intersect and shade, one batch of objects a quad
        test for ray termination
    sky

Rays are texels. Their state, and the depth, color and surface that the intersection updates, lie in pairs of textures
that are written and read in turn. A ray that ended is written down once by the termination pass; where early
termination is on, the early z test then keeps every other pass from it.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Set
from dataclasses import dataclass, replace

import numpy as np

from ..compose import Choice
from ..device import Device, read
from .tile import GIVEN_RAYS, Request, Stopwatch, TileEnds, shading_choice

FAR = 1.0e30  # depth where nothing was hit
LONGEST_DRAW = 0.05  # seconds that one draw may take; display drivers kill draws of seconds
TRIAL_BATCH = 32  # objects drawn to find out how long an object takes
LARGEST_BATCH = 65536
ALIVE_CHECK = 8  # segments between two questions whether any ray is still alive
MARKER = (1.0, 0.0, 1.0, 1.0)
CLIPPED_HALF = 65504.0


@dataclass(frozen=True)
class Kind:
    """One kind of object: its pass, its sampler for the positions, and how many there are."""

    choice: Choice
    count: int


class Pair:
    """Textures written and read in turn (ping-pong)."""

    def __init__(self, device: Device, size: tuple[int, int], components: dict[str, int], dtype: str, depth):
        self._sides = []
        for _ in range(2):
            textures = {name: device.texture(size, dtype=dtype, components=count) for name, count in components.items()}
            self._sides.append((textures, device.target(textures, depth)))
        self._first = self._sides[0]

    def read(self, form: str = "u_{}") -> dict:
        """Sampler name -> texture, of the side that was written last."""
        return {form.format(name): texture for name, texture in self._sides[0][0].items()}

    @property
    def before(self) -> dict:
        """Name -> texture of the other side: what was there before the last swap."""
        return self._sides[1][0]

    @property
    def write(self):
        return self._sides[1][1]

    def swap(self) -> None:
        self._sides.reverse()

    def reset(self) -> None:
        """Back to the order in which the sides were made."""
        if self._sides[0] is not self._first:
            self.swap()

    @property
    def targets(self):
        return [target for _, target in self._sides]


class PaperPipeline:
    """Made once a frame, in the GPU's thread; trace() is called for every tile and sample."""

    prolonged = (0, 0)  # rays that may take more steps: none, since every segment is drawn for all of them

    def __init__(self, device: Device, request: Request, tile: tuple[int, int], watch: Stopwatch):
        self.watch = watch
        self.device, self.request, self.settings = device, request, request.settings
        self.tile = tile
        self.doubling = self.settings.step_control == "doubling"
        taken = 3 if self.doubling else 1  # for each step of a segment: h, and twice h/2
        self.steps = min(self.settings.steps_per_segment, max(1, self.settings.max_steps // taken))
        self.segments = max(1, min(self.settings.segments, self.settings.max_steps // (taken * self.steps)))
        self._choose_programs()
        with watch.stage("compile"):
            for choice in self.choices():
                device.program(choice)
        with watch.stage("upload"):
            self._upload()
            self._make_targets()
            device.finish()
        self._batches: dict[Choice, int] = {}

    # What the scene needs

    def _choose_programs(self) -> None:
        request, packed, asked = self.request, self.request.packed, self.request.outputs
        camera, observer = f"camera/{request.camera}", [f"observers/{request.observer}"]
        if request.flat_frame:
            observer.append("observers/flat")
        self.has_objects = bool(packed.triangle_count or packed.sphere_count)
        flags = set()
        if self.has_objects:
            flags.add("GEOMETRY")
            if "color" in asked:
                flags.add("COLOR")
            if "surface" in asked:
                flags.add("SURFACE_PASSES")
        if self.settings.step_control != "constant" and asked & {"steps", "error", "rejected"}:
            flags.add("EFFORT")
            if "rejected" in asked:
                flags.add("REJECTED")
        if self.settings.step_control == "embedded":
            flags.add("EMBEDDED")
        # Euler's error is about that of the chord, so that the paper needs no more than step doubling.
        if self.has_objects and ("EMBEDDED" in flags or (self.doubling and self.settings.integrator != "euler")):
            flags.add("CHORDS")
        if asked & {"depth", "steps", "error", "drift"}:
            flags.add("TALLY")
        if "drift" in asked:
            flags |= {"DRIFT", "FROM_START"}
        if "frequency" in asked:
            flags |= {"FREQUENCY", "FROM_START"}
        self.flags = frozenset(flags)

        start = "common/ray_start", camera, f"camera/moment_{request.camera}", *observer
        self.setup = self._with_model("passes/ray_setup", "common/bounds", *start)
        control = () if self.settings.step_control == "constant" else (f"step_control/{self.settings.step_control}",)
        if "CHORDS" in flags:
            control = (*control, "chords/sagitta")
        inside = (request.advance,)
        noted = set()
        if "EMBEDDED" in flags:  # step doubling writes down the effort in its own pass, after both integrations
            chords = ("chords/none",) if "CHORDS" not in flags else ()
            errors = request.errors if "error" in asked else "errors/none"
            inside = ("common/bounds", "stepping/embedded", *control, *chords, errors)
            noted = flags & {"EMBEDDED", "EFFORT"}
        self.integrate = self._with_model("passes/integrate", *request.integrator.files, *inside, flags=noted)
        self.integrate = replace(self.integrate, generated=self.integrate.generated + request.integrator.generated)
        self.step_control = self._with_model("passes/step_control", *control, flags=flags & {"EFFORT", "CHORDS"})
        from_start = start if "DRIFT" in flags else (camera, *observer) if "FROM_START" in flags else ()
        self.terminate = self._with_model("passes/terminate", "common/bounds", *from_start, flags=flags)
        self.cull = Choice("passes/cull")
        sky = "environment/cube" if request.cube is not None else "environment/constant"
        self.sky = Choice("passes/sky", (sky,), frozenset(flags & {"GEOMETRY"}))
        if request.far_sky is not None:
            far = "environment/far_constant" if request.far_sky.faces is None else "environment/far_cube"
            self.sky = self._with_model("passes/sky", sky, far, flags=flags & {"GEOMETRY"} | {"FAR_SKY"})
        self.kinds = self._kinds()

    def _with_model(self, main: str, *files: str, flags: Set[str] = frozenset()) -> Choice:
        """A program that calls the model's functions."""
        model = self.request.model
        return Choice(main, (*files, *model.files), frozenset(flags) | model.flags, model.generated)

    def _kinds(self) -> list[Kind]:
        packed = self.request.packed
        shading, flags = [], set(self.flags & {"COLOR", "SURFACE_PASSES"})
        if "COLOR" in flags:
            shading, shading_flags = shading_choice(packed)
            flags |= shading_flags
        kinds = []
        if packed.triangle_count:
            culled = flags | {"CULL_GROUPS"} if "u_triangle_groups" in packed.arrays else flags
            files = ("intersection/triangles", *shading)
            kinds.append(Kind(Choice("passes/intersect", files, frozenset(culled)), packed.triangle_count))
        if packed.sphere_count:
            files = ("intersection/spheres", *shading)
            kinds.append(Kind(Choice("passes/intersect", files, frozenset(flags)), packed.sphere_count))
        return kinds

    def choices(self) -> list[Choice]:
        """Every program of this frame; the compiler is called for these and no others."""
        choices = [self.setup, self.integrate, self.terminate, *(kind.choice for kind in self.kinds)]
        if self.doubling:
            choices.append(self.step_control)
        if self.settings.early_termination in ("hits", "bounds"):
            choices.append(self.cull)
        if "color" in self.request.outputs:
            choices.append(self.sky)
        return choices

    # Memory

    def _upload(self) -> None:
        self.scene_textures = {}
        intersections = [self.device.program(kind.choice) for kind in self.kinds]
        for name, array in self.request.packed.arrays.items():
            if not any(program.uses(name) for program in intersections):
                continue
            dtype = "f2" if name == "u_image_texels" else "f4"
            data = array.clip(-CLIPPED_HALF, CLIPPED_HALF) if dtype == "f2" else array
            rows, columns, _ = data.shape
            self.scene_textures[name] = self.device.texture((columns, rows), data, dtype)
        self.model_textures = {name: self._model_texture(data) for name, data in self.request.model.textures.items()}
        self.camera_textures = {}
        if self.request.rays is not None:
            for name, data in zip(GIVEN_RAYS, self.request.rays, strict=True):
                self.camera_textures[name] = self.device.texture((data.shape[1], data.shape[0]), data)
        skies = {"u_sky": self.request.cube, "u_far_sky": self.request.far_sky and self.request.far_sky.faces}
        self.sky_textures = {name: self.device.cube(faces) for name, faces in skies.items() if faces is not None}

    def _model_texture(self, data: np.ndarray):
        """(rows, columns, 4) is a table of texels, (depth, rows, columns, channels) a volume."""
        if data.ndim == 4:
            return self.device.volume(data)
        return self.device.texture((data.shape[1], data.shape[0]), data)

    @property
    def uploaded_bytes(self) -> int:
        textures = (*self.scene_textures.values(), *self.camera_textures.values())
        cubes = sum(6 * cube.size[0] * cube.size[1] * cube.components * 4 for cube in self.sky_textures.values())
        volumes = sum(4 * data.size for data in self.request.model.textures.values())
        tables = sum(t.width * t.height * t.components * (2 if t.dtype == "f2" else 4) for t in textures)
        return cubes + volumes + tables

    def _make_targets(self) -> None:
        device, size = self.device, self.tile
        early = self.settings.early_termination
        self.ended_depth = device.depth_buffer(size)
        self.culled_depth = device.depth_buffer(size) if early in ("hits", "bounds") else self.ended_depth
        tested = self.culled_depth if early != "off" else None

        ray_type = "f2" if self.settings.ray_bits == 16 else "f4"
        ray = {"x": 4, "v": 4}
        effort = {"effort": 4} if "REJECTED" in self.flags else {"effort": 2} if "EFFORT" in self.flags else {}
        self.rays = Pair(device, size, ray | effort, ray_type, tested)
        # Ray setup and the integrations of step doubling write x and v only.
        self.setup_target = device.target({name: self.rays.before[name] for name in ray})
        if self.doubling:
            results = ("full_x", "full_v"), ("half_x", "half_v")
            self.results = {name: device.texture(size, dtype=ray_type) for pair in results for name in pair}
            self.full, self.half = (
                device.target({name: self.results[result] for name, result in zip(ray, pair, strict=True)}, tested)
                for pair in results
            )
        if self.has_objects:
            found = {"depth": 2, "color": 4, "surface": 4}
            if "COLOR" not in self.flags:
                del found["color"]
            if "SURFACE_PASSES" not in self.flags:
                del found["surface"]
            self.found = Pair(device, size, found, "f4", tested)
        ends = [name.removeprefix("out_") for name in device.program(self.terminate).outputs]
        self.end_textures = {name: device.texture(size) for name in ends}
        self.ends = device.target(self.end_textures, self.ended_depth)
        self.culled = device.target({}, self.culled_depth)
        self.picture = device.texture(size)
        self.picture_target = device.target({"color": self.picture})

    # Drawing

    def tile_size(self) -> tuple[int, int]:
        """Columns and rows of the next tile: always the same, since its draws are kept short by their batches."""
        return self.tile

    def _draw(self, choice: Choice, target, textures: dict, uniforms: dict, z: float = 0.5, write_depth=False) -> None:
        target.begin(self.viewport, write_depth)
        self.device.program(choice).draw(
            target, self.model_textures | textures, self.values | uniforms | {"u_quad_depth": z}
        )

    def trace(
        self,
        columns: int,
        rows: int,
        pixel_offset: tuple[float, float],
        report: Callable[[float], None] = lambda fraction: None,
        stopped: Callable[[], bool] = lambda: False,
    ) -> TileEnds | None:
        """Trace one tile. pixel_offset : of its corner in the whole image, plus the sample's place in the pixel.
        report(fraction) as it goes on; None where stopped() said so.
        """
        self.viewport = (columns, rows)
        request = self.request
        self.values = request.uniforms | {
            "u_pixel_offset": pixel_offset,
            "u_step": request.first_step,
            "u_smallest_step": request.smallest_step,
            "u_tolerance": self._tolerance(),
            "u_chord_tolerance": self.settings.chord_tolerance or self.settings.tolerance,
            "u_error_order": float(request.integrator.error_order),
            "u_inverse_order": 1.0 / max(request.integrator.error_order, 1),
            "u_escape_radius": request.escape_radius,
            "u_inner_radius": request.inner_radius,
            "u_bends_within": request.bends_within,
            "u_first_reach": 0.0,
        }
        with self.watch.stage("trace"):
            if not self._trace(report, stopped):
                return None
            self.device.finish()
        with self.watch.stage("read"):
            return self._read()

    def _tolerance(self) -> float:
        """Radians that a segment of step doubling, or a single step of an embedded method, may be wrong by."""
        if self.settings.step_control != "embedded":
            return self.settings.tolerance
        return self.request.integrator.step_tolerance(self.settings.tolerance)

    def _trace(self, report: Callable[[float], None], stopped: Callable[[], bool]) -> bool:
        """Every segment of every ray of the tile; False where stopped() said so."""
        self.rays.reset()
        self._clear()
        self._draw(self.setup, self.setup_target, self.camera_textures, {})
        self.rays.swap()
        for segment in range(self.segments):
            if stopped():
                return False
            report(segment / self.segments)
            checked = segment % ALIVE_CHECK == 0
            if checked:  # the driver queues draws; without this a cancel would wait for all of them
                self.device.finish()
            if not self._advance(ask=checked and self.settings.early_termination == "both"):
                break
            for kind in self.kinds:
                self._intersect(kind, segment)
            self._terminate(segment, last=segment == self.segments - 1)
        return True

    def _clear(self) -> None:
        self.ends.clear(depth=1.0)
        self.culled.clear(depth=1.0)
        if self.has_objects:
            for side in self.found.targets:
                side.clear(FAR, FAR, FAR, FAR)
        for side in self.rays.targets:
            side.clear()

    def _advance(self, ask: bool) -> bool:
        """One segment for every ray. False where asked and no ray is left."""
        steps = self.steps
        target = self.full if self.doubling else self.rays.write
        textures = self.rays.read()
        uniforms = {"u_steps": steps, "u_step_factor": 1.0}
        if ask:
            query = self.device.any_drawn()
            with query:
                self._draw(self.integrate, target, textures, uniforms)
            if not query.samples:
                return False
        else:
            self._draw(self.integrate, target, textures, uniforms)
        if self.doubling:
            self._draw(self.integrate, self.half, textures, {"u_steps": 2 * steps, "u_step_factor": 0.5})
            both = {f"u_{name}": texture for name, texture in self.results.items()}
            evaluated = {"u_steps": steps, "u_steps_a_segment": float(3 * steps)}  # n steps of h and 2 n of h/2
            self._draw(self.step_control, self.rays.write, textures | both, evaluated)
        self.rays.swap()
        return True

    def _intersect(self, kind: Kind, segment: int) -> None:
        size = self.settings.batch_size or self._batches.get(kind.choice) or self._measured_batch(kind)
        for first in range(0, kind.count, size):
            self._draw_batch(kind, segment, first, min(size, kind.count - first))
            self.found.swap()

    def _draw_batch(self, kind: Kind, segment: int, first: int, count: int) -> None:
        textures = self.scene_textures | self.rays.read() | {"u_x_before": self.rays.before["x"]}
        textures |= self.found.read("u_{}_before")
        uniforms = {"u_segment": float(segment), "u_first": first, "u_count": count}
        self._draw(kind.choice, self.found.write, textures, uniforms)

    def _measured_batch(self, kind: Kind) -> int:
        """How many objects of this kind a draw may read, from the time that a few of them take on these rays.

        The trial writes to the side that the real draw writes afterwards, so that it leaves no trace.
        """
        trial = min(TRIAL_BATCH, kind.count)
        self.device.finish()
        begin = time.perf_counter()
        self._draw_batch(kind, 0, 0, trial)
        self.device.finish()
        seconds = max(time.perf_counter() - begin, 1e-6)
        pixels = self.tile[0] * self.tile[1] / (self.viewport[0] * self.viewport[1])
        size = int(trial * LONGEST_DRAW / (seconds * pixels))
        self._batches[kind.choice] = max(TRIAL_BATCH, min(size, LARGEST_BATCH))
        return self._batches[kind.choice]

    def _terminate(self, segment: int, last: bool) -> None:
        uniforms = {
            "u_segment": float(segment),
            "u_last_segment": last,
            "u_steps_taken": float((segment + 1) * self.steps),
        }
        textures = self.rays.read() | {"u_x_before": self.rays.before["x"]} | self.camera_textures
        if self.has_objects:
            textures |= self.found.read()
        self._draw(self.terminate, self.ends, textures, uniforms, z=0.0, write_depth=True)
        early = self.settings.early_termination
        if early in ("hits", "bounds"):
            uniforms = {"u_cull_hits": early == "hits", "u_cull_bounds": early == "bounds"}
            self._draw(self.cull, self.culled, {"u_end_v": self.end_textures["v"]}, uniforms, z=0.0, write_depth=True)

    def _read(self) -> TileEnds:
        columns, rows = self.viewport
        color = None
        if "color" in self.request.outputs:  # the sky is the last pass
            textures = self.sky_textures | {f"u_end_{name}": texture for name, texture in self.end_textures.items()}
            if self.has_objects:
                textures["u_color"] = self.end_textures["color"]
            failed = MARKER if self.settings.failed_rays == "marker" else (0.0, 0.0, 0.0, 0.0)
            self._draw(self.sky, self.picture_target, textures, {"u_failed_color": failed})
            color = read(self.picture, columns, rows)
        parts = {name: read(texture, columns, rows) for name, texture in self.end_textures.items() if name != "color"}
        return TileEnds(
            parts["x"],
            parts["v"],
            color,
            parts.get("surface"),
            parts.get("tally"),
            parts.get("frequency"),
            parts.get("rejected"),
        )

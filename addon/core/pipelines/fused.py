"""The fused pipeline: the whole life of every ray in one fragment program (passes/fused.glsl), one draw for a tile.

It is the paper's own future work (Section 7): the loop over integration and intersection unrolled into one program,
space partitioning (addon/core/bvh.py), deferred shading. The depth of a ray is τ, where it ended. Models, integrators,
step control, cameras, observers, intersection, shading and environment are the files that the paper's pipeline uses.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..compose import Choice
from ..device import BYTES, Device
from ..status import Status
from .paper import CLIPPED_HALF, MARKER
from .tile import GIVEN_RAYS, Request, Stopwatch, TileEnds, shading_choice

SHORTEST_DRAW, LONGEST_DRAW = 0.025, 0.06  # seconds a draw is to take: a display that shares the device must not wait
# Of a ray's tolerance, what the curve that meets the objects may be away from it. Measured: pixels of the samples that
# differ from a tight reference fall with it from some 100 to at most 8 of 76,800, at hardly any cost in time.
CURVE_SHARE = 0.05
FIRST_REACH = 0.05  # of the bounding sphere's radius: the first step that is tried where steps adapt
# How far a part of a ray may stray from its chord, in leaves of the tree. Measured with a torus of 256 to 1,048,576
# triangles and 1 to 1000 spheres: thicker ones meet more leaves, thinner ones are more parts.
THICKNESS = 0.2
HALVES = ("u_image_texels", "u_image_mips")  # textures of half floats
SMALLEST_TILE, FIRST_TILE, LARGEST_TILE = 16, 32, 512  # pixels a side
STEPS_A_DRAW = 512  # of a ray; the same for every draw, so that a picture does not depend on how long draws take
# Of a block of pixels, a side and the rays that may take long. Tiles hold whole blocks: their own sizes are a matter of
# time, on which a picture must not depend.
BLOCK, FEW = 16, 32
QUADS_A_ROW = 256  # rays that are taken up again are drawn as 2 x 2 quads in a picture of this width


class FusedPipeline:
    """Made once a frame, in the GPU's thread; trace() is called for every tile and sample.

    size : of the picture, columns and rows; no tile is larger
    """

    def __init__(self, device: Device, request: Request, size: tuple[int, int], watch: Stopwatch):
        self.watch = watch
        self.device, self.request, self.settings = device, request, request.settings
        self.size = size
        self.choice = self._choose_program()
        with watch.stage("compile"):
            device.program(self.choice)
        with watch.stage("upload"):
            self._upload()
            device.finish()
        # What the program's last frame has learned, but less: another setting may have made its rays slower.
        columns, rows = device.tile_sizes.get(self.choice, (FIRST_TILE, 2 * FIRST_TILE))
        self._tile = columns, max(rows // 2, SMALLEST_TILE)
        self.prolonged = (0, 0)  # how many rays took more steps than others may, and how many at most
        self._target_size = (0, 0)

    # What the scene needs

    def _choose_program(self) -> Choice:
        request, packed, settings = self.request, self.request.packed, self.settings
        model, asked = request.model, request.outputs
        files = ["common/ray_start", f"camera/{request.camera}", f"camera/moment_{request.camera}"]
        files += [f"observers/{request.observer}", *model.files]
        generated = model.generated
        flags = set(model.flags)
        if request.flat_frame:
            files.append("observers/flat")
        if request.straight:
            flags.add("STRAIGHT")
        else:
            files += ["common/bounds", *request.integrator.files, f"stepping/{settings.step_control}"]
            generated += request.integrator.generated
            estimates = settings.step_control != "constant"
            files.append(request.errors if estimates and "error" in asked else "errors/none")
            if estimates:
                files.append(f"step_control/{settings.step_control}")
                if "rejected" in asked:
                    flags.add("REJECTED")
            if settings.step_control == "embedded":
                files.append("chords/none")
        if packed.triangle_count or packed.sphere_count:
            flags |= {"GEOMETRY", "TREE"}
            if not request.straight:
                files += ["common/curves", "intersection/empty_space"]
                flags.add("CURVES")
                if request.integrator.second_derivatives:
                    flags.add("QUINTIC")
            files.append("intersection/tree")
            if packed.triangle_count:
                files.append("intersection/triangles")
                flags.add("TRIANGLES")
            if packed.sphere_count:
                files.append("intersection/spheres")
                flags.add("SPHERES")
            if "surface" in asked:
                flags.add("SURFACE_PASSES")
        if "color" in asked:
            flags.add("COLOR")
            files.append("environment/cube" if request.cube is not None else "environment/constant")
            if request.far_sky is not None:
                flags.add("FAR_SKY")
                files.append("environment/far_constant" if request.far_sky.faces is None else "environment/far_cube")
            if "GEOMETRY" in flags:
                shading, shading_flags = shading_choice(packed)
                files += shading
                flags |= shading_flags
            if settings.filter_textures:
                self._choose_filters(files, flags)
        if asked & {"depth", "steps", "error", "drift"}:
            flags.add("TALLY")
        if "drift" in asked:
            flags.add("DRIFT")
        if "frequency" in asked:
            flags.add("FREQUENCY")
        if settings.refines_edges and "color" in asked:
            flags.add("QUAD_LIST")
        return Choice("passes/fused", tuple(files), frozenset(flags), generated)

    def _choose_filters(self, files: list[str], flags: set[str]) -> None:
        """Add what the sky's cubes and the images need to be filtered with the rays' own derivatives."""
        skies = {"environment/cube": "FILTERED_SKY", "environment/far_cube": "FILTERED_FAR_SKY"}
        filtered = {flag for file, flag in skies.items() if file in files}
        if filtered:
            files.append("environment/mipmaps")
        if "IMAGES" in flags:
            filtered.add("FILTERED_IMAGES")
            files.append("shading/mipmaps")
        if filtered:
            # Before the files that call it: it defines constants as well.
            files.insert(0, "common/footprint")
            flags |= {"FILTERED", *filtered}

    # Memory

    def _upload(self) -> None:
        request, device = self.request, self.device
        self.textures = {}
        self.uploaded_bytes = 0
        for name, array in request.packed.arrays.items():
            if not device.program(self.choice).uses(name):
                continue
            half = name in HALVES
            data = array.clip(-CLIPPED_HALF, CLIPPED_HALF) if half else array
            kind = "f2" if half else f"{array.dtype.kind}{array.dtype.itemsize}"
            volume = data.ndim == 4
            self.textures[name] = device.volume(data, kind) if volume else device.texture(data.shape[1::-1], data, kind)
            self.uploaded_bytes += data.size * BYTES[kind]
        given = zip(GIVEN_RAYS, request.rays or (), strict=False)
        for name, data in given:
            self.textures[name] = device.texture((data.shape[1], data.shape[0]), data)
            self.uploaded_bytes += data.nbytes
        skies = {"u_sky": request.cube, "u_far_sky": request.far_sky and request.far_sky.faces}
        cubes = {
            name: device.cube(faces, self.settings.filter_textures)
            for name, faces in skies.items()
            if faces is not None
        }
        cube_bytes = sum(6 * cube.size[0] * cube.size[1] * cube.components * 4 for cube in cubes.values())
        self.uploaded_bytes += cube_bytes * 4 // 3 if self.settings.filter_textures else cube_bytes  # the mipmaps
        self.uploaded_bytes += sum(4 * data.size for data in request.model.textures.values())
        self.textures |= cubes
        for name, data in request.model.textures.items():
            volume = data.ndim == 4
            self.textures[name] = device.volume(data) if volume else device.texture(data.shape[1::-1], data)

    def _make_target(self, columns: int, rows: int) -> None:
        if columns <= self._target_size[0] and rows <= self._target_size[1]:
            return
        self._target_size = (max(columns, self._target_size[0]), max(rows, self._target_size[1]))
        names = [name.removeprefix("out_") for name in self.device.program(self.choice).outputs]
        self.target = self.device.target({name: self.device.texture(self._target_size) for name in names})

    # Drawing

    def tile_size(self) -> tuple[int, int]:
        """Columns and rows that the next tile may have: as many as the last ones' time allows."""
        return min(self._tile[0], self.size[0]), min(self._tile[1], self.size[1])

    def _learn(self, columns: int, rows: int, seconds: float) -> None:
        """Half of the pixels, and half again, where a draw took too long; twice or four times as many where it took
        hardly any time.
        """
        width, height = self._tile
        if seconds > LONGEST_DRAW:
            while seconds > LONGEST_DRAW and width * height > SMALLEST_TILE**2:
                width, height = (width // 2, height) if width > height else (width, height // 2)
                seconds /= 2.0
        elif columns * rows >= min(width, self.size[0]) * min(height, self.size[1]):
            for limit in (SHORTEST_DRAW, 0.5 * SHORTEST_DRAW):
                if seconds < limit:
                    width, height = (2 * width, height) if width <= height else (width, 2 * height)
            width, height = min(width, LARGEST_TILE), min(height, LARGEST_TILE)
        self._tile = width, height

    def trace(
        self,
        columns: int,
        rows: int,
        pixel_offset: tuple[float, float],
        report: Callable[[float], None] = lambda fraction: None,
        stopped: Callable[[], bool] = lambda: False,
        corners: np.ndarray | None = None,
    ) -> TileEnds | None:
        """Trace one tile. pixel_offset : of its corner in the whole image, plus the sample's place in the pixel.
        None where stopped() said so.

        corners : (rows / 2, columns / 2, 2): instead of a tile of the image, some of its 2 x 2 quads, the lower left
        pixel of each, for samples beyond the usual ones
        """
        if stopped():
            return None
        with self.watch.stage("trace"):
            begin = time.perf_counter()
            drawn = columns, rows
            if self.choice.flags & {"FILTERED", "QUAD_LIST"}:  # whole 2 x 2 quads, for derivatives at the tile's edges
                drawn = columns + columns % 2, rows + rows % 2
            textures = self.textures
            if "QUAD_LIST" in self.choice.flags:
                textures = textures | {"u_quads": self._quad_list(*drawn, corners)}
            samples = self.settings.samples if corners is None else self.settings.edge_samples
            values = self.request.uniforms | self._values() | {"u_pixel_offset": pixel_offset, "u_quad_depth": 0.5}
            values["u_footprint_scale"] = 1.0 / math.sqrt(samples)
            self._draw(self.choice, drawn, textures, values)
            self._learn(columns, rows, time.perf_counter() - begin)
            self.device.tile_sizes[self.choice] = self._tile
        parts = self._read(columns, rows)
        if (parts["v"][..., 3] == Status.RUNNING).any():
            parts = self._go_on(self._read(columns, rows, state=True), corners, values, report, stopped)
        return parts and TileEnds(
            parts["x"],
            parts["v"],
            parts.get("color"),
            parts.get("surface"),
            parts.get("tally"),
            parts.get("frequency"),
            parts.get("rejected"),
        )

    def _draw(self, choice: Choice, size: tuple[int, int], textures: dict, values: dict) -> None:
        self._make_target(*size)
        self.target.begin(size)
        self.device.program(choice).draw(self.target, textures, values)
        self.device.finish()

    def _go_on(self, parts: dict, corners: np.ndarray | None, values: dict, report, stopped) -> dict | None:
        """parts (output name -> (rows, columns, 4)) with the rays that were not at their end drawn until they are.
        None where stopped() said so.  corners : as trace() has it

        Where few rays reach the step limit, it is doubled for them, until they take max_steps: near a photon orbit they
        wind around, the more often the nearer they are to it. Many rays mean that the limit is too low, or meant.
        """
        rows, columns = parts["v"].shape[:2]
        even = (0, rows % 2), (0, columns % 2), (0, 0)
        quads = {name: _in_quads(np.pad(part, even, "edge")) for name, part in parts.items()}
        picked = corners is not None
        if not picked:
            corners = _corners(columns + columns % 2, rows + rows % 2)
        corners = corners.reshape(-1, 2)
        files = tuple(self.request.model.of_long_rays.get(file, file) for file in self.choice.files)
        choice = replace(self.choice, files=files, flags=self.choice.flags | {"RESUMED", "QUAD_LIST"})
        names = ("x", "v", "more", "rejected") if "REJECTED" in choice.flags else ("x", "v", "more")
        rays = None
        while (running := quads["v"][..., 3] == Status.RUNNING).any():
            if stopped():
                return None
            taken = int(quads["more"][running][:, 3].min())
            report(taken / values["u_pause"])
            limits = {}
            if taken >= values["u_pause"]:
                many = running & ~(picked | _few(running, corners))[:, None, None]
                if many.any():
                    running, limits = many, {"u_max_steps": values["u_pause"]}
                else:
                    self._prolong(values, int(running.sum()))
            needed = np.flatnonzero(running.any(axis=(1, 2)))
            wide = min(len(needed), QUADS_A_ROW)
            high = math.ceil(len(needed) / wide)
            listed = needed[np.minimum(np.arange(wide * high), len(needed) - 1)]  # the last one fills up the last row
            with self.watch.stage("trace"):
                if rays is None:
                    rays = self.device.texture((len(names) * 2 * wide, 2 * high))
                    table_of_quads = self.device.texture((wide, high), components=2)
                # In one texture, for there may be no more than 16 in a program.
                side_by_side = np.stack([_as_picture(quads[name][listed], wide) for name in names], axis=2)
                rays.write(side_by_side.tobytes(), (0, 0, len(names) * 2 * wide, 2 * high))
                table_of_quads.write(corners[listed].astype(np.float32).tobytes(), (0, 0, wide, high))
                textures = self.textures | {"u_ray": rays, "u_quads": table_of_quads}
                self._draw(choice, (2 * wide, 2 * high), textures, values | limits)
            for name, part in self._read(2 * wide, 2 * high, state=True).items():
                new = _in_quads(part)[: len(needed)]
                quads[name][needed] = np.where(running[needed][..., None], new, quads[name][needed])
        return {name: _as_picture(part, (columns + 1) // 2)[:rows, :columns] for name, part in quads.items()}

    def _prolongs(self) -> bool:
        """Whether the step limit is there to end rays that never would. Constant steps up to it are a length of the
        user's choice, and so is a limit that one draw reaches.
        """
        return self.settings.step_control != "constant" and self.settings.step_limit > STEPS_A_DRAW

    def _prolong(self, values: dict, rays: int) -> None:
        """Let some rays take twice as many steps."""
        count, most = self.prolonged
        if values["u_pause"] == self.settings.step_limit:
            count += rays
        values["u_pause"] = min(2 * values["u_pause"], values["u_max_steps"])
        self.prolonged = count, max(most, values["u_pause"])

    def _quad_list(self, columns: int, rows: int, corners: np.ndarray | None):
        """A texture of the corners of the quads to draw; by default those of a tile, from its own corner on."""
        if corners is None:
            corners = _corners(columns, rows)
        return self.device.texture((columns // 2, rows // 2), corners, components=2)

    def _values(self) -> dict[str, object]:
        request, settings = self.request, self.settings
        tolerance = settings.tolerance
        if settings.step_control == "embedded":
            tolerance = request.integrator.step_tolerance(tolerance)
        values = {
            "u_step": request.first_step,
            "u_smallest_step": request.smallest_step,
            "u_first_reach": FIRST_REACH * request.escape_radius if settings.step is None else 0.0,
            "u_steps": settings.steps_per_segment,
            "u_pause": settings.step_limit,
            "u_max_steps": settings.max_steps if self._prolongs() else settings.step_limit,
            "u_draw_steps": STEPS_A_DRAW,
            "u_tolerance": tolerance,
            "u_chord_tolerance": settings.chord_tolerance or CURVE_SHARE * settings.tolerance,
            "u_error_order": float(request.integrator.error_order),
            "u_inverse_order": 1.0 / max(request.integrator.error_order, 1),
            "u_escape_radius": request.escape_radius,
            "u_inner_radius": request.inner_radius,
            "u_bends_within": request.bends_within,
            "u_failed_color": MARKER if settings.failed_rays == "marker" else (0.0, 0.0, 0.0, 0.0),
        }
        if request.packed.empty_space is not None:
            values |= request.packed.empty_space.uniforms()
            values["u_stray_limit"] = THICKNESS * request.packed.leaf_size
        return values

    def _read(self, columns: int, rows: int, state: bool = False) -> dict[str, np.ndarray]:
        """Output name -> float32, (rows, columns, 4).  state : also what only rays that go on need"""
        with self.watch.stage("read"):
            names = [name.removeprefix("out_") for name in self.target.outputs]
            wanted = [(index, name) for index, name in enumerate(names) if state or name != "more"]
            return {name: self.target.read(index, columns, rows) for index, name in wanted}


def _corners(columns: int, rows: int) -> np.ndarray:
    """(rows / 2, columns / 2, 2): column and row of the lower left pixel of every 2 x 2 quad of a tile."""
    return np.stack(np.meshgrid(np.arange(0, columns, 2), np.arange(0, rows, 2)), axis=-1)


def _few(running: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """bool, (n,): whether few rays of the block around a quad are running.  running : (n, 2, 2);  corners : (n, 2)"""
    _, block = np.unique(corners // BLOCK, axis=0, return_inverse=True)
    return np.bincount(block.ravel(), running.sum(axis=(1, 2)))[block.ravel()] <= FEW


def _in_quads(picture: np.ndarray) -> np.ndarray:
    """(2 r, 2 c, 4) -> (r c, 2, 2, 4), row by row."""
    rows, columns, channels = picture.shape
    return picture.reshape(rows // 2, 2, columns // 2, 2, channels).swapaxes(1, 2).reshape(-1, 2, 2, channels)


def _as_picture(quads: np.ndarray, wide: int) -> np.ndarray:
    """(r wide, 2, 2, 4) -> (2 r, 2 wide, 4): what _in_quads() took apart."""
    channels = quads.shape[-1]
    return quads.reshape(-1, wide, 2, 2, channels).swapaxes(1, 2).reshape(-1, 2 * wide, channels)

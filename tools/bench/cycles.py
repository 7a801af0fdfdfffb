"""Against Cycles on the processor, in Blender itself: the same torus, emission only, one sample, no bounces.

Warm is a second frame: Cycles keeps its data (persistent data), we have the scene on the device, so that our frame is
trace and read-back. Cold is a first frame: Cycles reads the scene and builds its tree; we export, build, upload, trace
and read back. The compiler's time is not in it: programs are compiled once a session. Cycles' frame also evaluates the
scene for the render; ours reads it as it is evaluated.
Cycles' light is straight. Our frames are curved, no more than 0.1 pixel off at the 99th percentile, and straight.
"""

from __future__ import annotations

import time
from collections.abc import Mapping

import numpy as np

from addon.core.scene import Scene
from addon.core.settings import Settings
from addon.core.trace import render
from tools import bpy_extension

from . import scenes, tried
from .measure import Job, KeptFrame, Timings, interleaved, wall_job
from .mode import Mode
from .report import Part, Table, Target
from .scaling import PIXELS, within_pixels

RINGS = (128, 512)  # of the torus: 65,536 and 1,048,576 triangles
SKY = (512, 256)  # texels of the sky's picture
TINY = 16  # pixels a side of a frame that shows what Cycles takes for any frame
STAGES = ("export", "pack", "upload", "trace", "read")
MOST_CURVED, MOST_TORUS, MOST_SKY, MOST_COLD = 3.0, 2.5, 1.0, 1.0


class Blender:
    """A file with the camera of scenes.py, a sky, and a torus that can be left out."""

    def __init__(self) -> None:
        bpy_extension.link()
        import bpy

        self.bpy, self.modules = bpy, bpy_extension.enable()
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        self.scene = bpy.context.scene
        self._add_camera()
        self._add_sky()
        cycles, render = self.scene.cycles, self.scene.render
        render.engine, cycles.device = "CYCLES", "CPU"
        cycles.samples, cycles.max_bounces = 1, 0
        cycles.use_adaptive_sampling = cycles.use_denoising = False
        render.threads_mode = "AUTO"  # all of them, as llvmpipe
        render.use_compositing = render.use_sequencer = False

    @property
    def version(self) -> str:
        return self.bpy.app.version_string

    def _add_camera(self) -> None:
        view = scenes.camera((4, 3))
        data = self.bpy.data.cameras.new("Camera")
        data.sensor_fit, data.sensor_width = "HORIZONTAL", 36.0
        data.lens = data.sensor_width / (view.window[1] - view.window[0])
        obj = self.bpy.data.objects.new("Camera", data)
        obj.matrix_world = view.world_from_camera.T.tolist()  # Blender takes columns
        self.scene.collection.objects.link(obj)
        self.scene.camera = obj

    def _add_sky(self) -> None:
        """A picture of smooth colours around everything."""
        width, height = SKY
        u, v = np.meshgrid(np.arange(width) / width, np.arange(height) / height)
        pixels = np.stack([0.5 + 0.4 * np.sin(6.28 * u), v, 1.0 - v, np.ones_like(u)], axis=-1)
        image = self.bpy.data.images.new("Sky", width, height, float_buffer=True)
        image.pixels.foreach_set(pixels.astype(np.float32).ravel())
        image.pack()
        world = self.bpy.data.worlds.new("World")
        if world.node_tree is None:
            world.use_nodes = True
        nodes, links = world.node_tree.nodes, world.node_tree.links
        background = next(node for node in nodes if node.bl_idname == "ShaderNodeBackground")
        texture = nodes.new("ShaderNodeTexEnvironment")
        texture.image = image
        links.new(texture.outputs["Color"], background.inputs["Color"])
        self.scene.world = world

    def show_torus(self, rings: int) -> None:
        """4 rings² triangles that glow; 0 takes them away."""
        bpy = self.bpy
        for mesh in list(bpy.data.meshes):
            bpy.data.meshes.remove(mesh)  # takes the object along
        if not rings:
            return
        vertices, quads = scenes.torus_mesh(rings)
        corners = quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
        mesh = bpy.data.meshes.new("Torus")
        mesh.vertices.add(len(vertices))
        mesh.vertices.foreach_set("co", vertices.astype(np.float32).ravel())
        mesh.loops.add(corners.size)
        mesh.loops.foreach_set("vertex_index", corners.astype(np.int32).ravel())
        mesh.polygons.add(len(corners))
        mesh.polygons.foreach_set("loop_start", np.arange(0, corners.size, 3, dtype=np.int32))
        mesh.update(calc_edges=True)
        mesh.materials.append(self._glow())
        self.scene.collection.objects.link(bpy.data.objects.new("Torus", mesh))

    def _glow(self):
        material = self.bpy.data.materials.get("Glow")
        if material is None:
            material = self.bpy.data.materials.new("Glow")
            if material.node_tree is None:
                material.use_nodes = True
            nodes = material.node_tree.nodes
            nodes.clear()
            emission = nodes.new("ShaderNodeEmission")
            emission.inputs["Color"].default_value = (0.9, 0.6, 0.2, 1.0)
            output = nodes.new("ShaderNodeOutputMaterial")
            material.node_tree.links.new(emission.outputs[0], output.inputs["Surface"])
        return material

    def set_size(self, size: tuple[int, int]) -> None:
        self.scene.render.resolution_x, self.scene.render.resolution_y = size
        self.scene.render.resolution_percentage = 100

    def cycles_job(self, size: tuple[int, int], keep: bool) -> Job:
        """keep : the data of the frame before, which has to have been of the same scene."""

        def frame() -> None:
            self.set_size(size)
            self.scene.render.use_persistent_data = keep
            self.bpy.ops.render.render()

        return wall_job(frame)

    def export(self, model_name: str) -> Scene:
        """The scene as arrays: those of the enabled extension's classes, which are the same."""
        model = self.modules("addon.core.models").MODELS[model_name]()
        depsgraph = self.bpy.context.evaluated_depsgraph_get()
        placement = self.modules("addon.core.scene").Placement()
        return self.modules("addon.export").export_scene(depsgraph, model=model, placement=placement)

    def cold_job(self, size: tuple[int, int], model_name: str, chosen: Settings) -> Job:
        """Our frame from the beginning."""

        def job() -> Mapping[str, float]:
            self.set_size(size)
            begin = time.perf_counter()
            scene = self.export(model_name)
            took = 1e3 * (time.perf_counter() - begin)
            return {"export": took, **render(scene, chosen).statistics.milliseconds}

        return job


def measure(mode: Mode) -> Part:
    blender = Blender()
    tables, figures, targets = [], {"blender": blender.version}, []
    for size in mode.cycles_sizes:
        kinds = {name: within_pixels(size, mode.rays, PIXELS, name) for name in ("automatic", "nystrom_64")}
        rows, named = [], {}
        for label, rings in (("sky", 0), *((f"{4 * rings**2:,}", rings) for rings in RINGS)):
            blender.show_torus(rings)
            chosen, _ = kinds["nystrom_64" if rings else "automatic"]
            warm = warm_frames(blender, size, chosen, mode.repeats)
            rows.append((label, *warm_row(warm)))
            named[label] = {name: timing.as_json() for name, timing in warm.items()}
            if size == mode.cycles_sizes[0]:
                targets += warm_targets(label, warm)
        head = ("warm", "Cycles", "(16 x 16)", "curved", "straight", "curved / Cycles", "curved / straight")
        note = "Direction's error at the 99th percentile, and tolerance: " + "; ".join(
            f"{where} {error:.2g} and {chosen.tolerance:.2g} rad"
            for where, (chosen, error) in zip(("sky", "torus"), kinds.values(), strict=True)
        )
        tables.append(Table(f"Against Cycles: milliseconds at {size[0]} x {size[1]}", head, rows, note))
        figures[f"warm, {size[0]} x {size[1]}"] = named
    size = mode.cycles_sizes[0]
    chosen, _ = within_pixels(size, mode.rays, PIXELS, "nystrom_64")
    cold = cold_frames(blender, size, chosen, mode.slow_repeats)
    figures["cold"] = {name: timing.as_json() for name, timing in cold.items()}
    ratio = cold["ours"].best(*STAGES) / cold["Cycles"].best("frame")
    row = [cold["Cycles"].best("frame"), cold["ours"].best(*STAGES), *(cold["ours"].best(s) for s in STAGES), ratio]
    head = ("Cycles", "ours", *STAGES, "ours / Cycles")
    tables.append(Table(f"Cold: 1,048,576 triangles; milliseconds at {size[0]} x {size[1]}", head, [row]))
    targets.append(Target("Cycles: 1,048,576 triangles, cold, times its time", ratio, MOST_COLD))
    return Part(tables, figures, targets)


def warm_frames(blender: Blender, size: tuple[int, int], chosen: Settings, repeats: int) -> dict[str, Timings]:
    """Cycles' frames come one after another, for it keeps the data of the last; all others are between two of them."""
    blender.set_size(size)
    jobs = {
        "Cycles": blender.cycles_job(size, keep=True),
        "tiny": blender.cycles_job((TINY, TINY), keep=True),
        "curved": KeptFrame(blender.export("schwarzschild"), chosen),
        "straight": KeptFrame(blender.export("straight"), chosen),
    }
    return interleaved(jobs, repeats)


def warm_row(warm: dict[str, Timings]) -> tuple[float, ...]:
    cycles, tiny = warm["Cycles"].best("frame"), warm["tiny"].best("frame")
    curved, straight = (warm[name].best("trace", "read") for name in ("curved", "straight"))
    return cycles, tiny, curved, straight, curved / cycles, curved / straight


def warm_targets(label: str, warm: dict[str, Timings]) -> list[Target]:
    *_, to_cycles, to_straight = warm_row(warm)
    if label == "sky":
        return [Target("Cycles: sky only, curved, times its warm time", to_cycles, MOST_SKY)]
    if label != f"{4 * RINGS[0] ** 2:,}":
        return []
    return [
        Target(f"{label} triangles: curved, times the straight time", to_straight, MOST_CURVED, tried=tried.WALKS),
        Target(f"Cycles: {label} triangles, curved, times its warm time", to_cycles, MOST_TORUS, tried=tried.WALKS),
    ]


def cold_frames(blender: Blender, size: tuple[int, int], chosen: Settings, repeats: int) -> dict[str, Timings]:
    blender.show_torus(RINGS[1])
    jobs = {
        "Cycles": blender.cycles_job(size, keep=False),
        "ours": blender.cold_job(size, "schwarzschild", chosen),
    }
    return interleaved(jobs, repeats, warm=False)

"""The preview in a 3D viewport set to Rendered: coarse pictures made in the background, again after each change."""

from __future__ import annotations

from dataclasses import replace

import bpy
import numpy as np

from .core.scene import Camera
from .export import export_scene
from .job import Job, render_job
from .model_properties import model_and_placement
from .properties import settings_from

COARSE = 4  # screen pixels a side of one pixel where Blender's setting says "Automatic"
MOST_SAMPLES = 1


def pixel_size(scene: bpy.types.Scene) -> int:
    """Screen pixels a side for one pixel of the preview: Render > Performance > Viewport > Pixel Size."""
    chosen = scene.render.preview_pixel_size
    return COARSE if chosen == "AUTO" else int(chosen)


def view_camera(
    view_matrix: np.ndarray, window_matrix: np.ndarray, perspective: bool, width: int, height: int
) -> Camera:
    """The camera of a viewport.

    view_matrix   : (4, 4), view_from_world
    window_matrix : (4, 4), clip_from_view, whose edges are clip space's -1 and 1
    """
    scale = np.array([window_matrix[0, 0], window_matrix[1, 1]])
    middle = np.array([window_matrix[0, 2], window_matrix[1, 2]]) if perspective else -window_matrix[:2, 3]
    left, bottom = (middle - 1.0) / scale
    right, top = (middle + 1.0) / scale
    matrix = np.linalg.inv(view_matrix)
    matrix[:3, :3] /= np.linalg.norm(matrix[:3, :3], axis=0)
    kind = "PERSPECTIVE" if perspective else "ORTHOGRAPHIC"
    return Camera(matrix, (left, right, bottom, top), width, height, kind)


class Viewport:
    """One 3D viewport: the exported scene, the job that is under way and the picture that is shown."""

    def __init__(self, engine: bpy.types.RenderEngine):
        self._engine = engine
        self._scene = None
        self._job: Job | None = None
        self._camera_key = None
        self._texture = None
        self._message = ""

    def changed(self, context, depsgraph) -> None:
        """The scene is not what was exported any more."""
        self.stop()
        self._scene = self._camera_key = None

    def draw(self, context, depsgraph) -> None:
        """Called in Blender's drawing context."""
        region = context.region
        camera = self._camera(context, depsgraph)
        key = (camera.world_from_camera.tobytes(), camera.window, camera.width, camera.height)
        if key != self._camera_key:
            self.stop()
            self._begin(context, depsgraph, camera)
            self._camera_key = key
        self._collect()
        if self._texture is not None:
            self._draw_texture(depsgraph.scene, region.width, region.height)
        self._say()

    def _camera(self, context, depsgraph) -> Camera:
        region, view = context.region, context.region_data
        size = pixel_size(depsgraph.scene)
        width, height = max(region.width // size, 1), max(region.height // size, 1)
        return view_camera(
            np.array(view.view_matrix, np.float64),
            np.array(view.window_matrix, np.float64),
            view.is_perspective,
            width,
            height,
        )

    def _begin(self, context, depsgraph, camera: Camera) -> None:
        """Export where that has to be done again, and start the picture."""
        scene = depsgraph.scene_eval
        try:
            model, placement = model_and_placement(scene, depsgraph, camera.world_from_camera[:3, 3])
            if self._scene is None:
                self._scene = export_scene(depsgraph, model=model, placement=placement, camera=camera)
            settings = replace(
                settings_from(scene, camera), passes=("Combined",), samples=MOST_SAMPLES, edge_samples=MOST_SAMPLES
            )
            exported = replace(self._scene, camera=camera, model=model, placement=placement)
        except Exception as error:  # drawn as a sentence: a viewport has no other place for it
            self._message = str(error)
            return
        self._message = ""
        self._job = render_job(exported, settings)

    def _collect(self) -> None:
        """Take the finished picture, or ask to be drawn again."""
        if self._job is None:
            return
        if not self._job.done:
            self._engine.tag_redraw()
            return
        job, self._job = self._job, None
        if job.error is not None:
            self._message = str(job.error)
        elif job.result is not None:
            self._texture = _texture(job.result.passes["Combined"])

    def _draw_texture(self, scene, width: int, height: int) -> None:
        import gpu  # does not work in background mode before 5.2
        from gpu_extras.presets import draw_texture_2d

        gpu.state.blend_set("ALPHA_PREMULT")
        self._engine.bind_display_space_shader(scene)
        draw_texture_2d(self._texture, (0, 0), width, height)
        self._engine.unbind_display_space_shader()
        gpu.state.blend_set("NONE")

    def _say(self) -> None:
        text = self._message or (self._job.text if self._job else "")
        self._engine.update_stats("Nonlinear Rays", text)

    def stop(self) -> None:
        """Cancel the picture that is under way; nobody waits for it."""
        if self._job is not None:
            self._job.cancel()
            self._job = None


def _texture(pixels: np.ndarray):
    """GPU texture of float32, (height, width, 4)."""
    import gpu

    height, width, _ = pixels.shape
    buffer = gpu.types.Buffer("FLOAT", width * height * 4, np.ascontiguousarray(pixels, np.float32).ravel())
    return gpu.types.GPUTexture((width, height), format="RGBA16F", data=buffer)

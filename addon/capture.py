"""The scene as it will be rendered, exported at once on the main thread.

Only a render has a depsgraph in render mode (visibility and modifiers for render; bpy has no call for one). So a small
render of a copy of the scene is started with our own engine, whose render() hands the depsgraph to the export and draws
nothing. A copy, because it has a Render Result of its own: the user's, and the user's settings, stay as they are.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator

import bpy

from .core.scene import Scene, SceneError
from .core.settings import LARGEST_SPEED, Settings
from .export import camera_problem, export_scene
from .model_properties import model_and_placement
from .properties import settings_from

ENGINE = "NONLINEAR_RAYS"
SMALLEST = 4  # pixels a side, Blender's minimum: what the copy's own Render Result costs

FrameSet = Callable[[int, float], None]  # frame, subframe: evaluates the render's depsgraph there

_waiting: list[Callable[[bpy.types.Depsgraph, FrameSet], None]] = []


def take(depsgraph: bpy.types.Depsgraph, frame_set: FrameSet) -> bool:
    """Called by the engine's render(): True where a capture was waiting for this depsgraph."""
    if not _waiting:
        return False
    _waiting.pop()(depsgraph, frame_set)
    return True


def picture_size(render: bpy.types.RenderSettings) -> tuple[int, int]:
    """Columns and rows of the whole picture."""
    percentage = render.resolution_percentage
    return render.resolution_x * percentage // 100, render.resolution_y * percentage // 100


def border_region(render: bpy.types.RenderSettings) -> tuple[int, int, int, int] | None:
    """(x0, y0, x1, y1), pixels, half open: the render border as Blender rounds it; None is the whole picture."""
    if not render.use_border:
        return None
    width, height = picture_size(render)
    return (
        int(render.border_min_x * width),
        int(render.border_min_y * height),
        int(render.border_max_x * width),
        int(render.border_max_y * height),
    )


def camera_velocity(depsgraph: bpy.types.Depsgraph, frame_set: FrameSet) -> tuple[float, float, float]:
    """Where the camera goes from the frame before to the one after, in units of the speed of light, world space.

    Raises SceneError where that is as fast as light.
    """
    scene = depsgraph.scene_eval
    frame, subframe = scene.frame_current, scene.frame_subframe
    places = []
    try:
        for other in (frame - 1, frame + 1):
            frame_set(other, subframe)
            places.append(depsgraph.scene_eval.camera.evaluated_get(depsgraph).matrix_world.translation.copy())
    finally:
        frame_set(frame, subframe)
    scene = depsgraph.scene_eval
    chosen = scene.nonlinear_rays
    seconds = 2.0 * scene.render.fps_base / scene.render.fps
    velocity = (places[1] - places[0]) / (seconds * chosen.scale * chosen.speed_of_light)
    if velocity.length > LARGEST_SPEED:
        raise SceneError(
            f"The camera moves with {velocity.length:g} times the speed of light in frame {frame}. "
            "Raise Speed of Light in the Nonlinear Rays panel, or animate the camera slower."
        )
    return tuple(velocity)


def export(
    depsgraph: bpy.types.Depsgraph,
    size: tuple[int, int] | None = None,
    region: tuple[int, int, int, int] | None = None,
    frame_set: FrameSet | None = None,
) -> tuple[Scene, Settings]:
    """What core.trace.render takes. size, region : of the picture; by default the scene's own, without its border.
    frame_set : the engine's; without it the observer's velocity is the typed one.

    Raises SceneError, SettingsError, ParameterError.
    """
    scene = depsgraph.scene_eval
    if problem := camera_problem(scene.camera):
        raise SceneError(problem)
    if scene.nonlinear_rays.scale <= 0.0:
        raise SceneError("The model's scale is zero. Set Scale in the Nonlinear Rays panel above zero.")
    velocity = None
    chosen = scene.nonlinear_rays
    if chosen.observer == "moving" and chosen.velocity_from_camera and frame_set is not None:
        velocity = camera_velocity(depsgraph, frame_set)
        scene = depsgraph.scene_eval
    width, height = size or picture_size(scene.render)
    model, placement = model_and_placement(scene, depsgraph)
    exported = export_scene(depsgraph, model=model, placement=placement, width=width, height=height, region=region)
    return exported, settings_from(scene, exported.camera, velocity)


@contextlib.contextmanager
def _small_copy(scene: bpy.types.Scene) -> Iterator[bpy.types.Scene]:
    """A copy with the same objects that renders a few pixels with our engine; removed on the way out."""
    copy = scene.copy()
    try:
        render = copy.render
        render.engine = ENGINE
        render.resolution_x = render.resolution_y = SMALLEST
        render.resolution_percentage = 100
        render.use_border = render.use_compositing = render.use_sequencer = render.use_freestyle = False
        render.use_multiview = False
        yield copy
    finally:
        bpy.data.scenes.remove(copy)


def capture(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> tuple[Scene, Settings]:
    """Export the scene's current frame as F12 would see it. Main thread only.

    Raises SceneError, SettingsError, ParameterError.
    """
    if problem := camera_problem(scene.camera):
        raise SceneError(problem)
    if bpy.app.is_job_running("RENDER"):
        raise SceneError("Blender is rendering already. Wait for it, or press Esc in its window.")
    size, region = picture_size(scene.render), border_region(scene.render)
    outcome: list = []

    def receive(depsgraph: bpy.types.Depsgraph, frame_set: FrameSet) -> None:
        try:
            outcome.append(export(depsgraph, size, region, frame_set))
        except Exception as error:  # raised again below, outside Blender's render
            outcome.append(error.with_traceback(None))

    for obj in scene.objects:
        if obj.mode == "EDIT":
            obj.update_from_editmode()
    with _small_copy(scene) as copy:
        _waiting.append(receive)
        try:
            bpy.ops.render.render(scene=copy.name, layer=view_layer.name)
        except RuntimeError as error:
            raise SceneError(f"Blender cannot evaluate the scene for rendering: {str(error).strip()}") from error
        finally:
            _waiting.clear()
    if not outcome:
        raise SceneError(
            f"Blender did not evaluate view layer '{view_layer.name}' for rendering. "
            "Enable View Layer > Use for Rendering."
        )
    if isinstance(outcome[0], Exception):
        raise outcome[0]
    return outcome[0]

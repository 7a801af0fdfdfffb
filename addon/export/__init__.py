"""Blender -> core.scene: one evaluated frame as plain arrays, one concern a file."""

from __future__ import annotations

import bpy

from ..core.models import Model
from ..core.scene import Camera, Placement, Scene
from .bake_world import bake_world
from .camera import camera_problem, export_camera
from .geometry import Geometry
from .images import ImageTable
from .lights import export_light
from .materials import MaterialTable
from .problems import find_problems
from .spheres import SphereCollector, is_sphere
from .world import export_world

__all__ = ["bake_world", "camera_problem", "export_scene", "find_problems"]


def export_scene(
    depsgraph: bpy.types.Depsgraph,
    *,
    model: Model,
    placement: Placement,
    width: int | None = None,
    height: int | None = None,
    region: tuple[int, int, int, int] | None = None,
    camera: bpy.types.Object | Camera | None = None,
) -> Scene:
    """Everything that `core` needs to render the frame that depsgraph is evaluated for.

    depsgraph : in render mode where the caller has one; with a viewport's, what is hidden there is left out as well
    width, height : pixels of the whole picture; by default the scene's resolution times its percentage
    region : (x0, y0, x1, y1), pixels, half open; None is the whole picture
    camera : by default the scene's; one that is exported already, such as a viewport's, is taken as it is
    Raises SceneError, naming the object and the next step, where nothing sensible can be rendered.
    What can be survived is in the scene's `warnings`.
    """
    scene = depsgraph.scene_eval
    render = scene.render
    width = render.resolution_x * render.resolution_percentage // 100 if width is None else width
    height = render.resolution_y * render.resolution_percentage // 100 if height is None else height
    if isinstance(camera, Camera):
        seen, camera_warnings = camera, []
    else:
        camera = camera if camera is not None else scene.camera
        if camera is not None:
            camera = camera.evaluated_get(depsgraph)
        seen, camera_warnings = export_camera(camera, render, width, height, region)

    images = ImageTable()
    materials = MaterialTable(images)
    geometry = Geometry(materials)
    spheres = SphereCollector(materials)
    lights, light_warnings = [], []
    for instance in depsgraph.object_instances:
        obj = instance.object
        if not instance.show_self or obj.hide_render:
            continue
        if obj.type == "LIGHT":
            light, said = export_light(obj, instance.matrix_world)
            lights += [light] if light is not None else []
            light_warnings += said
        elif seen_by_camera(instance, depsgraph.view_layer):
            if is_sphere(obj) and (is_geometry(obj) or obj.type == "EMPTY"):
                spheres.add(instance)
            elif is_geometry(obj):
                geometry.add(instance)

    environment, world_warnings = export_world(scene.world)
    far_world = scene.nonlinear_rays.far_world if model.has_far_side else None
    far_environment = None
    if far_world is not None:
        far_environment, said = export_world(far_world)
        world_warnings = world_warnings + said
    triangles = geometry.triangles()
    warnings = camera_warnings + materials.warnings + geometry.warnings + light_warnings + world_warnings
    return Scene(
        camera=seen,
        model=model,
        placement=placement,
        triangles=triangles,
        spheres=spheres.spheres(),
        materials=materials.materials,
        images=tuple(images.images),
        lights=tuple(lights),
        environment=environment,
        far_environment=far_environment,
        ambient=environment.color,
        warnings=tuple(dict.fromkeys(warnings)),
    )


def is_geometry(obj: bpy.types.Object) -> bool:
    """Whether an instance's object brings triangles of its own.

    Curves, surfaces, texts and metaballs come a second time, as an instance with their evaluated Mesh.
    """
    return isinstance(obj.data, bpy.types.Mesh)


def seen_by_camera(instance: bpy.types.DepsgraphObjectInstance, view_layer: bpy.types.ViewLayer) -> bool:
    """Ray visibility to the camera, of the object and of what instances it; not in an "Indirect Only" collection."""
    if not instance.object.visible_camera or (instance.parent is not None and not instance.parent.visible_camera):
        return False
    original = instance.parent.original if instance.parent is not None else instance.object.original
    return not original.indirect_only_get(view_layer=view_layer)

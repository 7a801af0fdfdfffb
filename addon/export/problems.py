"""What can be said about a scene before the press: cheap enough for a panel's draw, and the exporter's own words."""

from __future__ import annotations

import bpy
import numpy as np

from .camera import camera_problem
from .images import ImageTable
from .materials import MaterialTable
from .spheres import is_sphere, sphere_problem
from .world import world_problem


def find_problems(context_or_scene: bpy.types.Context | bpy.types.Scene) -> list[str]:
    """Sentences, the gravest first. Looks at the original data: nothing is evaluated and no pixel is read.

    What only an instance, a modifier or the pixels would show is said by the export's own warnings.
    """
    scene = getattr(context_or_scene, "scene", context_or_scene)
    problems = [camera_problem(scene.camera)]
    materials = MaterialTable(ImageTable(read_pixels=False))
    for obj in scene.objects:
        if obj.hide_render:
            continue
        if is_sphere(obj):
            problems.append(sphere_problem(obj.name, np.array(obj.matrix_world, np.float64)))
        for slot in obj.material_slots:
            if slot.material is not None:
                materials.index(slot.material)
    problems += materials.warnings + world_problem(scene.world)
    return list(dict.fromkeys(problem for problem in problems if problem))

"""Objects marked "Analytic Sphere" -> spheres: an object's local unit sphere, placed by its evaluated matrix."""

from __future__ import annotations

import bpy
import numpy as np

from ..core.scene import SceneError, Spheres
from .materials import MaterialTable

EVEN = 1e-4  # relative difference of the scales, and cosine between the axes, that still counts as a sphere


def is_sphere(obj: bpy.types.Object) -> bool:
    """Whether the object is marked; False where the extension's properties are not registered."""
    # From the original: ticking the box does not make Blender evaluate the object anew.
    return bool(getattr(getattr(obj.original, "nonlinear_rays", None), "analytic_sphere", False))


def sphere_problem(name: str, world_from_local: np.ndarray) -> str | None:
    """Why the matrix, (4, 4), does not make a sphere of the unit sphere; None where it does."""
    axes = np.asarray(world_from_local, np.float64)[:3, :3].T
    scales = np.linalg.norm(axes, axis=1)
    advice = "or clear Analytic Sphere."
    if not np.isfinite(world_from_local).all():
        return f"'{name}': an analytic sphere needs a finite transform. Clear its constraints and drivers, {advice}"
    if scales.min() == 0.0:
        return f"'{name}': an analytic sphere needs a scale, but has ({_listed(scales)}). Enlarge it, {advice}"
    if scales.max() - scales.min() > EVEN * scales.max():
        return (
            f"'{name}': an analytic sphere needs one scale for all axes, but has ({_listed(scales)}). "
            f"Apply or even out the scale, {advice}"
        )
    cosines = (axes @ axes.T)[[0, 0, 1], [1, 2, 2]] / scales.max() ** 2
    if np.abs(cosines).max() > EVEN:
        angle = np.degrees(np.arccos(cosines[np.abs(cosines).argmax()]))
        return (
            f"'{name}': an analytic sphere needs axes at right angles, but two stand at {angle:.4g} degrees (shear). "
            f"Even out its parents' scale, {advice}"
        )
    return None


class SphereCollector:
    """Collects the marked instances of an export: add() each, then spheres()."""

    def __init__(self, materials: MaterialTable):
        self.materials = materials
        self._rows: list[tuple] = []

    def add(self, instance: bpy.types.DepsgraphObjectInstance) -> None:
        """Raises SceneError, naming the object, where it is not a sphere."""
        obj = instance.object
        matrix = np.array(instance.matrix_world, np.float64)
        problem = sphere_problem(obj.name, matrix)
        if problem:
            raise SceneError(problem)
        columns = matrix[:3, :3]
        scales = np.linalg.norm(columns, axis=0)
        slots = obj.material_slots
        material = self.materials.index(slots[0].material if len(slots) else None)
        # Mirrored axes stay mirrored: the texture is seen in the mirror, as on the mesh.
        self._rows.append((matrix[:3, 3], scales.mean(), (columns / scales).T, material, obj.pass_index))

    def spheres(self) -> Spheres:
        if not self._rows:
            return Spheres.empty()
        dtypes = (np.float64, np.float64, np.float64, np.int32, np.int32)
        return Spheres(
            *(np.array(column, dtype) for column, dtype in zip(zip(*self._rows, strict=True), dtypes, strict=True))
        )


def _listed(scales: np.ndarray) -> str:
    return ", ".join(f"{scale:g}" for scale in scales)

"""Evaluated meshes -> triangles: each mesh is read once, in bulk, and carried into the world once an instance."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass

import bpy
import numpy as np

from ..core.scene import Triangles
from ..core.strips import in_strips
from .materials import MaterialTable

NO_AREA = 1e-12  # twice a triangle's area over its longest side squared, below which float64 is rounding


@dataclass(frozen=True, eq=False)
class LocalMesh:
    """The triangles of one evaluated mesh in its own space.

    positions : float32, (n, 3, 3), metres;  normals : float32, (n, 3, 3), unit;  uvs : float32, (n, 3, 2)
    slot      : int32, (n,), the material slot
    vertices  : how many it has, for the mesh without faces
    uv_map    : the name of the render-active map, whose uvs these are, and all maps' names
    lost_uvs  : how many of them were not numbers, and became 0
    """

    positions: np.ndarray
    normals: np.ndarray
    uvs: np.ndarray
    slot: np.ndarray
    vertices: int
    uv_map: str = ""
    uv_maps: frozenset[str] = frozenset()
    lost_uvs: int = 0


class Geometry:
    """Collects the instances of an export: add() each, then triangles()."""

    def __init__(self, materials: MaterialTable):
        self.materials = materials
        self._meshes: dict[int, LocalMesh] = {}
        self._parts: list[Triangles] = []
        self._total: Counter[str] = Counter()
        self._not_finite: Counter[str] = Counter()
        self._no_area: Counter[str] = Counter()
        self._warnings: dict[str, None] = {}

    def add(self, instance: bpy.types.DepsgraphObjectInstance) -> None:
        """One mesh-like instance. Nothing of the instance is kept: Blender reuses it for the next one."""
        obj = instance.object
        mesh = self._mesh(obj)
        if not len(mesh.slot):
            if obj.original.type == "MESH" and mesh.vertices:
                self._warnings[f"'{obj.name}' has vertices but no faces, and is not shown."] = None
            return
        if mesh.lost_uvs:
            text = f"'{obj.name}': {mesh.lost_uvs} UVs of '{mesh.uv_map}' are not numbers and count as 0"
            self._warnings[f"{text}. Unwrap it again."] = None
        # Slots past the last one show the last one's material, as in Cycles.
        slots = [slot.material for slot in obj.material_slots] or [None]
        used = np.clip(mesh.slot, 0, len(slots) - 1)
        table = np.zeros(len(slots), np.int32)
        for slot in np.flatnonzero(np.bincount(used)):
            table[slot] = self.materials.index(slots[slot])
            self._check_uv_maps(obj.name, mesh, table[slot])
        part, not_finite, no_area = place(
            mesh, np.array(instance.matrix_world, np.float64), table[used], obj.pass_index
        )
        self._total[obj.name] += len(mesh.slot)
        self._not_finite[obj.name] += not_finite
        self._no_area[obj.name] += no_area
        self._parts.append(part)

    def triangles(self) -> Triangles:
        if not self._parts:
            return Triangles.empty()
        if len(self._parts) == 1:
            return self._parts[0]
        names = ("positions", "normals", "uvs", "material_index", "object_index")
        return Triangles(*(np.concatenate([getattr(part, name) for part in self._parts]) for name in names))

    @property
    def warnings(self) -> list[str]:
        counted = [
            f"'{name}': {count} of {self._total[name]} triangles {fault} and were skipped."
            for fault, counts in (
                ("have corners that are not finite", self._not_finite),
                ("have no area", self._no_area),
            )
            for name, count in counts.items()
            if count
        ]
        return list(self._warnings) + counted

    def _mesh(self, obj: bpy.types.Object) -> LocalMesh:
        key = obj.data.as_pointer()  # evaluated meshes live as long as the depsgraph
        if key not in self._meshes:
            mesh = obj.to_mesh()
            try:
                self._meshes[key] = read_mesh(mesh)
            finally:
                obj.to_mesh_clear()
        return self._meshes[key]

    def _check_uv_maps(self, name: str, mesh: LocalMesh, material: int) -> None:
        reading = self.materials.readings[material]
        for asked in reading.uv_maps & (mesh.uv_maps - {mesh.uv_map}):
            text = f"'{name}': material '{reading.material.name}' asks for the UV map '{asked}'"
            self._warnings[f"{text}, but the one for rendering, '{mesh.uv_map}', is used."] = None


def read_mesh(mesh: bpy.types.Mesh) -> LocalMesh:
    """Bulk reads only: the time does not depend on Python's speed. Attributes come as they lie in memory, which is a
    hundred times faster than the same values from `vertices`, `loops` and `loop_triangles`.
    """
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    if len(mesh.loops) == len(mesh.polygons) * 3:  # of triangles, which are their own triangulation
        corners = np.arange(3 * count)
    else:
        corners = _read(mesh.loop_triangles, "loops", np.int32, 3 * count)
    positions = _attribute(mesh, "position", "vector", np.float32, len(mesh.vertices), 3)
    vertex_of_corner = _attribute(mesh, ".corner_vert", "value", np.int32, len(mesh.loops))
    normals = _read(mesh.corner_normals, "vector", np.float32, 3 * len(mesh.loops)).reshape(-1, 3)
    slot = np.zeros(count, np.int32)
    if "material_index" in mesh.attributes:
        of_face = _attribute(mesh, "material_index", "value", np.int32, len(mesh.polygons))
        slot = of_face[_read(mesh.loop_triangle_polygons, "value", np.int32, count)]
    layer = next((layer for layer in mesh.uv_layers if layer.active_render), None)
    uvs, lost = np.zeros((3 * count, 2), np.float32), 0
    if layer is not None and count:
        uvs_of_corner = _read(layer.uv, "vector", np.float32, 2 * len(mesh.loops)).reshape(-1, 2)
        bad = ~np.isfinite(uvs_of_corner).all(axis=1)
        uvs_of_corner[bad] = 0.0
        uvs, lost = uvs_of_corner[corners], int(bad.sum())
    return LocalMesh(
        positions[vertex_of_corner[corners]].reshape(count, 3, 3),
        normals[corners].reshape(count, 3, 3),
        uvs.reshape(count, 3, 2),
        slot,
        len(mesh.vertices),
        layer.name if layer is not None else "",
        frozenset(layer.name for layer in mesh.uv_layers),
        lost,
    )


def place(
    mesh: LocalMesh, world_from_local: np.ndarray, material_index: np.ndarray, object_index: int
) -> tuple[Triangles, int, int]:
    """A mesh's triangles in world space, and how many were skipped: not finite, and of no area.

    world_from_local : float64, (4, 4);  material_index : int32, (n,), into Scene.materials
    A mirroring matrix swaps two corners, so that a triangle's winding keeps agreeing with its normals.
    """
    linear, shift = world_from_local[:3, :3], world_from_local[:3, 3]
    # The matrix of cofactors is the inverse transpose times the determinant, and exists where the inverse does not.
    columns = linear.T
    cofactors = np.cross(columns[[1, 2, 0]], columns[[2, 0, 1]]).T
    mirrored = float(columns[0] @ cofactors[:, 0]) < 0.0
    sign = -1.0 if mirrored else 1.0
    order = [0, 2, 1] if mirrored else [0, 1, 2]
    n = len(mesh.slot)
    positions, normals = np.empty((n, 3, 3)), np.empty((n, 3, 3), np.float32)
    finite, good = np.empty(n, bool), np.empty(n, bool)

    def place_strip(rows: slice) -> None:
        """Works on (corner, axis, triangle): one product for each corner of all triangles."""
        with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
            corners = mesh.positions[rows].transpose(1, 2, 0).astype(np.float64, order="C")
            # The sides are taken before the shift: far from the origin it would eat their last digits.
            sides = linear @ (corners[[1, 2, 2]] - corners[[0, 0, 1]])
            facing = sign * np.cross(sides[0], sides[1], axis=0)
            twice_area = np.sqrt((facing**2).sum(axis=0))
            longest = (sides**2).sum(axis=1).max(axis=0)
            placed = linear @ corners + shift[:, None]
            finite[rows] = np.isfinite(placed).all(axis=(0, 1)) & np.isfinite(longest)
            good[rows] = finite[rows] & (twice_area > NO_AREA * longest)
            positions[rows] = placed[order].transpose(2, 0, 1)

            turned = sign * cofactors @ mesh.normals[rows].transpose(1, 2, 0)
            length = np.sqrt((turned**2).sum(axis=1, keepdims=True))
            # A corner normal may be zero or not finite where a neighbouring face is bad: the face's own serves.
            unit = np.where(np.isfinite(length) & (length > 0), turned / length, facing / twice_area)
            normals[rows] = unit[order].transpose(2, 0, 1)

    in_strips(place_strip, n)
    kept = slice(None) if good.all() else good
    uvs = mesh.uvs[:, order] if mirrored else mesh.uvs
    count = int(good.sum())
    triangles = Triangles(
        positions[kept], normals[kept], uvs[kept], material_index[kept], np.full(count, object_index, np.int32)
    )
    return triangles, int((~finite).sum()), int((finite & ~good).sum())


def _read(collection, attribute: str, dtype: type, length: int) -> np.ndarray:
    values = np.empty(length, dtype)
    collection.foreach_get(attribute, values)
    return values


def _attribute(mesh: bpy.types.Mesh, name: str, member: str, dtype: type, *shape: int) -> np.ndarray:
    """A mesh without the elements has no such attribute."""
    if name not in mesh.attributes:
        return np.zeros(shape, dtype)
    return _read(mesh.attributes[name].data, member, dtype, math.prod(shape)).reshape(shape)

"""A volume's density -> voxels in the model's own space.

Python is not given a volume's voxels, but Geometry Nodes are. So the volume, as it is evaluated for the render, is
written to a temporary OpenVDB file; a temporary object reads it with the node Sample Grid at the points of a lattice,
and its evaluated mesh is read. Nothing of it stays in the file. Data-blocks are made on the main thread only: F12's
thread asks it to and waits, and a viewport, which may not make any while it draws, gets the voxels a moment later.
"""

from __future__ import annotations

import contextlib
import hashlib
import itertools
import tempfile
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeout
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, TypeVar

import bpy
import numpy as np

from ..core.scene import Placement, SceneError

T = TypeVar("T")

LARGEST_BATCH = 1 << 20  # points sampled at a time, which bounds what the temporary mesh costs
MAIN_THREAD_SECONDS = 60.0
FILE_HEADER = 57  # bytes of an OpenVDB file up to and with its random identifier
DENSITY, BOX_MIN, BOX_MAX = "density", "box_min", "box_max"  # attributes of the temporary mesh


class Voxels(NamedTuple):
    """density : float32, (nz, ny, nx), at the centres of the cells of the box low to high, (3,), model lengths."""

    density: np.ndarray
    low: np.ndarray
    high: np.ndarray


@dataclass(frozen=True, eq=False)
class Request:
    """What is to be sampled.

    object_from_model : float64, (4, 4);  resolution : cells along the longest side
    margin : float64, (3,), object space, by which Blender's bounding box of the grid is too small on each side
    """

    path: Path
    object_name: str
    grid: str
    resolution: int
    object_from_model: np.ndarray
    margin: np.ndarray

    @property
    def key(self) -> tuple:
        """The same for the same voxels: of the file all but its random identifier."""
        digest = hashlib.blake2b()
        with open(self.path, "rb") as file:
            file.seek(FILE_HEADER)
            while block := file.read(1 << 20):
                digest.update(block)
        return digest.digest(), self.object_name, self.grid, self.resolution, self.object_from_model.tobytes()


_last: tuple[tuple, Voxels | SceneError] | None = None  # key and outcome of the last sampling


def volume_problem() -> str | None:
    """Why this Blender cannot read volumes; None where it can."""
    if bpy.app.build_options.openvdb:
        return None
    return "This Blender is built without OpenVDB and cannot read volumes. Use blender.org's, or choose another medium."


def hidden(obj: bpy.types.Object) -> str:
    return (
        f"'{obj.name}' is hidden, or not in the view layer, and Blender does not evaluate its volume. "
        "Show it; volumes are not in the picture anyway."
    )


def sample_volume(
    obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph, placement: Placement, grid: str, resolution: int
) -> Voxels:
    """The grid of that name on cubic cells over its bounding box, trilinear between its own voxels.

    obj : evaluated in depsgraph; a volume, or any object whose Geometry Nodes make one
    resolution : cells along the longest side of the box
    Raises SceneError.
    """
    if problem := volume_problem():
        raise SceneError(problem)
    with contextlib.ExitStack() as stack:
        path = Path(stack.enter_context(_folder()), "volume.vdb")
        object_from_index = write_grids(obj, grid, path)
        # Before 5.2 the box ends at the outermost voxels' centres.
        margin = 0.5 * np.abs(object_from_index[:3, :3]).sum(axis=1) * (bpy.app.version < (5, 2))
        request = Request(path, obj.name, grid, resolution, object_from_model(obj, placement), margin)
        key = request.key
        outcome = _kept(key)
        if outcome is None:
            if depsgraph.mode == "VIEWPORT" and not bpy.app.background:
                _sample_later(request, key, stack.pop_all())
                raise SceneError(f"Reading the voxels of '{obj.name}'")
            outcome = on_main_thread(lambda: _sample_and_keep(request, key))
    if isinstance(outcome, SceneError):
        raise outcome
    return outcome


def _folder() -> tempfile.TemporaryDirectory:
    return tempfile.TemporaryDirectory(prefix="nonlinear-rays-", ignore_cleanup_errors=True)


def _kept(key: tuple) -> Voxels | SceneError | None:
    last = _last  # another thread may put the next one there
    return last[1] if last is not None and last[0] == key else None


def _sample_and_keep(request: Request, key: tuple) -> Voxels | SceneError:
    global _last
    try:
        outcome = sample(request)
    except SceneError as error:
        outcome = error
    _last = key, outcome
    return outcome


def _sample_later(request: Request, key: tuple, files: contextlib.ExitStack) -> None:
    """When Blender is not drawing; then the viewports are drawn again."""

    def run() -> None:
        with files:
            if _kept(key) is None:
                _sample_and_keep(request, key)
        if request.object_name in bpy.data.objects:
            bpy.data.objects[request.object_name].update_tag()

    bpy.app.timers.register(run)


def write_grids(obj: bpy.types.Object, grid: str, path: Path) -> np.ndarray:
    """The evaluated volume as an OpenVDB file; the value is the grid's object_from_index : float64, (4, 4).

    Raises SceneError where the volume has no such grid of numbers.
    """
    try:
        geometry = obj.evaluated_geometry()  # has to outlive the volume it gives
    except TypeError:
        raise SceneError(hidden(obj)) from None
    volume = geometry.volume
    if volume is None:
        raise SceneError(f"'{obj.name}' has no volume. Give it a modifier that makes one, or choose another object.")
    grids = volume.grids
    if not grids.load() or grids.error_message:
        raise SceneError(f"'{obj.name}': the volume cannot be read: {grids.error_message}. Mend its file path.")
    kinds = {item.name: item.data_type for item in grids}
    if grid not in kinds:
        has = f"It has: {', '.join(sorted(kinds))}." if kinds else "It has none."
        raise SceneError(f"'{obj.name}' has no grid '{grid}'. {has} Set Grid in the Nonlinear Rays panel.")
    if kinds[grid] != "FLOAT":
        raise SceneError(
            f"'{obj.name}': grid '{grid}' holds {kinds[grid]}, not FLOAT. Set Grid to one that holds a density."
        )
    if not grids.save(str(path)):
        raise SceneError(f"'{obj.name}': its volume cannot be written to '{path.parent}'. Make room there.")
    return np.array(grids[grid].matrix_object, np.float64)


def object_from_model(obj: bpy.types.Object, placement: Placement) -> np.ndarray:
    """float64, (4, 4): model lengths in the model's space -> the object's own space. Raises SceneError."""
    world_from_model = np.eye(4)
    world_from_model[:3, :3] = placement.scale * placement.rotation
    world_from_model[:3, 3] = placement.position
    try:
        return np.linalg.solve(np.array(obj.matrix_world, np.float64), world_from_model)
    except np.linalg.LinAlgError:
        raise SceneError(f"'{obj.name}' has a scale of zero. Set its scale above zero.") from None


def transformed(matrix: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(4, 4) times (n, 3)."""
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def sample(request: Request) -> Voxels:
    """Main thread only. Raises SceneError."""
    with _sampler(request) as sampled:
        corners = np.concatenate(sampled(np.zeros((1, 3)), BOX_MIN, BOX_MAX)).astype(np.float64)
        if not (corners[0] < corners[1]).all():
            raise SceneError(f"'{request.object_name}': grid '{request.grid}' is empty. Fill it, or choose another.")
        corners += np.outer([-1.0, 1.0], request.margin)
        boxed = np.array(list(itertools.product(*corners.T)))
        boxed = transformed(np.linalg.inv(request.object_from_model), boxed)
        low, high, size = cells(boxed.min(axis=0), boxed.max(axis=0), request.resolution)
        nx, ny, nz = size
        density = np.empty((nz, ny, nx), np.float32)
        batch = max(LARGEST_BATCH // (nx * ny), 1)
        for first in range(0, nz, batch):
            layers = np.arange(first, min(first + batch, nz))
            points = transformed(request.object_from_model, lattice(low, high, size, layers))
            (values,) = sampled(points, DENSITY)
            density[layers] = values.reshape(-1, ny, nx)
    return Voxels(density, low, high)


def cells(low: np.ndarray, high: np.ndarray, resolution: int) -> tuple[np.ndarray, np.ndarray, tuple[int, int, int]]:
    """The box, widened about its middle to whole cubic cells; and how many, (nx, ny, nz)."""
    cell = (high - low).max() / resolution
    size = np.clip(np.ceil((high - low) / cell - 1e-6).astype(int), 1, resolution)
    middle, half = 0.5 * (low + high), 0.5 * size * cell
    return middle - half, middle + half, tuple(int(count) for count in size)


def lattice(low: np.ndarray, high: np.ndarray, size: tuple[int, int, int], layers: np.ndarray) -> np.ndarray:
    """The centres of the cells in these layers of z : float64, (len(layers) ny nx, 3), x fastest."""
    cell = (high - low) / size
    z, y, x = np.meshgrid(layers, np.arange(size[1]), np.arange(size[0]), indexing="ij")
    return low + (np.stack([x, y, z], axis=-1).reshape(-1, 3) + 0.5) * cell


# Blender's part


@contextlib.contextmanager
def _sampler(request: Request) -> Iterator[Callable[..., list[np.ndarray]]]:
    """sampled(points, *names), points : (n, 3), object space -> the mesh's attributes of these names, float32."""
    made = []

    def keep(item: bpy.types.ID) -> bpy.types.ID:
        made.append(item)
        return item

    try:
        volume = keep(bpy.data.volumes.new("Nonlinear Rays volume"))
        volume.filepath = str(request.path)
        source = keep(bpy.data.objects.new(volume.name, volume))
        nodes = keep(bpy.data.node_groups.new("Nonlinear Rays sampler", "GeometryNodeTree"))
        build_nodes(nodes, source, request.grid)
        mesh = keep(bpy.data.meshes.new("Nonlinear Rays lattice"))
        points_object = keep(bpy.data.objects.new(mesh.name, mesh))
        points_object.modifiers.new("Sample", "NODES").node_group = nodes
        scene = keep(bpy.data.scenes.new("Nonlinear Rays sampling"))
        scene.collection.objects.link(points_object)
        layer = scene.view_layers[0]

        def sampled(points: np.ndarray, *names: str) -> list[np.ndarray]:
            mesh.clear_geometry()
            mesh.vertices.add(len(points))
            mesh.vertices.foreach_set("co", np.ascontiguousarray(points, np.float32).ravel())
            mesh.update()
            layer.update()
            attributes = points_object.evaluated_get(layer.depsgraph).data.attributes
            return [_read(attributes[name]) for name in names]

        yield sampled
    finally:
        bpy.data.batch_remove(reversed(made))


def build_nodes(tree: bpy.types.GeometryNodeTree, source: bpy.types.Object, grid: str) -> None:
    """Mesh -> the same with the grid's value at each vertex, and the grid's bounding box, as attributes."""
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")

    def node(kind: str) -> bpy.types.Node:
        return tree.nodes.new(kind)

    info, named = node("GeometryNodeObjectInfo"), node("GeometryNodeGetNamedGrid")
    info.inputs["Object"].default_value = source
    named.inputs["Name"].default_value = grid
    tree.links.new(info.outputs["Geometry"], named.inputs["Volume"])

    values = node("GeometryNodeSampleGrid")
    tree.links.new(named.outputs["Grid"], values.inputs["Grid"])

    alone, box = node("GeometryNodeStoreNamedGrid"), node("GeometryNodeBoundBox")
    alone.inputs["Name"].default_value = grid
    tree.links.new(named.outputs["Grid"], alone.inputs["Grid"])
    tree.links.new(alone.outputs["Volume"], box.inputs["Geometry"])

    geometry = node("NodeGroupInput").outputs["Geometry"]
    for name, kind, value in (
        (DENSITY, "FLOAT", values.outputs["Value"]),
        (BOX_MIN, "FLOAT_VECTOR", box.outputs["Min"]),
        (BOX_MAX, "FLOAT_VECTOR", box.outputs["Max"]),
    ):
        store = node("GeometryNodeStoreNamedAttribute")
        store.data_type = kind
        store.inputs["Name"].default_value = name
        tree.links.new(geometry, store.inputs["Geometry"])
        tree.links.new(value, next(item for item in store.inputs if item.name == "Value" and item.enabled))
        geometry = store.outputs["Geometry"]
    tree.links.new(geometry, node("NodeGroupOutput").inputs["Geometry"])


def _read(attribute: bpy.types.Attribute) -> np.ndarray:
    """A float attribute : float32, (n,);  a vector attribute : (n, 3)."""
    vector = attribute.data_type == "FLOAT_VECTOR"
    values = np.empty(len(attribute.data) * (3 if vector else 1), np.float32)
    attribute.data.foreach_get("vector" if vector else "value", values)
    return values.reshape(-1, 3) if vector else values


# Threads


def on_main_thread(call: Callable[[], T]) -> T:
    """call() on Blender's main thread, waited for; what it raises is raised here."""
    if threading.current_thread() is threading.main_thread():
        return call()
    asked: Future = Future()

    def run() -> None:
        if asked.set_running_or_notify_cancel():
            try:
                asked.set_result(call())
            except BaseException as error:  # raised again in the thread that waits
                asked.set_exception(error)

    bpy.app.timers.register(run)
    try:
        return asked.result(MAIN_THREAD_SECONDS)
    except FutureTimeout:
        if not asked.cancel():
            return asked.result()  # it has begun: it will end
        raise SceneError(
            f"Blender did not answer for {MAIN_THREAD_SECONDS:g} seconds, so the volume was not read. Render again."
        ) from None

"""Scene -> named arrays, and the texel layout that shaders/ reads.

Every array is a long row of RGBA texels folded into TEXELS_PER_ROW columns (common/texels.glsl unfolds it). Positions
go into model space in float64 and become float32 only there, so that a scene far from the world's origin keeps its
digits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np

from . import bvh, empty_space
from .empty_space import EmptySpace
from .scene import EXTENSIONS, INTERPOLATIONS, LIGHT_KINDS, Light, Scene, Spheres
from .strips import in_strips

TEXELS_PER_ROW = 2048  # common/texels.glsl
GROUP_SIZE = 16  # intersection/triangles.glsl
LARGEST_HALF = 65504.0  # images become half floats on the GPU
STRIP = 1 << 15  # texels of an image that are halved at a time: as many as a processor's cache holds
SMALLEST_LENGTH, LARGEST_LENGTH = 1e-15, 1e15  # model lengths; float32 holds their squares with room for products


@dataclass(frozen=True, eq=False)
class Packed:
    """arrays : uniform name -> float32, (rows, TEXELS_PER_ROW, 4); the tree's is uint32; u_empty_space is uint8 and a
        volume, (nz, ny, nx, 1)
    bounds_radius : of all objects around the model's centre, model lengths
    empty_space : among the objects, where there is a tree and rays are curved
    leaf_size : the usual diagonal of the tree's leaves, model lengths
    """

    arrays: dict[str, np.ndarray]
    triangle_count: int
    sphere_count: int
    light_count: int
    bounds_radius: float
    warnings: tuple[str, ...] = ()
    empty_space: EmptySpace | None = None
    leaf_size: float = 0.0

    @property
    def bytes(self) -> int:
        return sum(array.nbytes for array in self.arrays.values())


def folded(texels: np.ndarray) -> np.ndarray:
    """(n, 4) -> the same kind, (rows, TEXELS_PER_ROW, 4), filled up with zeros."""
    rows = max(1, math.ceil(len(texels) / TEXELS_PER_ROW))
    out = np.zeros((rows * TEXELS_PER_ROW, 4), texels.dtype)
    out[: len(texels)] = texels
    return out.reshape(rows, TEXELS_PER_ROW, 4)


def pack(scene: Scene, *, groups: bool = True, tree: bool = False, mipmaps: bool = False) -> Packed:
    """Everything of the scene that its shaders read, and nothing else.

    groups : bound every GROUP_SIZE triangles, which are sorted in space, by a sphere
    tree : bound everything by a tree of boxes instead, and sort it as the tree's leaves count
    mipmaps : with coarser levels of the images, a third more of their bytes
    """
    triangles = triangle_texels(scene)
    spheres, sphere_warnings = _usable_spheres(scene)
    arrays: dict[str, np.ndarray] = {}
    radius, space, leaf_size = triangles.radius, None, 0.0
    rows = np.flatnonzero(triangles.usable)
    if tree and (len(rows) or len(spheres)):
        boxes = triangles.boxes[rows], sphere_boxes(spheres, scene)
        grown = bvh.build(*boxes)
        arrays["u_tree"], leaf_size = folded(grown.nodes.reshape(-1, 4)), grown.leaf_size
        if scene.model.curved:
            space = empty_space.build(np.concatenate(boxes))
            arrays["u_empty_space"] = space.clear[..., None]
        rows, spheres = rows[grown.triangles], rows_of(spheres, grown.spheres)
    elif len(rows):
        corners = scene.placement.points_to_model(scene.triangles.positions[rows])
        order = spatial_order(corners.mean(axis=1))  # without groups, too: it decides between coincident triangles
        if groups:
            arrays["u_triangle_groups"] = folded(group_spheres(corners[order]))
        rows = rows[order]
    if len(rows):
        arrays["u_triangles"] = folded_rows(triangles.shape, rows)
        arrays["u_corners"] = folded_rows(triangles.surface, rows)
    if len(spheres):
        arrays["u_spheres"], reach = pack_spheres(spheres, scene)
        radius = max(radius, reach)
    lights = lit(scene)
    if arrays:
        arrays["u_materials"] = pack_materials(scene)
        if lights:
            arrays["u_lights"] = pack_lights(lights, scene)
        if images_used(scene):
            arrays["u_image_table"], arrays["u_image_texels"] = pack_images(scene)
            if mipmaps:
                arrays["u_mip_table"], arrays["u_image_mips"] = pack_mipmaps(scene)
    warnings = (*triangles.warnings, *sphere_warnings)
    return Packed(arrays, len(rows), len(spheres), len(lights), radius, warnings, space, leaf_size)


def lit(scene: Scene) -> tuple[Light, ...]:
    """The lights, where some material can show them."""
    shows = any(any(material.base_color) or material.specular > 0 for material in scene.materials)
    return scene.lights if shows else ()


def images_used(scene: Scene) -> bool:
    return bool(scene.images) and any(m.base_image is not None or m.emission_image is not None for m in scene.materials)


def _usable_spheres(scene: Scene) -> tuple[Spheres, tuple[str, ...]]:
    spheres = scene.spheres
    radii = spheres.radii / scene.placement.scale
    usable = _near(scene, spheres.centres) & np.isfinite(spheres.axes).all(axis=(1, 2))
    usable &= (radii > SMALLEST_LENGTH) & (radii < LARGEST_LENGTH)
    if usable.all():
        return spheres, ()
    kept = rows_of(spheres, usable)
    count = f"{np.sum(~usable)} of {len(usable)} spheres"
    return kept, (f"{count} have no place, no positive radius, or lie too far away, and were skipped.",)


def _near(scene: Scene, points: np.ndarray) -> np.ndarray:
    """(…, 3), world space -> (…): whether a point is a number that the shaders can square."""
    with np.errstate(invalid="ignore", over="ignore"):
        return (np.abs(scene.placement.points_to_model(points)) < LARGEST_LENGTH).all(axis=-1)


def rows_of(spheres: Spheres, rows: np.ndarray) -> Spheres:
    """Some of them, or all in another order."""
    return Spheres(*(getattr(spheres, field.name)[rows] for field in fields(spheres)))


@dataclass(frozen=True, eq=False)
class TriangleTexels:
    """What the shaders read of all n triangles, in the scene's order.

    shape : float32, (n, 3, 4), for the intersection, see intersection/triangles.glsl
    surface : float32, (n, 4, 4), for the shading
    boxes : float32, (n, 2, 3), model space, low and high corners
    usable : bool, (n,), whether all of it is numbers that the shaders can square
    radius : of the usable ones around the model's centre, model lengths
    """

    shape: np.ndarray
    surface: np.ndarray
    boxes: np.ndarray
    usable: np.ndarray
    radius: float

    @property
    def warnings(self) -> tuple[str, ...]:
        bad = len(self.usable) - np.count_nonzero(self.usable)
        if not bad:
            return ()
        count = f"{bad} of {len(self.usable)} triangles"
        return (f"{count} have corners that are not numbers or lie too far away, and were skipped.",)


def triangle_texels(scene: Scene) -> TriangleTexels:
    triangles, placement = scene.triangles, scene.placement
    n = len(triangles)
    shape, surface = np.zeros((n, 3, 4), np.float32), np.zeros((n, 4, 4), np.float32)
    boxes, usable = np.empty((n, 2, 3), np.float32), np.empty(n, bool)

    def fill(rows: slice) -> float:
        """The largest squared distance of a corner."""
        with np.errstate(invalid="ignore", over="ignore"):
            corners = placement.points_to_model(triangles.positions[rows])
            a, b, c = np.ascontiguousarray(corners.transpose(1, 2, 0))  # (3, k) each
            low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)  # NaN where any is
            usable[rows] = ((low > -LARGEST_LENGTH) & (high < LARGEST_LENGTH)).all(axis=0)
            boxes[rows, 0], boxes[rows, 1] = low.T, high.T
            shape[rows, 0, :3], shape[rows, 1, :3], shape[rows, 2, :3] = a.T, (b - a).T, (c - a).T
            squares = np.max([(corner**2).sum(axis=0) for corner in (a, b, c)], axis=0)
        shape[rows, 0, 3], shape[rows, 1, 3] = triangles.material_index[rows], triangles.object_index[rows]
        surface[rows, :3, :3] = placement.directions_to_model(triangles.normals[rows])
        uvs = triangles.uvs[rows].reshape(-1, 6)
        surface[rows, :3, 3], surface[rows, 3, :3] = uvs[:, :3], uvs[:, 3:]
        usable[rows] &= np.isfinite(surface[rows]).all(axis=(1, 2))
        return float(squares.max(where=usable[rows], initial=0.0))

    farthest = in_strips(fill, n)
    return TriangleTexels(shape, surface, boxes, usable, math.sqrt(max(farthest, default=0.0)))


def folded_rows(texels: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Some rows of (n, k, 4), folded() one after the other."""
    _, k, _ = texels.shape
    out = np.zeros((max(1, math.ceil(len(rows) * k / TEXELS_PER_ROW)) * TEXELS_PER_ROW, 4), np.float32)
    taken = out[: len(rows) * k].reshape(-1, k, 4)
    in_strips(lambda part: np.take(texels, rows[part], axis=0, out=taken[part], mode="clip"), len(rows))
    return out.reshape(-1, TEXELS_PER_ROW, 4)


def sphere_boxes(spheres: Spheres, scene: Scene) -> np.ndarray:
    """float32, (n, 2, 3), model space, low and high corners of the spheres' boxes."""
    centres = scene.placement.points_to_model(spheres.centres)
    radii = (spheres.radii / scene.placement.scale)[:, None]
    return np.stack([centres - radii, centres + radii], axis=1).astype(np.float32)


def spatial_order(points: np.ndarray) -> np.ndarray:
    """The order of points, (n, 3), along a Morton curve: neighbours in it are neighbours in space."""
    low, high = points.min(axis=0), points.max(axis=0)
    cells = ((points - low) / np.maximum(high - low, 1e-300) * 1023).astype(np.uint64)
    for shift, mask in ((16, 0x030000FF), (8, 0x0300F00F), (4, 0x030C30C3), (2, 0x09249249)):
        cells = (cells | (cells << np.uint64(shift))) & np.uint64(mask)
    return np.argsort(cells[:, 0] | (cells[:, 1] << np.uint64(1)) | (cells[:, 2] << np.uint64(2)), kind="stable")


def group_spheres(corners: np.ndarray) -> np.ndarray:
    """corners : (n, 3, 3), model space, in order -> (groups, 4): centre and squared radius, with room for rounding."""
    count = math.ceil(len(corners) / GROUP_SIZE)
    last = np.broadcast_to(corners[-1:], (count * GROUP_SIZE - len(corners), 3, 3))
    points = np.concatenate([corners, last]).reshape(count, GROUP_SIZE * 3, 3)
    centre = 0.5 * (points.min(axis=1) + points.max(axis=1))
    radius = np.sqrt(np.max(np.sum((points - centre[:, None]) ** 2, axis=-1), axis=1))
    # float32 rounds centre and points by 1e-7 of their size; the chord's distance by as much again.
    radius = 1.0001 * radius + 1e-6 * (np.linalg.norm(centre, axis=1) + radius)
    return np.concatenate([centre, radius[:, None] ** 2], axis=1)


def pack_spheres(spheres: Spheres, scene: Scene) -> tuple[np.ndarray, float]:
    """Five texels a sphere (intersection/spheres.glsl), and the radius around the model's centre that holds all."""
    centres = scene.placement.points_to_model(spheres.centres)
    radii = spheres.radii / scene.placement.scale
    texels = np.zeros((len(spheres), 5, 4), np.float32)
    texels[:, 0, :3], texels[:, 0, 3] = centres, radii
    texels[:, 1, 0], texels[:, 1, 1] = spheres.material_index, spheres.object_index
    texels[:, 2:, :3] = scene.placement.directions_to_model(spheres.axes)
    return folded(texels.reshape(-1, 4)), float(np.max(np.linalg.norm(centres, axis=1) + radii))


def pack_materials(scene: Scene) -> np.ndarray:
    """Three texels a material; see shading/blinn_phong.glsl. Image -1 is none."""
    texels = np.zeros((len(scene.materials), 3, 4), np.float32)
    for row, material in zip(texels, scene.materials, strict=True):
        row[0] = (*material.base_color, -1 if material.base_image is None else material.base_image)
        row[1] = (*material.emission, -1 if material.emission_image is None else material.emission_image)
        row[2, :2] = material.roughness, material.specular
    return folded(texels.reshape(-1, 4))


def pack_lights(lights: tuple[Light, ...], scene: Scene) -> np.ndarray:
    """Three texels a light; see shading/lights.glsl. A lamp's power becomes intensity per steradian: P / 4 pi, for an
    area lamp P / pi on its axis, and falls with the distance in model lengths.
    """
    per_steradian = {"POINT": 0.25 / math.pi, "SPOT": 0.25 / math.pi, "AREA": 1.0 / math.pi}
    texels = np.zeros((len(lights), 3, 4), np.float32)
    for row, light in zip(texels, lights, strict=True):
        factor = 1.0 if light.kind == "SUN" else per_steradian[light.kind] / scene.placement.scale**2
        row[0] = (*scene.placement.points_to_model(np.array(light.position)), LIGHT_KINDS.index(light.kind))
        row[1] = (*(factor * np.array(light.power)), light.spot_cosines[0])
        row[2] = (*scene.placement.directions_to_model(np.array(light.direction)), light.spot_cosines[1])
    return folded(texels.reshape(-1, 4))


def pack_images(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """The table, one texel an image, and all texels, each image from the start of a row; see shading/images.glsl."""
    table, blocks, row = [], [], 0
    for image in scene.images:
        height, width, _ = image.pixels.shape
        code = EXTENSIONS.index(image.extension) + 4 * INTERPOLATIONS.index(image.interpolation)
        table.append((row, width, height, code))
        blocks.append(folded(np.nan_to_num(image.pixels.reshape(-1, 4))))  # EXR files may hold NaN and infinity
        row += len(blocks[-1])
    return folded(np.array(table, np.float32)), np.concatenate(blocks)


def pack_mipmaps(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """The table, one texel an image, and the levels from 1 on, each image from the start of a row; see
    shading/mipmaps.glsl.
    """
    table, blocks, row = [], [], 0
    for image in scene.images:
        levels = mip_levels(image.pixels)
        table.append((row, len(levels), 0, 0))
        blocks.append(folded(np.concatenate([level.reshape(-1, 4) for level in levels] or [np.zeros((1, 4))])))
        row += len(blocks[-1])
    return folded(np.array(table, np.float32)), np.concatenate(blocks)


def mip_levels(pixels: np.ndarray) -> list[np.ndarray]:
    """(height, width, 4) -> float32, the coarser levels down to one texel; each has the mean of the image."""
    levels = []
    while max(pixels.shape[:2]) > 1:
        pixels = _halved(pixels, clean=not levels)
        levels.append(pixels)
    return levels


def _halved(pixels: np.ndarray, clean: bool) -> np.ndarray:
    """Half as many texels along both axes, rounded down but at least one: each the mean of what it covers. Some rows at
    a time, which a processor's cache holds. clean : NaN and infinity, which have no mean, become what half floats hold.
    """
    height, width, channels = pixels.shape
    rows, columns = _shares(height), _shares(width)
    halved = np.empty((len(rows[0]), len(columns[0]), channels), np.float32)
    count = max(1, STRIP // width)
    for first in range(0, len(halved), count):
        part = halved[first : first + count]
        strip = pixels[2 * first : 2 * (first + count) + 1]
        if clean:
            strip = strip.clip(-LARGEST_HALF, LARGEST_HALF)
            if np.isnan(strip.sum()):
                np.nan_to_num(strip, copy=False)
        shares = (share[first : first + count, None, None] for share in rows)
        strip = sum(share * strip[k::2][: len(part)] for k, share in enumerate(shares))
        part[:] = sum(share[:, None] * strip[:, k::2][:, : len(columns[0])] for k, share in enumerate(columns))
    return halved


def _shares(count: int) -> tuple[np.ndarray, ...]:
    """How much texels 2 i, 2 i + 1, … count in texel i of half as many; they add up to 1. Of an odd number, each covers
    two texels and a bit: of a third one, or of those at both sides.
    """
    half = max(count // 2, 1)
    number = np.arange(half, dtype=np.float32)
    if count == 1:
        return (np.ones(1, np.float32),)
    if count % 2 == 0:
        return (np.full(half, 0.5, np.float32),) * 2
    return (
        (half - number) / np.float32(count),
        np.full(half, half / count, np.float32),
        (number + 1) / np.float32(count),
    )

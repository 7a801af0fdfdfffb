"""Scene -> named float32 arrays, and the texel layout that shaders/ reads.

Every array is a long row of RGBA texels folded into TEXELS_PER_ROW columns (common/texels.glsl unfolds it). Positions
go into model space in float64 and become float32 only there, so that a scene far from the world's origin keeps its
digits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np

from . import bvh
from .scene import EXTENSIONS, INTERPOLATIONS, LIGHT_KINDS, Light, Scene, Spheres, Triangles

TEXELS_PER_ROW = 2048  # common/texels.glsl
GROUP_SIZE = 16  # intersection/triangles.glsl
LARGEST_HALF = 65504.0  # images become half floats on the GPU
STRIP = 1 << 15  # texels of an image that are halved at a time: as many as a processor's cache holds
SMALLEST_LENGTH, LARGEST_LENGTH = 1e-15, 1e15  # model lengths; float32 holds their squares with room for products


@dataclass(frozen=True, eq=False)
class Packed:
    """arrays : uniform name -> float32, (rows, TEXELS_PER_ROW, 4)
    bounds_radius : of all objects around the model's centre, model lengths
    bounds : float32, (2, 3), low and high corner of all objects, model lengths, where there is a tree
    """

    arrays: dict[str, np.ndarray]
    triangle_count: int
    sphere_count: int
    light_count: int
    bounds_radius: float
    warnings: tuple[str, ...] = ()
    bounds: np.ndarray | None = None

    @property
    def bytes(self) -> int:
        return sum(array.nbytes for array in self.arrays.values())


def folded(texels: np.ndarray) -> np.ndarray:
    """(n, 4) -> float32, (rows, TEXELS_PER_ROW, 4), filled up with zeros."""
    rows = max(1, math.ceil(len(texels) / TEXELS_PER_ROW))
    out = np.zeros((rows * TEXELS_PER_ROW, 4), np.float32)
    out[: len(texels)] = texels
    return out.reshape(rows, TEXELS_PER_ROW, 4)


def pack(scene: Scene, *, groups: bool = True, tree: bool = False, mipmaps: bool = False) -> Packed:
    """Everything of the scene that its shaders read, and nothing else.

    groups : bound every GROUP_SIZE triangles, which are sorted in space, by a sphere
    tree : bound everything by a tree of boxes instead, and sort it as the tree's leaves count
    mipmaps : with coarser levels of the images, a third more of their bytes
    """
    triangles, triangle_warnings = _usable_triangles(scene)
    spheres, sphere_warnings = _usable_spheres(scene)
    arrays: dict[str, np.ndarray] = {}
    radius, bounds = 0.0, None
    corners = scene.placement.points_to_model(triangles.positions)
    if len(triangles):
        radius = max(radius, float(np.sqrt(np.max(np.sum(corners**2, axis=-1)))))
    if tree and (len(triangles) or len(spheres)):
        grown = bvh.build(triangle_boxes(corners), sphere_boxes(spheres, scene))
        arrays["u_tree"], bounds = folded(grown.nodes.reshape(-1, 4)), grown.bounds
        order, spheres = grown.triangles, rows_of(spheres, grown.spheres)
    elif len(triangles):
        order = spatial_order(corners.mean(axis=1))  # without groups, too: it decides between coincident triangles
        if groups:
            arrays["u_triangle_groups"] = folded(group_spheres(corners[order]))
    if len(triangles):
        arrays["u_triangles"], arrays["u_corners"] = pack_triangles(triangles, corners, scene, order)
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
    warnings = (*triangle_warnings, *sphere_warnings)
    return Packed(arrays, len(triangles), len(spheres), len(lights), radius, warnings, bounds)


def lit(scene: Scene) -> tuple[Light, ...]:
    """The lights, where some material can show them."""
    shows = any(any(material.base_color) or material.specular > 0 for material in scene.materials)
    return scene.lights if shows else ()


def images_used(scene: Scene) -> bool:
    return bool(scene.images) and any(m.base_image is not None or m.emission_image is not None for m in scene.materials)


def _usable_triangles(scene: Scene) -> tuple[Triangles, tuple[str, ...]]:
    triangles = scene.triangles
    usable = _near(scene, triangles.positions).all(axis=1)
    for values in (triangles.normals, triangles.uvs):
        usable &= np.isfinite(values).all(axis=(1, 2))
    if usable.all():
        return triangles, ()
    kept = rows_of(triangles, usable)
    count = f"{np.sum(~usable)} of {len(usable)} triangles"
    return kept, (f"{count} have corners that are not numbers or lie too far away, and were skipped.",)


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


def rows_of(soup, rows: np.ndarray):
    """Some rows of Triangles or Spheres, or all of them in another order."""
    return type(soup)(*(getattr(soup, field.name)[rows] for field in fields(soup)))


def triangle_boxes(corners: np.ndarray) -> np.ndarray:
    """corners : (n, 3, 3), model space -> float32, (n, 2, 3), low and high corners of their boxes."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    boxes = np.empty((len(corners), 2, 3), np.float32)
    boxes[:, 0] = np.minimum(np.minimum(a, b), c)
    boxes[:, 1] = np.maximum(np.maximum(a, b), c)
    return boxes


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


def pack_triangles(triangles: Triangles, corners: np.ndarray, scene: Scene, order: np.ndarray):
    """Three texels for the intersection, four for the shading; see intersection/triangles.glsl."""
    n = len(triangles)
    corners, normals, uvs = corners[order], triangles.normals[order], triangles.uvs[order]
    shape = np.zeros((n, 3, 4), np.float32)
    shape[:, 0, :3] = corners[:, 0]
    shape[:, 1, :3] = corners[:, 1] - corners[:, 0]
    shape[:, 2, :3] = corners[:, 2] - corners[:, 0]
    shape[:, 0, 3] = triangles.material_index[order]
    shape[:, 1, 3] = triangles.object_index[order]
    surface = np.zeros((n, 16), np.float32)
    surface[:, [0, 1, 2, 4, 5, 6, 8, 9, 10]] = scene.placement.directions_to_model(normals).reshape(n, 9)
    surface[:, [3, 7, 11, 12, 13, 14]] = uvs.reshape(n, 6)
    return folded(shape.reshape(-1, 4)), folded(surface.reshape(-1, 4))


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

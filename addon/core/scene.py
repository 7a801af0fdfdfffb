"""What is rendered, as plain arrays: the only thing that passes from Blender's side to the renderer's.

World space is Blender's: metres, right-handed, Z up. Image row 0 is the bottom row, as in OpenGL and Blender.
Colours are scene-linear (Rec. 709 primaries unless the scene's OCIO configuration says otherwise).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .models import Model

EXTENSIONS = ("REPEAT", "EXTEND", "CLIP", "MIRROR")  # Blender's names, in the order the shaders number them
INTERPOLATIONS = ("LINEAR", "CLOSEST")
LIGHT_KINDS = ("POINT", "SUN", "SPOT", "AREA")
CAMERA_KINDS = ("PERSPECTIVE", "ORTHOGRAPHIC")


class SceneError(ValueError):
    """The scene cannot be rendered; the message names the object and the next step."""


@dataclass(frozen=True, eq=False)
class Triangles:
    """A soup of n triangles.

    positions       : float64, (n, 3, 3), metres, world space; axis 1 is the corner
    normals         : float32, (n, 3, 3), unit, world space, one for each corner
    uvs             : float32, (n, 3, 2), the render-active UV map, zeros where a mesh has none
    material_index  : int32, (n,), into Scene.materials
    object_index    : int32, (n,), the object's pass index, as Blender's Object Index pass shows it
    """

    positions: np.ndarray
    normals: np.ndarray
    uvs: np.ndarray
    material_index: np.ndarray
    object_index: np.ndarray

    def __len__(self) -> int:
        return len(self.positions)

    @classmethod
    def empty(cls) -> Triangles:
        return cls(
            np.zeros((0, 3, 3)),
            np.zeros((0, 3, 3), np.float32),
            np.zeros((0, 3, 2), np.float32),
            np.zeros(0, np.int32),
            np.zeros(0, np.int32),
        )


@dataclass(frozen=True, eq=False)
class Spheres:
    """n analytic spheres.

    centres         : float64, (n, 3), metres, world space
    radii           : float64, (n,), metres, positive
    axes            : float64, (n, 3, 3), sphere_from_world rotation: row i is the sphere's own axis i in world space.
                      Texture coordinates: u = atan2(y, x) / 2π + ½, v = asin(z) / π + ½ of the normal in these axes
    material_index  : int32, (n,), into Scene.materials
    object_index    : int32, (n,), the object's pass index
    """

    centres: np.ndarray
    radii: np.ndarray
    axes: np.ndarray
    material_index: np.ndarray
    object_index: np.ndarray

    def __len__(self) -> int:
        return len(self.centres)

    @classmethod
    def empty(cls) -> Spheres:
        return cls(np.zeros((0, 3)), np.zeros(0), np.zeros((0, 3, 3)), np.zeros(0, np.int32), np.zeros(0, np.int32))


@dataclass(frozen=True, eq=False)
class Image:
    """pixels : float32, (height, width, 4), scene-linear, not premultiplied, row 0 at the bottom."""

    name: str
    pixels: np.ndarray
    extension: str = "REPEAT"
    interpolation: str = "LINEAR"


@dataclass(frozen=True)
class Material:
    """A surface of Section 3.4: ambient, emissive, textured, Blinn-Phong.

    A colour is multiplied by its image where there is one; images are indices into Scene.images.
    emission is radiance, W m⁻² sr⁻¹ (colour times strength). roughness and specular are Principled's, in [0, 1].
    specular 0 leaves the highlight out (Emission and Diffuse BSDF).
    """

    name: str = "Default"
    base_color: tuple[float, float, float] = (0.8, 0.8, 0.8)
    emission: tuple[float, float, float] = (0.0, 0.0, 0.0)
    roughness: float = 0.5
    specular: float = 0.0
    base_image: int | None = None
    emission_image: int | None = None


@dataclass(frozen=True)
class Light:
    """A light of Blender, lit straight from the hit point (the paper's "fake" illumination).

    position   : metres, world space (unused by SUN)
    direction  : unit, world space, the way the light travels (unused by POINT)
    power      : POINT, SPOT, AREA: watts per colour (colour times energy). SUN: irradiance, W m⁻² per colour
    spot_cosines : cosine at the cone's edge and cosine where the full intensity begins (SPOT only)
    """

    kind: str
    power: tuple[float, float, float]
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    direction: tuple[float, float, float] = (0.0, 0.0, -1.0)
    spot_cosines: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Camera:
    """world_from_camera : float64, (4, 4), rotation and translation only; the camera looks along -Z, Y is up.
    window : (left, right, bottom, top), the edges of the *whole* image: on the plane at distance 1 (PERSPECTIVE)
             or in metres (ORTHOGRAPHIC). Sensor fit, shift and pixel aspect are in it.
    width, height : pixels of the whole image
    region : (x0, y0, x1, y1), pixels, half open: the part that is rendered; None is the whole image
    """

    world_from_camera: np.ndarray
    window: tuple[float, float, float, float]
    width: int
    height: int
    kind: str = "PERSPECTIVE"
    region: tuple[int, int, int, int] | None = None

    @property
    def pixel_box(self) -> tuple[int, int, int, int]:
        return self.region or (0, 0, self.width, self.height)

    @property
    def size(self) -> tuple[int, int]:
        """Columns and rows of the picture that a render returns."""
        x0, y0, x1, y1 = self.pixel_box
        return x1 - x0, y1 - y0


@dataclass(frozen=True, eq=False)
class Environment:
    """The sky at infinity.

    color : radiance where there are no faces; their mean where the exporter made them
    faces : float32, (6, size, size, 3), radiance, world space, in OpenGL's order (+X -X +Y -Y +Z -Z) and orientation
            (see environment_cube.face_directions), or None
    """

    color: tuple[float, float, float] = (0.0, 0.0, 0.0)
    faces: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class Placement:
    """Puts a model, which lives at the origin of its own space with unit scale, into the world.

    position : metres, world space;  rotation : (3, 3), world_from_model;  scale : metres a model length
    """

    position: np.ndarray = field(default_factory=lambda: np.zeros(3))
    rotation: np.ndarray = field(default_factory=lambda: np.eye(3))
    scale: float = 1.0

    def points_to_model(self, points: np.ndarray) -> np.ndarray:
        """(…, 3) world space, metres -> (…, 3) model space, model lengths, float64."""
        points = np.asarray(points, np.float64)
        # One long list: numpy multiplies a stack of small matrices one after the other.
        return ((points.reshape(-1, 3) - self.position) @ self.rotation / self.scale).reshape(points.shape)

    def directions_to_model(self, directions: np.ndarray) -> np.ndarray:
        """(…, 3) world space -> (…, 3) model space; lengths are kept."""
        directions = np.asarray(directions, np.float64)
        return (directions.reshape(-1, 3) @ self.rotation).reshape(directions.shape)


@dataclass(frozen=True, eq=False)
class Scene:
    """Everything a frame needs. `warnings` are sentences the export wants shown beside the picture.

    far_environment : the sky of a model's far side (wormhole), in the axes of the far chart; None for the same sky
    """

    camera: Camera
    model: Model
    placement: Placement = field(default_factory=Placement)
    triangles: Triangles = field(default_factory=Triangles.empty)
    spheres: Spheres = field(default_factory=Spheres.empty)
    materials: tuple[Material, ...] = (Material(),)
    images: tuple[Image, ...] = ()
    lights: tuple[Light, ...] = ()
    environment: Environment = field(default_factory=Environment)
    far_environment: Environment | None = None
    ambient: tuple[float, float, float] = (0.0, 0.0, 0.0)
    warnings: tuple[str, ...] = ()

"""What the report measures: a scene for every law of light, and the rays that are held against the reference."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..models import MODELS, Model
from ..observers import chart_directions
from ..reference import Truth, true_ends
from ..scene import Camera, Scene
from ..settings import Settings

ACROSS = 1024  # pixels that a built-in case's picture is thought to have across: what a pixel of error is
SEED = 20040901  # of the places within the strata


@dataclass(frozen=True, eq=False)
class Case:
    """name : of the model;  title : what is seen;  pixel : radians a pixel;  scene : camera and model, no objects
    observer, observer_velocity : as Settings has them
    """

    name: str
    title: str
    scene: Scene
    pixel: float
    observer: str = "chart"
    observer_velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def model(self) -> Model:
        return self.scene.model

    def seen(self, settings: Settings) -> Settings:
        """The settings with this observer."""
        return replace(settings, observer=self.observer, observer_velocity=self.observer_velocity)

    def truth(self, positions: np.ndarray, directions: np.ndarray, **options) -> Truth:
        """Of rays as rays() gives them. options : of true_ends()"""
        return true_ends(self.model, positions, self.in_chart(positions, directions), **options)

    def in_chart(self, positions: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """What the observer sees in these directions comes from those of the chart, float64, (n, 3)."""
        velocity = tuple(self.scene.placement.directions_to_model(self.observer_velocity))
        return chart_directions(self.model, self.observer, velocity, positions, directions)

    def rays(self, side: int) -> tuple[np.ndarray, np.ndarray]:
        """Origins and the observer's unit directions, float32's numbers in float64, (side², 3), model space: a ray in
        each of side x side equal parts of the picture, at a random but always the same place in it.
        """
        generator = np.random.default_rng(SEED)
        rows, columns = np.divmod(np.arange(side * side), side)
        jitter = generator.random((side * side, 2))
        return camera_rays(self.scene, (columns + jitter[:, 0]) / side, (rows + jitter[:, 1]) / side)

    def pixel_rays(
        self, columns: int, rows: int, part: tuple[float, float, float, float] = (0.0, 1.0, 0.0, 1.0)
    ) -> tuple[np.ndarray, np.ndarray]:
        """As rays(): through the centres of columns x rows pixels, row by row from the bottom. part : of the picture,
        left, right, bottom and top as fractions of it
        """
        left, right, bottom, top = part
        y, x = np.divmod(np.arange(columns * rows), columns)
        x, y = left + (right - left) * (x + 0.5) / columns, bottom + (top - bottom) * (y + 0.5) / rows
        return camera_rays(self.scene, x, y)

    def small(self, columns: int, rows: int) -> Scene:
        """The scene with as many pixels."""
        return replace(self.scene, camera=replace(self.scene.camera, width=columns, height=rows, region=None))


def camera_rays(scene: Scene, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """x, y : (n,), in [0, 1], fractions of the picture from its lower left corner -> origins, directions, (n, 3)."""
    camera, placement = scene.camera, scene.placement
    left, right, bottom, top = camera.window
    x, y = left + x * (right - left), bottom + y * (top - bottom)
    rotation, position = camera.world_from_camera[:3, :3], camera.world_from_camera[:3, 3]
    if camera.kind == "ORTHOGRAPHIC":
        origins = np.stack([x, y, 0.0 * x], axis=1) @ rotation.T + position
        directions = np.broadcast_to(-rotation[:, 2], origins.shape)
    else:
        directions = np.stack([x, y, -np.ones_like(x)], axis=1) @ rotation.T
        origins = np.broadcast_to(position, directions.shape)
    directions = placement.directions_to_model(directions).astype(np.float32).astype(np.float64)
    origins = placement.points_to_model(origins).astype(np.float32).astype(np.float64)
    return origins, directions / np.linalg.norm(directions, axis=1, keepdims=True)


def of_scene(scene: Scene, settings: Settings | None = None) -> Case:
    """The user's scene without its objects. A pixel is the angle that it has at the picture's middle.

    settings : for the observer
    """
    bare = Scene(scene.camera, scene.model, scene.placement)
    pixel = (scene.camera.window[1] - scene.camera.window[0]) / scene.camera.width
    if scene.camera.kind == "ORTHOGRAPHIC":  # seen from the model's centre
        away = np.linalg.norm(scene.camera.world_from_camera[:3, 3] - scene.placement.position)
        pixel /= max(float(away), pixel)
    case = Case(scene.model.name, scene.model.label, bare, float(pixel))
    if settings is None:
        return case
    return replace(case, observer=settings.observer, observer_velocity=settings.observer_velocity)


def look_at_centre(position: tuple[float, float, float]) -> np.ndarray:
    """world_from_camera, (4, 4), of a camera at `position` that looks at the origin."""
    back = np.array(position, float) / np.linalg.norm(position)
    right = np.cross((0.0, 0.0, 1.0), back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3] = np.column_stack([right, np.cross(back, right), back, position])
    return matrix


def _case(title: str, name: str, position: tuple[float, float, float], half: float, **values) -> Case:
    """half : of the picture's width, at distance 1."""
    camera = Camera(look_at_centre(position), (-half, half, -half, half), ACROSS, ACROSS)
    return Case(name, title, Scene(camera, MODELS[name](**values)), 2.0 * half / ACROSS)


def built_in() -> list[Case]:
    """One or more for every model. Cameras stand where a user would put them: the law fills the picture."""
    return [
        _case("Straight", "straight", (0, -10, 1), 0.5),
        _case("Schwarzschild, camera at 20 M", "schwarzschild", (0, -20, 1), 0.5),
        _case("Kerr, a = 0.9, camera at 20 M", "kerr", (0, -20, 3), 0.5, spin=0.9),
        _case("Wormhole, camera at 5 throat radii", "wormhole", (0, -5, 0.5), 0.5),
        _case("Luneburg lens", "refraction", (0, -4, 0.5), 0.4, medium="luneburg"),
        _case("Explosion", "refraction", (0, -4, 0.5), 0.4, medium="explosion", strength=0.05),
        _case("Ball behind a front, 0.05 R", "refraction", (0, -4, 0.5), 0.4, medium="shell", thickness=0.05),
        _case("Cubic potential", "radial_potential", (0, -15, 2), 0.5),
        _case("Yukawa potential", "radial_potential", (0, -15, 2), 0.5, xi="yukawa"),
        _case("Lorenz as a force of 1e-4", "lorenz", (0, -60, 10), 0.5, strength=1e-4),
        _case("Rössler as a force of 1e-3", "roessler", (0, -30, 5), 0.5, strength=1e-3),
        _case("A typed force, softened Coulomb", "custom", (0, -10, 1), 0.5),
    ]


QUICK = ("Explosion", "Yukawa potential", "A typed force, softened Coulomb")  # left out where time is short

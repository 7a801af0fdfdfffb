"""What is in the samples. Metres; a black hole has M = 1 m and sits at the origin; all else stays outside r = 4 M.

The camera looks along +Y at the hole, so that "behind the hole" is +Y and the line
of sight through it is the axis of the Einstein ring.
"""

import bpy
import numpy as np
import textures
from parts import (
    add_camera,
    add_light,
    add_object,
    add_sphere,
    box_mesh,
    floor_mesh,
    glowing,
    mesh_of,
    monkey_mesh,
    painted,
    ring_mesh,
    sky,
    torus_mesh,
)

FLOOR = -6.0  # z of the floor: 4 M below the horizon, which it passes under


def test_scene(scene):
    """Figure 4 (a): textured objects and spheres, straight rays."""
    _test_objects(scene)
    _apply("figure_4a")


def schwarzschild(scene):
    """Figure 4 (e): the test scene, object for object, with a black hole in its middle."""
    _test_objects(scene)
    _black_hole(scene)


def suzanne(scene):
    """Suzanne beside a black hole, stars behind."""
    cloth = painted("Suzanne", textures.uv_grid(), roughness=0.35, specular=0.5)
    add_object(scene, "Suzanne", monkey_mesh(cloth), (10.5, -1, -0.4), (-4, 0, -8), 4.4)
    add_light(scene, "Sun", "SUN", 2.5, (1.0, 0.96, 0.88), rotation=(48, 0, -28))
    add_light(scene, "Lamp", "POINT", 2500, (0.55, 0.70, 1.0), (20, -8, 5))
    scene.world = sky("Stars", textures.star_sky(), turn=STARS_TURN)
    add_camera(scene, (0, -30, 2), (1, 0, 0), lens=20)
    _black_hole(scene, "suzanne")


STARS_TURN = (0, 0, -20)  # degrees: the bright part of the band comes behind the hole


def lorenz(scene):
    """Figure 4 (b): the test scene in the weak force of the Lorenz system."""
    _test_objects(scene)
    _apply("figure_4b")


def potential(scene):
    """Figure 4 (c): the test scene in the cubic radial potential, which attracts weakly."""
    _test_objects(scene)
    _apply("figure_4c")


def explosion(scene):
    """Figure 4 (d): the test scene behind the blast of an explosion."""
    _test_objects(scene)
    _apply("figure_4d")


def neutron_star(scene):
    """Figure 4 (f): a neutron star of the radius 4 M and its light companion, checkerboards on both, before stars."""
    blue = glowing("Blue Checks", textures.checkerboard((28, 74, 200), (170, 205, 255), 16))
    yellow = glowing("Yellow Checks", textures.checkerboard((240, 184, 30), (255, 244, 190), 16))
    add_sphere(scene, "Neutron Star", blue, (0, 0, 0), 4.0, (20, 0, 0))
    add_sphere(scene, "Companion", yellow, (7, 13, 2.5), 2.6, (25, 15, 0))
    _number(scene)
    scene.world = sky("Stars", textures.star_sky(), turn=STARS_TURN)
    add_camera(scene, (0, -27, 3), (1.2, 0, 0.4), lens=30)
    _black_hole(scene, "figure_4f", "Mass")


def kerr(scene):
    """A thin disk around a black hole of the spin 0.998, seen from 8 degrees above it."""
    gas = glowing("Disk", textures.disk())
    add_object(scene, "Disk", ring_mesh("Disk", gas, 1.65, 13.0, 64, 4))
    _number(scene)
    scene.world = sky("Stars", textures.star_sky(), turn=STARS_TURN)
    add_camera(scene, (0, -29.7, 4.2), (0, 0, 0.4), lens=34)
    _black_hole(scene, "kerr")


def mirage(scene):
    """Hot air over a desert road: it mirrors the car and the sky, from afar. The ground is z = 0, the eye 1.7 m up."""
    road = painted("Asphalt", textures.asphalt(), roughness=1.0, specular=0.0)
    ground = painted("Sand", textures.sand(), roughness=1.0, specular=0.0)
    rock = painted("Rock", textures.ridge(), roughness=1.0, specular=0.0)
    paint = painted("Car Paint", textures.car_paint(), roughness=0.3)
    glass = painted("Car Windows", textures.window_paint(), roughness=0.2)
    wood = painted("Wood", textures.bricks((96, 72, 52), (70, 52, 38)), roughness=1.0, specular=0.0)
    add_object(scene, "Desert", floor_mesh(ground, 1500.0, 5.0), (0, 1000, -0.03))
    add_object(scene, "Road", _road_mesh(road, 7.0, 1400.0, 24.0), (0, 0, 0))
    add_object(scene, "Mountains", _ridge_mesh(rock, 200.0, 24.0), (0, 1400, 0))
    add_object(scene, "Car Body", box_mesh("Car Body", paint, (1.9, 4.2, 0.9)), (1.3, 128, 0.75), (0, 0, 4))
    add_object(scene, "Car Cabin", box_mesh("Car Cabin", glass, (1.6, 2.2, 0.65)), (1.3, 128.4, 1.5), (0, 0, 4))
    for side in (-0.75, 0.75):
        for along in (-1.3, 1.3):
            name = f"Wheel {'LR'[side > 0]}{'FB'[along > 0]}"
            add_object(scene, name, box_mesh(name, wood, (0.26, 0.66, 0.66)), (1.3 + side, 128 + along, 0.33))
    for number, distance in enumerate((70, 120, 190, 300)):
        name = f"Post {number + 1}"
        add_object(scene, name, box_mesh(name, wood, (0.25, 0.25, 4.5), 4), (-5.5, distance, 2.25))
    _number(scene)
    add_light(scene, "Sun", "SUN", 3.0, (1.0, 0.94, 0.84), rotation=(38, 0, -40))
    scene.world = sky("Desert Sky", textures.desert_sky())
    add_camera(scene, (0, 0, 1.7), (0.6, 100, 1.35), lens=360)
    _apply("mirage")


def luneburg(scene):
    """A Luneburg lens before a screen that touches its rim: one spot of the screen fills the lens."""
    floor = painted("Floor", textures.checkerboard((218, 214, 204), (74, 84, 98)), roughness=0.9, specular=0.0)
    grid = painted("Colour Grid", textures.uv_grid(16, 512), roughness=0.9, specular=0.0)
    brass = painted("Brass", textures.stripes((206, 160, 70), (150, 108, 40), 2), roughness=0.3)
    red = painted("Red Checks", textures.checkerboard((196, 34, 30), (250, 240, 228), 8), roughness=0.25)
    add_object(scene, "Floor", floor_mesh(floor, 16.0, 2.0), (0, 4, -3))
    add_object(scene, "Screen", box_mesh("Screen", grid, (9, 0.1, 6)), (0, 2.05, 0))
    add_object(scene, "Ring", torus_mesh(brass, 2.06, 0.06, 32, 6), (0, 0, 0), (90, 0, 10.9))
    add_sphere(scene, "Red Sphere", red, (-3.4, -1.5, -2.2), 0.8, (12, 0, 20))
    _number(scene)
    add_light(scene, "Sun", "SUN", 2.6, (1.0, 0.95, 0.86), rotation=(50, 0, -20))
    scene.world = sky("Sky", textures.gradient_sky())
    add_camera(scene, (2.5, -13, 0.9), (0, 0, -0.1), lens=50)
    _apply("luneburg")


def wormhole(scene):
    """The test scene with a wormhole's mouth in its middle; a planet hangs among the stars of the far side."""
    _test_objects(scene)
    bands = painted("Planet", textures.planet(), roughness=1.0, specular=0.0)
    throat = 8.0  # model lengths and metres: the preset's
    # What stands at x within half the throat's radius b stands on the far side at b² x / 4|x|²: an inversion, which
    # takes a sphere to a sphere.
    centre, radius = np.array((3.2, -14.0, 2.2)), 6.0
    shrink = throat**2 / 4 / (centre @ centre - radius**2)
    add_sphere(scene, "Planet", bands, shrink * centre, shrink * radius, (70, 20, 0))
    _number(scene)
    _apply("wormhole")
    scene.nonlinear_rays.far_world = sky("Stars", textures.star_sky(), turn=STARS_TURN)


def volume_refraction(scene):
    """A volume as the refractive index: the fog that fills Suzanne bends light as glass does."""
    floor = painted("Floor", textures.checkerboard((218, 214, 204), (74, 84, 98)), roughness=0.9, specular=0.0)
    grid = painted("Colour Grid", textures.uv_grid(), roughness=0.9, specular=0.0)
    rings = painted("Rings", textures.rings((240, 225, 200), (30, 110, 120)), roughness=0.5, specular=0.3)
    add_object(scene, "Floor", floor_mesh(floor, 16.0, 1.0), (0, 4, -1.6))
    add_object(scene, "Screen", box_mesh("Screen", grid, (7, 0.2, 5)), (0, 4.5, 0.9), (0, 0, -8))
    add_object(scene, "Cube", box_mesh("Cube", rings, (1.2, 1.2, 1.2)), (-2.9, 0.6, -1.0), (0, 0, 28))
    shape = add_object(scene, "Shape", monkey_mesh(floor), turn=(-4, 0, 14), scale=1.5)
    shape.modifiers.new("Smooth", "SUBSURF").levels = 1
    shape.hide_render = True
    shape.display_type = "WIRE"
    _number(scene)
    fog = add_object(scene, "Fog", bpy.data.volumes.new("Fog"))
    fill = fog.modifiers.new("Fill", "MESH_TO_VOLUME")
    fill.object = shape
    fill.voxel_amount = 96
    fill.interior_band_width = 0.2
    fill.density = 1.0
    add_light(scene, "Sun", "SUN", 2.6, (1.0, 0.95, 0.86), rotation=(50, 0, -20))
    scene.world = sky("Sky", textures.gradient_sky())
    add_camera(scene, (1.0, -8, 1.0), (0, 0, 0.1), lens=50)
    _apply("volume")
    settings = scene.nonlinear_rays
    settings.refraction.volume = fog
    settings.refraction.grid_resolution = 80


def _test_objects(scene):
    """274 triangles and three analytic spheres; both of the paper's pictures have the same."""
    floor = painted("Floor", textures.checkerboard((218, 214, 204), (74, 84, 98)), roughness=0.9, specular=0.0)
    grid = painted("Colour Grid", textures.uv_grid(), roughness=0.7, specular=0.2)
    bricks = painted("Bricks", textures.bricks((178, 82, 58), (205, 200, 190)), roughness=0.8, specular=0.1)
    rings = painted("Rings", textures.rings((240, 225, 200), (30, 110, 120)), roughness=0.5, specular=0.3)
    violet = painted("Violet Checks", textures.checkerboard((210, 190, 235), (110, 60, 160), 4), roughness=0.4)
    red = painted("Red Checks", textures.checkerboard((196, 34, 30), (250, 240, 228), 8), roughness=0.25)
    yellow = painted("Stripes", textures.stripes((236, 178, 40), (40, 60, 140)), roughness=0.25)
    green = painted("Green Checks", textures.checkerboard((38, 140, 72), (240, 244, 220), 8), roughness=0.25)

    add_object(scene, "Floor", floor_mesh(floor, 32.0, 4.0), (0, 6, FLOOR))
    add_object(scene, "Cube", box_mesh("Cube", grid, (5, 5, 5)), (-11.5, 2, FLOOR + 2.5), (0, 0, 28))
    add_object(scene, "Pillar", box_mesh("Pillar", bricks, (3, 3, 6), 1), (17, 12, FLOOR + 6), (0, 0, -24), (1, 1, 2))
    add_object(scene, "Screen", box_mesh("Screen", rings, (11, 0.6, 11)), (-7, 24, FLOOR + 5.5), (0, 0, 10))
    add_object(scene, "Small Cube", box_mesh("Small Cube", grid, (3, 3, 3)), (6.5, -7, FLOOR + 1.5), (0, 0, 35))
    add_object(scene, "Torus", torus_mesh(violet, 2.4, 0.8), (-12.5, -1, 5), (62, 24, 0))
    add_sphere(scene, "Red Sphere", red, (0.7, 13, -1.6), 2.6, (12, 0, 20))
    add_sphere(scene, "Striped Sphere", yellow, (-4.5, -8, FLOOR + 2), 2.0, (0, 0, 10))
    add_sphere(scene, "Green Sphere", green, (9.5, 0, 3.5), 2.6, (30, 20, 0))
    _number(scene)
    add_light(scene, "Sun", "SUN", 2.6, (1.0, 0.95, 0.86), rotation=(42, 0, -32))
    add_light(scene, "Lamp", "POINT", 4000, (1.0, 0.86, 0.66), (-7, -12, 9))
    scene.world = sky("Sky", textures.gradient_sky())
    add_camera(scene, (0, -27, 4.5), (0, 0, -0.4), lens=24)


def _apply(preset):
    """The law of light is that of the panel's preset: addon/presets.py."""
    bpy.ops.nonlinear_rays.apply_preset(preset=preset)


def _number(scene):
    """The pass Object Index tells the objects apart."""
    for index, thing in enumerate((item for item in scene.collection.objects if item.type == "MESH"), start=1):
        thing.pass_index = index


def _black_hole(scene, preset="figure_4e", name="Black Hole"):
    """Rays bend around the Empty, where the horizon is twice as far as the mass: 2 m."""
    hole = bpy.data.objects.new(name, None)
    hole.empty_display_type = "SPHERE"
    hole.empty_display_size = 2.0
    scene.collection.objects.link(hole)
    _apply(preset)
    scene.nonlinear_rays.center = hole


def _road_mesh(material, width, length, repeat):
    """From behind the camera on, along +Y; the picture repeats every `repeat` metres."""
    points = [(-width / 2, -20, 0), (width / 2, -20, 0), (width / 2, length, 0), (-width / 2, length, 0)]
    v = (length + 20) / repeat
    return mesh_of("Road", material, points, [(0, 1, 2, 3)], [(0, 0), (1, 0), (1, v), (0, v)])


def _ridge_mesh(material, half, height, peaks=48):
    """Mountains as a jagged wall along X."""
    random = np.random.default_rng(textures.SEED)
    x = np.linspace(-half, half, peaks + 1)
    tops = height * np.interp(x, np.linspace(-half, half, 25), random.uniform(0.3, 1.0, 25))
    tops *= random.uniform(0.85, 1.0, len(x))
    points = [(a, 0, -1) for a in x] + [(a, 0, top) for a, top in zip(x, tops, strict=True)]
    faces = [(i, i + 1, peaks + 2 + i, peaks + 1 + i) for i in range(peaks)]
    corners = [
        ((i + du) / 16, dv * tops[i + du] / height) for i in range(peaks) for du, dv in ((0, 0), (1, 0), (1, 1), (0, 1))
    ]
    return mesh_of("Mountains", material, points, faces, corners)

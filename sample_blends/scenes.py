"""What is in the samples. Metres; a black hole has M = 1 m and sits at the origin; all else stays outside r = 4 M.

The camera looks along +Y at the hole, so that "behind the hole" is +Y and the line
of sight through it is the axis of the Einstein ring.
"""

import bmesh
import bpy
import numpy as np
import textures
from mathutils import Matrix, Vector

FLOOR = -6.0  # z of the floor: 4 M below the horizon, which it passes under


def test_scene(scene):
    """Figure 4 (a): textured objects and spheres, straight rays."""
    _test_objects(scene)
    scene.nonlinear_rays.model = "straight"


def schwarzschild(scene):
    """Figure 4 (e): the test scene, object for object, with a black hole in its middle."""
    _test_objects(scene)
    _black_hole(scene)


def suzanne(scene):
    """Suzanne beside a black hole, stars behind."""
    cloth = _material("Suzanne", textures.uv_grid(), roughness=0.35, specular=0.5)
    _object(scene, "Suzanne", _monkey_mesh(cloth), (10.5, -1, -0.4), (-4, 0, -8), 4.4)
    _light(scene, "Sun", "SUN", 2.5, (1.0, 0.96, 0.88), rotation=(48, 0, -28))
    _light(scene, "Lamp", "POINT", 2500, (0.55, 0.70, 1.0), (20, -8, 5))
    _world(scene, "Stars", textures.star_sky(), turn=STARS_TURN)
    _camera(scene, (0, -30, 2), (1, 0, 0), lens=20)
    _black_hole(scene)


STARS_TURN = (0, 0, -20)  # degrees: the bright part of the band comes behind the hole


def _test_objects(scene):
    """274 triangles and three analytic spheres; both of the paper's pictures have the same."""
    floor = _material("Floor", textures.checkerboard((218, 214, 204), (74, 84, 98)), roughness=0.9, specular=0.0)
    grid = _material("Colour Grid", textures.uv_grid(), roughness=0.7, specular=0.2)
    bricks = _material("Bricks", textures.bricks((178, 82, 58), (205, 200, 190)), roughness=0.8, specular=0.1)
    rings = _material("Rings", textures.rings((240, 225, 200), (30, 110, 120)), roughness=0.5, specular=0.3)
    violet = _material("Violet Checks", textures.checkerboard((210, 190, 235), (110, 60, 160), 4), roughness=0.4)
    red = _material("Red Checks", textures.checkerboard((196, 34, 30), (250, 240, 228), 8), roughness=0.25)
    yellow = _material("Stripes", textures.stripes((236, 178, 40), (40, 60, 140)), roughness=0.25)
    green = _material("Green Checks", textures.checkerboard((38, 140, 72), (240, 244, 220), 8), roughness=0.25)

    _object(scene, "Floor", _floor_mesh(floor, 32.0, 4.0), (0, 6, FLOOR))
    _object(scene, "Cube", _box_mesh("Cube", grid, (5, 5, 5)), (-11.5, 2, FLOOR + 2.5), (0, 0, 28))
    _object(scene, "Pillar", _box_mesh("Pillar", bricks, (3, 3, 6), 1), (17, 12, FLOOR + 6), (0, 0, -24), (1, 1, 2))
    _object(scene, "Screen", _box_mesh("Screen", rings, (11, 0.6, 11)), (-7, 24, FLOOR + 5.5), (0, 0, 10))
    _object(scene, "Small Cube", _box_mesh("Small Cube", grid, (3, 3, 3)), (6.5, -7, FLOOR + 1.5), (0, 0, 35))
    _object(scene, "Torus", _torus_mesh(violet, 2.4, 0.8), (-12.5, -1, 5), (62, 24, 0))
    _sphere(scene, "Red Sphere", red, (0.7, 13, -1.6), 2.6, (12, 0, 20))
    _sphere(scene, "Striped Sphere", yellow, (-4.5, -8, FLOOR + 2), 2.0, (0, 0, 10))
    _sphere(scene, "Green Sphere", green, (9.5, 0, 3.5), 2.6, (30, 20, 0))
    for index, thing in enumerate(scene.collection.objects, start=1):
        thing.pass_index = index

    _light(scene, "Sun", "SUN", 2.6, (1.0, 0.95, 0.86), rotation=(42, 0, -32))
    _light(scene, "Lamp", "POINT", 4000, (1.0, 0.86, 0.66), (-7, -12, 9))
    _world(scene, "Sky", textures.gradient_sky())
    _camera(scene, (0, -27, 4.5), (0, 0, -0.4), lens=24)


def _black_hole(scene):
    """Rays bend around the Empty, where the horizon is twice as far as the mass: 2 m."""
    hole = bpy.data.objects.new("Black Hole", None)
    hole.empty_display_type = "SPHERE"
    hole.empty_display_size = 2.0
    scene.collection.objects.link(hole)
    settings = scene.nonlinear_rays
    settings.model = "schwarzschild"
    settings.center = hole
    settings.segments = 500  # enough for the rays that go around the hole, so that none ends at the limit


def _object(scene, name, data, place, turn=(0, 0, 0), scale=1.0):
    """turn : degrees around X, Y, Z; scale : one number or three."""
    thing = bpy.data.objects.new(name, data)
    thing.location = place
    thing.rotation_euler = np.radians(turn)
    thing.scale = np.broadcast_to(scale, 3)
    scene.collection.objects.link(thing)
    return thing


def _sphere(scene, name, material, centre, radius, turn):
    """An analytic sphere; what the viewport shows is a stand-in with the same texture coordinates."""
    thing = _object(scene, name, _sphere_mesh(name, material), centre, turn, radius)
    thing.nonlinear_rays.analytic_sphere = True


def _light(scene, name, kind, energy, colour, place=(0, 0, 0), rotation=(0, 0, 0)):
    data = bpy.data.lights.new(name, kind)
    data.energy = energy
    data.color = colour
    _object(scene, name, data, place, rotation)


def _camera(scene, place, target, lens):
    """lens : mm on a sensor 36 mm wide."""
    data = bpy.data.cameras.new("Camera")
    data.lens = lens
    data.clip_end = 1000
    camera = _object(scene, "Camera", data, place)
    camera.rotation_euler = (Vector(target) - Vector(place)).to_track_quat("-Z", "Y").to_euler()
    scene.camera = camera


def _image(name, pixels):
    """Pack uint8 pixels, (height, width, 3), sRGB, as a PNG: the file refers to nothing outside itself."""
    height, width = pixels.shape[:2]
    rgba = np.ones((height, width, 4), np.float32)
    rgba[..., :3] = pixels / np.float32(255)
    image = bpy.data.images.new(name, width, height, alpha=False)
    image.pixels.foreach_set(rgba.ravel())
    image.pack()
    return image


def _material(name, pixels, roughness, specular=0.5):
    """Principled BSDF with an Image Texture as its base colour."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    surface = tree.nodes["Principled BSDF"]
    surface.inputs["Roughness"].default_value = roughness
    surface.inputs["Specular IOR Level"].default_value = specular
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image = _image(name, pixels)
    texture.location = (-320, 280)
    tree.nodes.active = texture  # what the viewport's Solid mode shows
    tree.links.new(texture.outputs["Color"], surface.inputs["Base Color"])
    return material


def _world(scene, name, pixels, turn=(0, 0, 0)):
    """An Environment Texture, turned by a Mapping. turn : degrees."""
    world = bpy.data.worlds.new(name)
    world.use_nodes = True
    tree = world.node_tree
    texture = tree.nodes.new("ShaderNodeTexEnvironment")
    texture.image = _image(name, pixels)
    mapping = tree.nodes.new("ShaderNodeMapping")
    mapping.inputs["Rotation"].default_value = np.radians(turn)
    coordinates = tree.nodes.new("ShaderNodeTexCoord")
    for column, node in enumerate((texture, mapping, coordinates), start=1):
        node.location = (10 - 320 * column, 300)
    tree.links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
    tree.links.new(texture.outputs["Color"], tree.nodes["Background"].inputs["Color"])
    scene.world = world


def _mesh(name, material, points, faces, uvs, smooth=False):
    """points : (n, 3); faces : lists of point numbers; uvs : (corners, 2), in the faces' order."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points, [], faces)
    mesh.uv_layers.new(name="UVMap").uv.foreach_set("vector", np.asarray(uvs, np.float32).ravel())
    mesh.polygons.foreach_set("use_smooth", np.full(len(faces), smooth))
    mesh.materials.append(material)
    return mesh


def _floor_mesh(material, half, cell):
    """A square with squares of `cell` metres; the picture has 8 of them a side and repeats."""
    points = [(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)]
    repeats = 2 * half / cell / 8
    return _mesh("Floor", material, points, [(0, 1, 2, 3)], [(0, 0), (repeats, 0), (repeats, repeats), (0, repeats)])


def _box_mesh(name, material, size, rows=1):
    """The whole picture on every side; `rows` scales it on the upright ones."""
    points = np.array([(x, y, z) for z in (-0.5, 0.5) for y in (-0.5, 0.5) for x in (-0.5, 0.5)]) * size
    faces = [(0, 1, 5, 4), (1, 3, 7, 5), (3, 2, 6, 7), (2, 0, 4, 6), (4, 5, 7, 6), (2, 3, 1, 0)]
    uvs = np.tile([(0, 0), (1, 0), (1, rows), (0, rows)], (6, 1))
    return _mesh(name, material, points.tolist(), faces, uvs)


def _torus_mesh(material, major, minor, around=14, across=8):
    """The picture goes four times around and once across."""
    u, v = (grid.ravel() for grid in np.meshgrid(np.arange(around), np.arange(across), indexing="ij"))
    a, b = 2 * np.pi * u / around, 2 * np.pi * v / across
    width = major + minor * np.cos(b)
    points = np.stack([width * np.cos(a), width * np.sin(a), minor * np.sin(b)], axis=-1)
    du, dv = np.array([0, 1, 1, 0]), np.array([0, 0, 1, 1])
    faces = (u[:, None] + du) % around * across + (v[:, None] + dv) % across
    uvs = np.stack([4 * (u[:, None] + du) / around, (v[:, None] + dv) / across], axis=-1)
    return _mesh("Torus", material, points.tolist(), faces.tolist(), uvs.reshape(-1, 2), smooth=True)


def _sphere_mesh(name, material, around=32, up=16):
    """Radius 1, with the texture coordinates of an analytic sphere: u = atan2(y, x) / 2π + ½, v = asin(z) / π + ½."""
    rings = [[(column, row) for column in range(around)] for row in range(1, up)]
    corners = [(0, 0), *(corner for ring in rings for corner in ring), (0, up)]
    column, row = np.array(corners).T
    a, b = 2 * np.pi * (column / around - 0.5), np.pi * (row / up - 0.5)
    points = np.stack([np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), np.sin(b)], axis=-1)

    def point(column, row):
        return 0 if row == 0 else len(corners) - 1 if row == up else 1 + (row - 1) * around + column % around

    faces, uvs = [], []
    for j in range(up):
        for i in range(around):
            quad = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
            if j == 0:
                quad.pop(1)
            elif j == up - 1:
                quad.pop(3)
            faces.append([point(*corner) for corner in quad])
            for x, y in quad:
                uvs.append(((x + (0.5 if y in (0, up) else 0)) / around, y / up))
    return _mesh(name, material, points.tolist(), faces, uvs, smooth=True)


def _monkey_mesh(material):
    """Blender's own monkey, 968 triangles, smooth, with the UV map it comes with."""
    mesh = bpy.data.meshes.new("Suzanne")
    monkey = bmesh.new()
    monkey.loops.layers.uv.new("UVMap")
    bmesh.ops.create_monkey(monkey, matrix=Matrix.Identity(4), calc_uvs=True)
    monkey.to_mesh(mesh)
    monkey.free()
    mesh.polygons.foreach_set("use_smooth", np.ones(len(mesh.polygons), bool))
    mesh.materials.append(material)
    return mesh

"""What the samples are put together from: objects, materials and meshes, all made here."""

import bmesh
import bpy
import numpy as np
from mathutils import Matrix, Vector


def add_object(scene, name, data, place=(0, 0, 0), turn=(0, 0, 0), scale=1.0):
    """turn : degrees around X, Y, Z; scale : one number or three."""
    thing = bpy.data.objects.new(name, data)
    thing.location = place
    thing.rotation_euler = np.radians(turn)
    thing.scale = np.broadcast_to(scale, 3)
    scene.collection.objects.link(thing)
    return thing


def add_sphere(scene, name, material, centre, radius, turn):
    """An analytic sphere; what the viewport shows is a stand-in with the same texture coordinates."""
    thing = add_object(scene, name, sphere_mesh(name, material), centre, turn, radius)
    thing.nonlinear_rays.analytic_sphere = True


def add_light(scene, name, kind, energy, colour, place=(0, 0, 0), rotation=(0, 0, 0)):
    data = bpy.data.lights.new(name, kind)
    data.energy = energy
    data.color = colour
    add_object(scene, name, data, place, rotation)


def add_camera(scene, place, target, lens):
    """lens : mm on a sensor 36 mm wide."""
    data = bpy.data.cameras.new("Camera")
    data.lens = lens
    data.clip_end = 1000
    camera = add_object(scene, "Camera", data, place)
    camera.rotation_euler = (Vector(target) - Vector(place)).to_track_quat("-Z", "Y").to_euler()
    scene.camera = camera


def packed_image(name, pixels):
    """Pack uint8 pixels, (height, width, 3), sRGB, as a PNG: the file refers to nothing outside itself."""
    height, width = pixels.shape[:2]
    rgba = np.ones((height, width, 4), np.float32)
    rgba[..., :3] = pixels / np.float32(255)
    image = bpy.data.images.new(name, width, height, alpha=False)
    image.pixels.foreach_set(rgba.ravel())
    image.pack()
    return image


def painted(name, pixels, roughness, specular=0.5):
    """Principled BSDF with an Image Texture as its base colour."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    surface = tree.nodes["Principled BSDF"]
    surface.inputs["Roughness"].default_value = roughness
    surface.inputs["Specular IOR Level"].default_value = specular
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image = packed_image(name, pixels)
    texture.location = (-320, 280)
    tree.nodes.active = texture  # what the viewport's Solid mode shows
    tree.links.new(texture.outputs["Color"], surface.inputs["Base Color"])
    return material


def glowing(name, pixels, strength=1.0):
    """Emission of an Image Texture: what shines by itself."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.remove(tree.nodes["Principled BSDF"])
    surface = tree.nodes.new("ShaderNodeEmission")
    surface.inputs["Strength"].default_value = strength
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image = packed_image(name, pixels)
    texture.location = (-320, 280)
    tree.nodes.active = texture
    tree.links.new(texture.outputs["Color"], surface.inputs["Color"])
    tree.links.new(surface.outputs["Emission"], tree.nodes["Material Output"].inputs["Surface"])
    return material


def sky(name, pixels, turn=(0, 0, 0)):
    """An Environment Texture, turned by a Mapping. turn : degrees."""
    world = bpy.data.worlds.new(name)
    world.use_nodes = True
    tree = world.node_tree
    texture = tree.nodes.new("ShaderNodeTexEnvironment")
    texture.image = packed_image(name, pixels)
    mapping = tree.nodes.new("ShaderNodeMapping")
    mapping.inputs["Rotation"].default_value = np.radians(turn)
    coordinates = tree.nodes.new("ShaderNodeTexCoord")
    for column, node in enumerate((texture, mapping, coordinates), start=1):
        node.location = (10 - 320 * column, 300)
    tree.links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
    tree.links.new(texture.outputs["Color"], tree.nodes["Background"].inputs["Color"])
    return world


def mesh_of(name, material, points, faces, uvs, smooth=False):
    """points : (n, 3); faces : lists of point numbers; uvs : (corners, 2), in the faces' order."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points, [], faces)
    mesh.uv_layers.new(name="UVMap").uv.foreach_set("vector", np.asarray(uvs, np.float32).ravel())
    mesh.polygons.foreach_set("use_smooth", np.full(len(faces), smooth))
    mesh.materials.append(material)
    return mesh


def floor_mesh(material, half, cell):
    """A square with squares of `cell` metres; the picture has 8 of them a side and repeats."""
    points = [(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)]
    repeats = 2 * half / cell / 8
    return mesh_of("Floor", material, points, [(0, 1, 2, 3)], [(0, 0), (repeats, 0), (repeats, repeats), (0, repeats)])


def box_mesh(name, material, size, rows=1):
    """The whole picture on every side; `rows` scales it on the upright ones."""
    points = np.array([(x, y, z) for z in (-0.5, 0.5) for y in (-0.5, 0.5) for x in (-0.5, 0.5)]) * size
    faces = [(0, 1, 5, 4), (1, 3, 7, 5), (3, 2, 6, 7), (2, 0, 4, 6), (4, 5, 7, 6), (2, 3, 1, 0)]
    uvs = np.tile([(0, 0), (1, 0), (1, rows), (0, rows)], (6, 1))
    return mesh_of(name, material, points.tolist(), faces, uvs)


def torus_mesh(material, major, minor, around=14, across=8):
    """The picture goes four times around and once across."""
    u, v = (grid.ravel() for grid in np.meshgrid(np.arange(around), np.arange(across), indexing="ij"))
    a, b = 2 * np.pi * u / around, 2 * np.pi * v / across
    width = major + minor * np.cos(b)
    points = np.stack([width * np.cos(a), width * np.sin(a), minor * np.sin(b)], axis=-1)
    du, dv = np.array([0, 1, 1, 0]), np.array([0, 0, 1, 1])
    faces = (u[:, None] + du) % around * across + (v[:, None] + dv) % across
    uvs = np.stack([4 * (u[:, None] + du) / around, (v[:, None] + dv) / across], axis=-1)
    return mesh_of("Torus", material, points.tolist(), faces.tolist(), uvs.reshape(-1, 2), smooth=True)


def ring_mesh(name, material, inner, outer, around, across):
    """A flat ring: u goes around, v from the inner rim to the outer one."""
    u, v = (grid.ravel() for grid in np.meshgrid(np.arange(around), np.arange(across), indexing="ij"))
    a, r = np.meshgrid(2 * np.pi * np.arange(around) / around, np.linspace(inner, outer, across + 1), indexing="ij")
    points = np.stack([r * np.cos(a), r * np.sin(a), 0 * r], axis=-1).reshape(-1, 3)
    du, dv = np.array([0, 0, 1, 1]), np.array([0, 1, 1, 0])
    faces = (u[:, None] + du) % around * (across + 1) + v[:, None] + dv
    uvs = np.stack([(u[:, None] + du) / around, (v[:, None] + dv) / across], axis=-1)
    return mesh_of(name, material, points.tolist(), faces.tolist(), uvs.reshape(-1, 2))


def sphere_mesh(name, material, around=32, up=16):
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
    return mesh_of(name, material, points.tolist(), faces, uvs, smooth=True)


def monkey_mesh(material):
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

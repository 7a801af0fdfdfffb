"""Straight rays against Blender's own: Cycles on the CPU, one ray through each pixel's centre.

Cycles' filter is at least 0.01 pixel wide; that limit of its property is passed by, and its rays meet the pixels'
centres to 5e-5 of a pixel, which is the rounding of its Position pass. So pictures are compared pixel by pixel. Cycles
decides which pixels lie on an edge: those whose neighbours show another object, face or depth.

Cycles' last digits differ by processor: Embree takes other instructions (and roundings) where there are fused ones. So
a bound here is what all the roundings can do at its pixel, not what they happened to do on some machine.
"""

from dataclasses import dataclass
from functools import cached_property

import bpy
import numpy as np
import OpenEXR
import pytest
from mathutils.bvhtree import BVHTree

WIDTH, HEIGHT = 192, 144
PASSES = ("Combined", "Depth", "Position", "Normal", "Object Index", "Direction", "Status")
FAR = 1e9  # metres: Cycles' depth of the background is 1e10
PASS_NAMES = {"IndexOB": "Object Index"}  # of Blender before 5.0
SINGLE = 2.0**-24  # what rounding to float32 changes, relative
HALF = 2.0**-12  # what rounding a texel in [0, 1] to a half float changes: half of the spacing of those below 1
# From a pixel to a point's weights in a triangle, in each renderer: three for the ray in the camera's axes, three to
# turn it into the world's, one for the triangle's corner, one to subtract the camera, four for two products and two
# sums of vectors. They are counted at their full size and all of one sign, as no processor makes them.
ROUNDINGS = 12


@dataclass
class Pictures:
    """Passes by name, (height, width, channels), row 0 at the bottom; the triangles that were exported; camera and
    view_axis, (3,), in world space; whether the rays are parallel.
    """

    cycles: dict[str, np.ndarray]
    ours: dict[str, np.ndarray]
    warnings: tuple[str, ...]
    triangles: object
    camera: np.ndarray
    view_axis: np.ndarray
    parallel: bool

    @property
    def hit(self):
        """Where both renderers met an object."""
        return self.cycles_hit & self.our_hit

    @property
    def cycles_hit(self):
        return self.cycles["Depth"][..., 0] < FAR

    @property
    def our_hit(self):
        return self.ours["Status"][..., 0] == 1

    @property
    def edge(self):
        """Pixels beside which Cycles shows another object, a face turned by 25 degrees, or a jump in depth of 5 %."""
        index, depth = self.cycles["Object Index"][..., 0], self.cycles["Depth"][..., 0]
        normal = self.cycles["Normal"]
        edge = np.zeros(index.shape, bool)
        for down in (-1, 0, 1):
            for across in (-1, 0, 1):
                # Around the border pixels are their own neighbours.
                rows = np.clip(np.arange(index.shape[0]) + down, 0, index.shape[0] - 1)[:, None]
                columns = np.clip(np.arange(index.shape[1]) + across, 0, index.shape[1] - 1)[None, :]
                turned = np.sum(normal * normal[rows, columns], axis=-1) < np.cos(np.radians(25))
                edge |= (index != index[rows, columns]) | (turned & self.cycles_hit)
                edge |= np.abs(depth / depth[rows, columns] - 1) > 0.05
        return edge

    @property
    def inside(self):
        """Pixels where surfaces can be compared."""
        return self.hit & ~self.edge

    @cached_property
    def beneath(self):
        """The triangles at Cycles' positions inside, all those that its rounding cannot tell apart.

        Returns firsts : (pixels,), where a pixel's triangles begin;  triangle : (n,);  height : (n,), metres, the least
        one;  weight : (n,), how far the two renderers' weights in the triangle may be apart. Their roundings move a ray
        by some length across it. In the triangle's plane that is the length over the cosine of incidence, and a weight
        falls from 1 to 0 over a height.
        """
        points = self.cycles["Position"][self.inside].astype(np.float64)
        rays = points - self.camera
        distance = np.linalg.norm(rays, axis=-1)
        moved = 2 * ROUNDINGS * SINGLE * np.maximum(distance, np.linalg.norm(self.camera))
        rays = np.broadcast_to(self.view_axis, rays.shape) if self.parallel else rays / distance[:, None]

        places = self.triangles.positions
        tree = BVHTree.FromPolygons(places.reshape(-1, 3).tolist(), np.arange(3 * len(places)).reshape(-1, 3).tolist())
        found = [[near[2] for near in tree.find_nearest_range(*at)] for at in zip(points.tolist(), moved, strict=True)]
        counts = np.array([len(triangles) for triangles in found])
        assert counts.all()  # Cycles' positions lie on our triangles
        triangle = np.concatenate(found)

        corners = places[triangle]
        face = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        area = np.linalg.norm(face, axis=-1)
        cosine = np.abs(np.sum(np.repeat(rays, counts, axis=0) * face, axis=-1)) / area
        height = area / spread(corners)
        return np.cumsum(counts) - counts, triangle, height, np.repeat(moved, counts) / (height * cosine)

    def apart(self, values):
        """values : (n, 3, k), of the triangles' corners -> (pixels inside,), how far the two renderers' interpolated
        values may be apart: by as much as their weights, for the corners' largest difference.
        """
        firsts, triangle, _height, weight = self.beneath
        return np.maximum.reduceat(weight * spread(values)[triangle], firsts)

    def tilt(self):
        """How far a flat face's normal may lean, (pixels inside,), where a renderer takes it from corners in world
        space, which it rounds (three products and their sum: four): twice their movement over the triangle's height.
        """
        firsts, triangle, height, _weight = self.beneath
        moved = 4 * SINGLE * np.linalg.norm(self.triangles.positions[triangle], axis=-1).max(axis=-1)
        return np.maximum.reduceat(2 * moved / height, firsts)


def spread(values):
    """values : (n, 3, k), of triangles' corners -> (n,), the largest difference of two corners."""
    return np.linalg.norm(values - np.roll(values, 1, axis=1), axis=-1).max(axis=-1)


@pytest.fixture
def render_both(extension, empty_file, tmp_path):
    """render_both(scene, size) -> Pictures of the open file's scene."""
    return lambda scene, size=(WIDTH, HEIGHT): both(extension, scene, tmp_path, size)


def both(extension, scene, folder, size):
    """Render with Cycles and with the extension, which reads the scene as F12 does."""
    scene.render.resolution_x, scene.render.resolution_y = size
    cycles = cycles_picture(scene, folder / "cycles.exr")
    exported, _settings = extension("addon.capture").capture(scene, scene.view_layers[0])
    settings = extension("addon.core.settings").Settings(
        passes=PASSES, filter_textures=False
    )  # Cycles does not filter them
    frame = extension("addon.core.trace").render(exported, settings)
    assert all(np.isfinite(pixels).all() for pixels in frame.passes.values())
    matrix = np.array(scene.camera.matrix_world)
    axis = -matrix[:3, 2] / np.linalg.norm(matrix[:3, 2])
    parallel = scene.camera.data.type == "ORTHO"
    return Pictures(cycles, frame.passes, frame.warnings, exported.triangles, matrix[:3, 3], axis, parallel)


def cycles_picture(scene, path, samples=1):
    """Pass name -> float32, (height, width, channels), row 0 at the bottom."""
    render, cycles, layer = scene.render, scene.cycles, scene.view_layers[0]
    render.engine = "CYCLES"
    cycles.samples, cycles.max_bounces = samples, 0
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.pixel_filter_type = "GAUSSIAN"  # BOX is always a pixel wide
    cycles["filter_width"] = 1e-7
    assert cycles.filter_width < 1e-6
    layer.use_pass_z = layer.use_pass_normal = layer.use_pass_object_index = True
    layer.use_pass_uv = layer.use_pass_position = True
    if hasattr(render.image_settings, "media_type"):
        render.image_settings.media_type = "MULTI_LAYER_IMAGE"
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR_MULTILAYER", "32"
    render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    return read_exr(path)


def read_exr(path):
    """ViewLayer.Pass.X, Y, … -> Pass: (height, width, channels); OpenEXR's row 0 is the top."""
    channels = {}
    with OpenEXR.File(str(path), separate_channels=True) as file:
        for part in file.parts:
            channels |= {name: np.array(channel.pixels) for name, channel in part.channels.items()}
    grouped = {}
    for name, pixels in channels.items():
        _layer, pass_name, letter = name.rsplit(".", 2)
        grouped.setdefault(PASS_NAMES.get(pass_name, pass_name), {})[letter] = pixels
    return {  # in the order R G B A, X Y Z, U V A
        name: np.stack([letters[letter][::-1] for letter in sorted(letters, key="RXUGYVBZA".index)], axis=-1)
        for name, letters in grouped.items()
    }


# Scenes


def emission(name, image=None, color=(1.0, 1.0, 1.0), extension="REPEAT", interpolation="Linear"):
    """A material that shows its image, or its colour, as radiance."""
    material, output = empty_material(name)
    tree = material.node_tree
    surface = tree.nodes.new("ShaderNodeEmission")
    surface.inputs["Color"].default_value = (*color, 1.0)
    surface.inputs["Strength"].default_value = 1.0
    tree.links.new(surface.outputs[0], output.inputs["Surface"])
    if image is not None:
        texture = tree.nodes.new("ShaderNodeTexImage")
        texture.image, texture.extension, texture.interpolation = image, extension, interpolation
        tree.links.new(texture.outputs["Color"], surface.inputs["Color"])
    return material


def diffuse(name, color):
    material, output = empty_material(name)
    surface = material.node_tree.nodes.new("ShaderNodeBsdfDiffuse")
    surface.inputs["Color"].default_value = (*color, 1.0)
    material.node_tree.links.new(surface.outputs[0], output.inputs["Surface"])
    return material


def empty_material(name):
    material = bpy.data.materials.new(name)
    if material.node_tree is None:
        material.use_nodes = True
    material.node_tree.nodes.clear()
    return material, material.node_tree.nodes.new("ShaderNodeOutputMaterial")


def new_image(name, pixels, *, is_float=False, space="Non-Color"):
    """pixels : (height, width, 3 or 4), as stored, row 0 at the bottom."""
    height, width, channels = pixels.shape
    rgba = np.ones((height, width, 4), np.float32)
    rgba[..., :channels] = pixels
    image = bpy.data.images.new(name, width, height, alpha=True, float_buffer=is_float)
    image.colorspace_settings.name = space
    image.pixels.foreach_set(rgba.ravel())
    image.pack()
    return image


def noise(size=16, seed=1):
    """Bytes without order: a texture read at a wrong place shows a wrong value."""
    return np.random.default_rng(seed).integers(0, 256, (size, size, 3)) / np.float32(255)


def add(operator, index, material, *, smooth=False, **placing):
    """A primitive with a pass index and a material; the object is returned."""
    operator(**placing)
    obj = bpy.context.object
    obj.pass_index = index
    obj.data.materials.append(material)
    if smooth:
        obj.data.shade_smooth()
    return obj


def add_camera(scene, place=(6.0, -8.0, 4.0), turn=(1.17, 0.02, 0.64)):
    data = bpy.data.cameras.new("Camera")
    camera = bpy.data.objects.new("Camera", data)
    camera.location, camera.rotation_euler = place, turn
    data.lens = 40.0
    scene.collection.objects.link(camera)
    scene.camera = camera
    return camera


def many_meshes(scene):
    """What the export must get right: transforms, modifiers, instances, mirrors, slots, visibility for render."""
    mesh = bpy.ops.mesh
    chart = emission("Chart", new_image("Noise", noise()))
    add(mesh.primitive_plane_add, 1, chart, size=12, location=(0, 0, -1.3))

    cube = add(mesh.primitive_cube_add, 2, chart, size=1, location=(-2.2, 0.8, 0), rotation=(0.4, 0.3, 1.1))
    cube.scale = (2.0, 0.8, 1.4)

    suzanne = add(mesh.primitive_monkey_add, 3, chart, location=(0, -0.8, 0.2), rotation=(0.1, -0.2, 0.7), smooth=True)
    subdivision = suzanne.modifiers.new("Subdivision", "SUBSURF")
    subdivision.levels, subdivision.render_levels = 0, 1  # only the render's are right

    mirrored = add(mesh.primitive_torus_add, 4, chart, location=(2.6, 1.6, 0.3), rotation=(1.0, 0.2, 0.4), smooth=True)
    mirrored.scale = (-0.9, 0.9, 0.9)

    two = add(mesh.primitive_cube_add, 5, emission("Red", color=(0.7, 0.1, 0.05)), size=1, location=(2.4, -1.6, -0.7))
    two.data.materials.append(emission("Blue", color=(0.05, 0.2, 0.6)))
    two.data.polygons.foreach_set("material_index", [0, 1, 0, 1, 1, 0])

    behind = add(mesh.primitive_plane_add, 6, chart, size=2, location=(-0.5, 3.2, 0.6))
    behind.rotation_euler = (-1.3, 0.0, 0.3)  # its back is what the camera sees

    instanced = bpy.data.collections.new("Instanced")
    for number, operator in enumerate((mesh.primitive_cone_add, mesh.primitive_ico_sphere_add)):
        obj = add(operator, 7 + number, chart, location=(1.2 * number, 0, 0), rotation=(0.3, 0, 0), smooth=bool(number))
        scene.collection.objects.unlink(obj)
        instanced.objects.link(obj)
    for place, turn in (((-3.4, -1.8, -0.6), 0.5), ((0.8, 3.2, 1.4), 2.5)):
        empty = bpy.data.objects.new("Instances", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", instanced
        empty.location, empty.rotation_euler, empty.scale = place, (0.2, 0.1, turn), (0.5, 0.5, 0.5)
        scene.collection.objects.link(empty)

    text = bpy.data.curves.new("Text", "FONT")
    text.body, text.extrude = "rays", 0.1
    words = bpy.data.objects.new("Text", text)
    words.pass_index, words.location, words.rotation_euler = 9, (-1.6, -2.6, -1.0), (1.2, 0, 0.4)
    text.materials.append(emission("Yellow", color=(0.8, 0.6, 0.02)))
    scene.collection.objects.link(words)

    hidden = add(mesh.primitive_cube_add, 10, chart, size=3, location=(2, -3, 1))
    hidden.hide_render = True
    shown = add(mesh.primitive_uv_sphere_add, 11, chart, radius=0.6, location=(0.9, 0.3, 1.9), smooth=True)
    shown.hide_viewport = True


def shifted(scene):
    scene.camera.data.shift_x, scene.camera.data.shift_y = 0.17, -0.11


def tall_pixels(scene):
    scene.render.pixel_aspect_x, scene.render.pixel_aspect_y = 1.0, 1.6


def wide_pixels_fitted_upright(scene):
    scene.render.pixel_aspect_x = 1.5
    scene.camera.data.sensor_fit, scene.camera.data.sensor_height = "VERTICAL", 22.0
    scene.camera.data.shift_x = -0.08


def fitted_across(scene):
    scene.camera.data.sensor_fit, scene.camera.data.sensor_width = "HORIZONTAL", 30.0


def cropped(scene):
    render = scene.render
    render.use_border = render.use_crop_to_border = True
    render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = 0.22, 0.71, 0.13, 0.88


def scaled_camera(scene):
    scene.camera.scale = (3.0, 0.5, 2.0)


def mirrored_camera(scene):
    scene.camera.scale = (-1.0, 1.0, 1.0)


def parallel(scene):
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", 7.5


def parallel_shifted_tall(scene):
    parallel(scene)
    tall_pixels(scene)
    shifted(scene)


VIEWS = {
    "plain": (None, (WIDTH, HEIGHT)),
    "shifted lens": (shifted, (WIDTH, HEIGHT)),
    "tall pixels": (tall_pixels, (WIDTH, HEIGHT)),
    "tall picture": (None, (HEIGHT, WIDTH)),
    "sensor fit vertical, wide pixels": (wide_pixels_fitted_upright, (WIDTH, HEIGHT)),
    "sensor fit horizontal, tall picture": (fitted_across, (HEIGHT, WIDTH)),
    "border": (cropped, (WIDTH, HEIGHT)),
    "scaled camera": (scaled_camera, (WIDTH, HEIGHT)),
    "mirrored camera": (mirrored_camera, (WIDTH, HEIGHT)),
    "orthographic": (parallel, (WIDTH, HEIGHT)),
    "orthographic, shifted, tall": (parallel_shifted_tall, (HEIGHT, WIDTH)),
}


@pytest.fixture(scope="module", params=VIEWS, ids=lambda name: name.replace(", ", "_").replace(" ", "_"))
def view(request, extension, tmp_path_factory):
    """Pictures of the scene of many meshes, seen by one kind of camera."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    add_camera(scene)
    many_meshes(scene)
    change, size = VIEWS[request.param]
    if change is not None:
        change(scene)
    return both(extension, scene, tmp_path_factory.mktemp("cycles"), size)


def test_the_hit_mask_is_cycles_own(view):
    """No pixel inside an outline may differ, and 1 % of all: two renderers round an edge each in its own way."""
    assert view.ours["Status"].shape == view.cycles["Depth"].shape
    assert 0.5 < view.cycles_hit.mean() < 0.95 and view.edge.mean() < 0.25 and view.warnings == ()
    wrong = view.cycles["Object Index"] != view.ours["Object Index"]
    wrong = wrong[..., 0] | (view.cycles_hit != view.our_hit)
    assert not (wrong & ~view.edge).any()
    assert wrong.mean() < 0.01


def test_everything_was_seen(view, request):
    if "plain" in request.node.name:
        assert set(np.unique(view.ours["Object Index"])) == {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 11}


def test_depth_and_position(view):
    """Issue #2 asks for 1e-4. Single precision gives less: what roundings do to a place in a triangle, pixel by pixel.
    They have either sign, and 24 leave √(24 / 3) = 3 as their root mean square: nine pixels in ten stay below 12, even
    on surfaces that are seen at 15 degrees. Of these numbers few are above 14 m.
    """
    allowed = view.apart(view.triangles.positions)
    depth = (view.ours["Position"] - view.camera) @ view.view_axis
    distance = np.linalg.norm(view.ours["Position"] - view.cycles["Position"], axis=-1)[view.inside]
    for error in (np.abs(depth - view.cycles["Depth"][..., 0])[view.inside], distance):
        assert (error < allowed).all()
        assert np.percentile(error, 90) < ROUNDINGS * SINGLE * 14


def packing():
    """How far Cycles turns a corner's normal from Blender 5 on, where it packs it twice, in the mesh's axes and in the
    world's, into the two coordinates of an octahedron's net, 16 bits over [-1, 1] each. These move by half of a step,
    and by 1e-6 that Cycles adds to what it divides by. A normal in the middle of a face, |x| = |y| = |z|, turns by √18
    times as much if both move alike: (1, 1, -2) over the length there, 1 / √3.
    """
    return 2 * np.sqrt(18) * (2.0**-16 + 1e-6) if bpy.app.version >= (5, 0) else 0.0


def test_normals(view):
    """A smooth normal turns with the weights of its corners' normals, which may be packed, and the more so, the shorter
    it was before it is made unit; a flat one leans as its corners are rounded; and a dozen roundings make them unit. On
    a large flat face less than 2e-6 is left.
    """
    between = spread(view.triangles.normals)[view.beneath[1]].max()
    shortest = np.sqrt(1 - between**2 / 3)  # in the middle of three that differ by as much
    turned = (view.apart(view.triangles.normals) + packing()) / shortest
    error = np.linalg.norm(view.ours["Normal"] - view.cycles["Normal"], axis=-1)[view.inside]
    assert (error < turned + view.tilt() + ROUNDINGS * SINGLE).all()


def test_textures_lie_where_cycles_puts_them(view):
    """Texels are noise, so that a texture at a wrong place shows. A texel's half float, and the weights of the corners'
    UVs, on 16 texels with steps of up to 1 along both axes, are all that may differ.
    """
    allowed = HALF + 16 * np.sqrt(2) * view.apart(view.triangles.uvs) + ROUNDINGS * SINGLE
    error = np.abs(view.ours["Combined"] - view.cycles["Combined"])[view.inside]
    assert (error[:, :3].max(axis=-1) < allowed).all()
    shown = view.ours["Combined"][view.inside][:, :3]
    assert shown.std() > 0.15


# Images


def turned_uvs(points):
    """(n, 2) in [-1, 1] -> UVs that lie askew and leave [0, 1] on all sides."""
    x, y = points.T
    return np.stack([0.4 + 1.2 * x - 0.5 * y, 0.55 + 0.4 * x + 1.1 * y], axis=-1)


def show(scene, material):
    """Fill the picture with a plane that has turned_uvs."""
    plane = add(bpy.ops.mesh.primitive_plane_add, 1, material, size=2)
    places = np.array([plane.data.vertices[loop.vertex_index].co[:2] for loop in plane.data.loops])
    plane.data.uv_layers.active.uv.foreach_set("vector", turned_uvs(places).astype(np.float32).ravel())
    add_camera(scene, (0, 0, 3), (0, 0, 0))
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", 2.0


def between_texels(uvs, size):
    """Where a ray meets the border of two texels to 1e-3 of one: rounding decides which it is."""
    at = uvs * size
    return (np.abs(at - np.round(at)) < 1e-3).any(axis=-1)


@pytest.mark.parametrize("extension_mode", ["REPEAT", "EXTEND", "CLIP", "MIRROR"])
@pytest.mark.parametrize(
    ("interpolation", "space"), [("Linear", "Non-Color"), ("Closest", "Non-Color"), ("Closest", "sRGB")]
)
def test_images_are_sampled_as_in_cycles(empty_file, render_both, interpolation, space, extension_mode):
    image = new_image("Noise", noise(), space=space)
    show(empty_file, emission("Noise", image, extension=extension_mode, interpolation=interpolation))
    pictures = render_both(empty_file, (128, 128))
    assert pictures.hit.all()
    uvs = pictures.cycles["UV"][..., :2]
    assert uvs.min() < -0.5 and uvs.max() > 1.5
    kept = ~between_texels(uvs, 16) if interpolation == "Closest" else pictures.hit
    assert kept.mean() > 0.98
    error = np.abs(pictures.ours["Combined"] - pictures.cycles["Combined"])[kept]
    assert error.max() < HALF + 16 * 12 * SINGLE


def test_float_images(empty_file, render_both):
    """Values up to 3: below 4, a half float is off by up to 2^-10."""
    show(empty_file, emission("Bright", new_image("Bright", 3 * noise(), is_float=True)))
    pictures = render_both(empty_file, (128, 128))
    error = np.abs(pictures.ours["Combined"] - pictures.cycles["Combined"])
    assert error.max() < 2.0**-10 + 3 * 16 * 12 * SINGLE


def linear(values):
    """The sRGB transfer function of IEC 61966-2-1, float64."""
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def bilinear(texels, uvs):
    """texels : (size, size, 3), repeated;  uvs : (…, 2) -> (…, 3), float64."""
    size = len(texels)
    at = uvs.astype(np.float64) * size - 0.5
    corner = np.floor(at).astype(int)
    right, up = np.moveaxis((at - corner)[..., None], -2, 0)
    column, row = corner[..., 0] % size, corner[..., 1] % size
    next_column, next_row = (column + 1) % size, (row + 1) % size
    below = texels[row, column] * (1 - right) + texels[row, next_column] * right
    above = texels[next_row, column] * (1 - right) + texels[next_row, next_column] * right
    return below * (1 - up) + above * up


def test_between_srgb_texels_light_is_mixed_where_cycles_mixes_the_bytes(empty_file, render_both):
    """Cycles interpolates sRGB bytes and makes the result linear; here, as in EEVEE, light is interpolated. The texels
    themselves are the same (above); each picture is what the renderer's order of the two steps gives at Cycles' UVs.
    """
    texels = noise().astype(np.float64)
    show(empty_file, emission("Noise", new_image("Noise", noise(), space="sRGB")))
    pictures = render_both(empty_file, (128, 128))
    uvs = pictures.cycles["UV"][..., :2]
    rounding = 2.3 * 16 * 12 * SINGLE  # the transfer function is nowhere steeper than 2.3
    np.testing.assert_allclose(pictures.cycles["Combined"][..., :3], linear(bilinear(texels, uvs)), atol=rounding)
    np.testing.assert_allclose(pictures.ours["Combined"][..., :3], bilinear(linear(texels), uvs), atol=HALF + rounding)


@pytest.mark.parametrize("mode", ["STRAIGHT", "CHANNEL_PACKED", "NONE"])
def test_transparent_parts_of_an_image_are_black_where_alpha_is_not_used(empty_file, render_both, mode):
    """For alpha 0 and 1. In between Cycles multiplies the sRGB bytes by alpha; here light is, as in EEVEE."""
    cover = (noise(seed=2)[..., :1] > 0.5).astype(np.float32)
    image = new_image("Holes", np.concatenate([noise(), cover], axis=-1), space="sRGB")
    image.alpha_mode = mode
    show(empty_file, emission("Holes", image, interpolation="Closest"))
    pictures = render_both(empty_file, (128, 128))
    kept = ~between_texels(pictures.cycles["UV"][..., :2], 16)
    np.testing.assert_allclose(pictures.ours["Combined"][kept], pictures.cycles["Combined"][kept], atol=HALF)
    black = (pictures.ours["Combined"][kept][:, :3] == 0).all(axis=-1).mean()
    assert (0.3 < black < 0.7) if mode == "STRAIGHT" else black < 0.05


def test_float_images_with_alpha_show_the_light_that_they_hold(empty_file, render_both):
    """Premultiplied, as in an EXR: light without cover, such as a flame's, stays."""
    pixels = np.concatenate([noise(), noise(seed=2)[..., :1]], axis=-1)
    pixels[:8, :, 3] = 0.0
    image = new_image("Flame", pixels, is_float=True)
    image.alpha_mode = "PREMUL"
    show(empty_file, emission("Flame", image, interpolation="Closest"))
    pictures = render_both(empty_file, (128, 128))
    kept = ~between_texels(pictures.cycles["UV"][..., :2], 16)
    np.testing.assert_allclose(pictures.ours["Combined"][kept], pictures.cycles["Combined"][kept], atol=HALF)


# The world


def smooth_sky(width, height):
    """Equirectangular, (height, width, 3): 0.6 + 0.4 times the direction's x, y, z."""
    longitude = (0.5 - (np.arange(width) + 0.5) / width) * 2 * np.pi
    latitude = (((np.arange(height) + 0.5) / height - 0.5) * np.pi)[:, None]
    x, y = np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude)
    return 0.6 + 0.4 * np.stack([x, y, np.broadcast_to(np.sin(latitude), x.shape)], axis=-1)


def environment_texture(scene, image, strength, kind, rotation, scale):
    scene.world = bpy.data.worlds.new("Sky")
    if scene.world.node_tree is None:
        scene.world.use_nodes = True
    tree = scene.world.node_tree
    background = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeBackground")
    background.inputs["Strength"].default_value = strength
    texture, mapping, coordinates = (
        tree.nodes.new(f"ShaderNode{name}") for name in ("TexEnvironment", "Mapping", "TexCoord")
    )
    texture.image, mapping.vector_type = image, kind
    mapping.inputs["Rotation"].default_value, mapping.inputs["Scale"].default_value = rotation, scale
    tree.links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
    tree.links.new(texture.outputs["Color"], background.inputs["Color"])


@pytest.mark.parametrize("turn", [(1.2, 0, 0.3), (2.6, 0, 0.3), (0.4, 0.3, 2.0)])
@pytest.mark.parametrize(
    ("kind", "rotation", "scale"),
    [
        ("POINT", (0, 0, 0), (1, 1, 1)),
        ("POINT", (0.3, -0.5, 1.1), (1, 1, 1)),
        ("TEXTURE", (0.3, -0.5, 1.1), (1, 1, 1)),
        ("VECTOR", (0.3, -0.5, 1.1), (1, 1.5, 1)),
    ],
)
def test_the_sky_is_cycles_sky(empty_file, render_both, kind, rotation, scale, turn):
    """Linear interpolation over a distance d of a function f is off by up to d² |f''| / 8 along each of two axes. Here
    |f''| ≤ 0.4 strength. Both renderers interpolate in a picture of 512 × 256 pixels, and we once more in a cube of
    128 texels a side: 2 / 128 at a face's middle. A GPU may weigh texels in steps of 1 / 256. Within half a texel of a
    face's edge OpenGL mixes in texels of the next face, with a weight of up to a half, and these lie up to half a texel
    aside, because a face's rows bend at its edge: |f'| ≤ 0.4 strength makes that 0.4 strength (1 / 128) / 2.
    """
    strength, width, height = 1.7, 512, 256
    image = new_image("Sky", smooth_sky(width, height), is_float=True, space="Linear Rec.709")
    environment_texture(empty_file, image, strength, kind, rotation, scale)
    add_camera(empty_file, (0, 0, 0), turn).data.lens = 10
    pictures = render_both(empty_file, (128, 128))
    assert not pictures.our_hit.any() and pictures.warnings == ()
    # Within two pixels of the picture's poles Cycles mixes in the opposite pole, which its own blue does not tell.
    sine = (pictures.ours["Combined"][..., 2] / strength - 0.6) / 0.4
    kept = np.abs(sine) < np.cos(2 * np.pi / height)
    assert kept.mean() > 0.98
    error = np.abs(pictures.ours["Combined"] - pictures.cycles["Combined"])[..., :3].max(axis=-1)
    gradient = 0.4 * strength * max(scale)  # what is squeezed is steeper, and bends more
    interpolated = 2 * 2 * (np.pi / height) ** 2 + 2 * (2 / 128) ** 2
    bound = gradient * (max(scale) * interpolated / 8 + (2 / 128) / 512)
    components = np.sort(np.abs(pictures.ours["Direction"]), axis=-1)
    seam = components[..., 1] / components[..., 2] > 1 - 1 / 128
    assert 0 < seam.mean() < 0.05
    assert error[kept & ~seam].max() < bound
    assert error[kept & seam].max() < bound + gradient / 128 / 2


# Lights


def lamp(scene, kind, energy):
    data = bpy.data.lights.new("Lamp", kind)
    data.energy, data.color = energy, (1.0, 0.8, 0.5)
    if kind == "SUN":
        data.angle = 0.0
    elif kind == "AREA":
        data.size = 0.01
    else:
        data.shadow_soft_size = 0.0
    if kind == "SPOT":
        data.spot_size, data.spot_blend = 0.7, 0.4
    obj = bpy.data.objects.new("Lamp", data)
    obj.location, obj.rotation_euler, obj.visible_camera = (1.0, -0.5, 2.5), (0.25, 0.35, 0.1), False
    scene.collection.objects.link(obj)


@pytest.mark.parametrize(("kind", "energy"), [("POINT", 100), ("SUN", 3), ("SPOT", 100), ("AREA", 100)])
def test_a_lone_diffuse_plane_is_lit_as_in_cycles(empty_file, render_both, kind, energy):
    """Nothing throws a shadow and there is one light: Cycles' one sample has no noise. Only the area light's has, which
    we take for a point: 0.01 m wide and 2.4 m away or more, its place moves by 0.007 m, and radiance goes with the
    distance squared and two cosines: 4 × 0.007 / 2.4.
    """
    add_camera(empty_file)
    add(bpy.ops.mesh.primitive_plane_add, 1, diffuse("Grey", (0.8, 0.5, 0.3)), size=8, rotation=(0.1, 0.2, 0))
    lamp(empty_file, kind, energy)
    pictures = render_both(empty_file)
    ours, cycles = (passes["Combined"][pictures.hit][:, :3] for passes in (pictures.ours, pictures.cycles))
    assert len(ours) > 0.4 * WIDTH * HEIGHT and pictures.warnings == ()
    # A spot's edge is as steep as 1.5 / ((1 - cos 0.35) 0.4) for a cosine of single precision.
    bound = {"AREA": 4 * 0.007 / 2.4, "SPOT": 12 * SINGLE * 1.5 / (0.4 * (1 - np.cos(0.35)))}.get(kind, 0.0)
    assert np.abs(ours - cycles).max() < (bound + 64 * SINGLE) * cycles.max()


def test_a_diffuse_plane_under_a_sky_of_one_colour(empty_file, tmp_path, extension):
    """Ambient light: colour times radiance. Cycles' noise in the mean of 8 million samples is below 1e-3."""
    empty_file.world = bpy.data.worlds.new("Grey")
    if empty_file.world.node_tree is None:
        empty_file.world.use_nodes = True
    background = next(n for n in empty_file.world.node_tree.nodes if n.bl_idname == "ShaderNodeBackground")
    background.inputs["Color"].default_value = (0.5, 0.7, 0.9, 1.0)
    add_camera(empty_file, (0, 0, 3), (0, 0, 0))
    add(bpy.ops.mesh.primitive_plane_add, 1, diffuse("Grey", (0.8, 0.5, 0.3)), size=8)
    pictures = both(extension, empty_file, tmp_path, (128, 64))
    assert pictures.hit.all()
    cycles = cycles_picture(empty_file, tmp_path / "ambient.exr", samples=1024)["Combined"][..., :3]
    np.testing.assert_allclose(pictures.ours["Combined"][0, 0, :3], np.array([0.5, 0.7, 0.9]) * (0.8, 0.5, 0.3), 1e-6)
    np.testing.assert_allclose(cycles.mean(axis=(0, 1)), pictures.ours["Combined"][0, 0, :3], rtol=1e-3)

"""What is right, without the shaders: closed forms, and a ray caster in float64 numpy."""

from dataclasses import dataclass

import mpmath
import numpy as np
from scipy.integrate import solve_ivp

CRITICAL = 3.0 * np.sqrt(3.0)  # impact parameter of the photon sphere, in M
NONE = -1


def darwin(b):
    """Deflection of light, radians, by a mass of 1 at impact parameter b > 3 sqrt 3: Darwin 1959."""
    b = mpmath.mpf(b)
    r0 = 2 * b / mpmath.sqrt(3) * mpmath.cos(mpmath.acos(-3 * mpmath.sqrt(3) / b) / 3)
    q = mpmath.sqrt((r0 - 2) * (r0 + 6))
    m = (q - r0 + 6) / (2 * q)
    chi = mpmath.asin(mpmath.sqrt((q - r0 + 2) / (q - r0 + 6)))
    return float(4 * mpmath.sqrt(r0 / q) * (mpmath.ellipk(m) - mpmath.ellipf(chi, m)) - mpmath.pi)


def shadow_angle(r, observer):
    """Angular radius, radians, of the shadow of a mass of 1 for a camera at r: physics.md, Synge 1966."""
    sine_squared = {"static": 27 * (1 - 2 / r) / r**2, "chart": 27 / (r**2 + 54 / r)}[observer]
    return float(np.arcsin(np.sqrt(sine_squared)))


def path(model, states, length, **options):
    """(n, 6) -> (steps + 1, n, 6), on the way to tau = length: DOP853 in float64 on the model's own right-hand side,
    all states as one system.  options : those of solve_ivp
    """
    solved = solve_ivp(
        lambda tau, flat: model.rhs(flat.reshape(-1, 6)).ravel(),
        (0.0, length),
        np.asarray(states, np.float64).ravel(),
        "DOP853",
        **{"rtol": 1e-12, "atol": 1e-13} | options,
    )
    return solved.y.T.reshape(len(solved.t), -1, 6)


def integrate(model, states, length):
    """(n, 6) after tau = length."""
    return path(model, states, length)[-1]


def at_infinity(model, positions, directions):
    """(n, 3): unit directions far away of rays of the chart that leave, by float64."""
    starts = model.initial_states(np.asarray(positions, float), np.asarray(directions, float))
    ends = [path(model, start[None], 1e9, atol=1e-14, t_eval=[1e9])[-1] for start in starts]
    return model.ray_directions(np.concatenate(ends))


def directions_there(model, positions, far):
    """(n, 3): unit directions in the chart, at positions on the way out, of rays that end in the directions `far`."""
    there = far = np.asarray(far, float)
    for _ in range(3):  # each leaves the turn's square
        there = there + far - at_infinity(model, positions, there)
        there = there / np.linalg.norm(there, axis=1, keepdims=True)
    return there


def camera_rays(camera):
    """Origins and unit directions, float64, (rows, columns, 3), world space, of the pixels' centres."""
    left, right, bottom, top = camera.window
    x0, y0, x1, y1 = camera.pixel_box
    x = left + (np.arange(x0, x1) + 0.5) * (right - left) / camera.width
    y = bottom + (np.arange(y0, y1) + 0.5) * (top - bottom) / camera.height
    x, y = np.meshgrid(x, y)
    rotation, position = camera.world_from_camera[:3, :3], camera.world_from_camera[:3, 3]
    if camera.kind == "ORTHOGRAPHIC":
        origins = np.stack([x, y, 0 * x], axis=-1) @ rotation.T + position
        return origins, np.broadcast_to(-rotation[:, 2], origins.shape)
    directions = np.stack([x, y, -np.ones_like(x)], axis=-1) @ rotation.T
    return np.broadcast_to(position, directions.shape), directions / np.linalg.norm(directions, axis=-1, keepdims=True)


@dataclass
class Cast:
    """What straight rays meet first; (rows, columns, …). index : row of triangles, or of spheres; NONE for no hit.

    margin : how far, in barycentric weights (or radii, for spheres), the nearest decision was from going the other way
    """

    distance: np.ndarray
    is_sphere: np.ndarray
    index: np.ndarray
    weights: np.ndarray
    position: np.ndarray
    normal: np.ndarray
    uv: np.ndarray
    object_index: np.ndarray
    margin: np.ndarray

    @property
    def hit(self):
        return self.index != NONE


def cast(scene):
    """Every pixel's ray against every object, in world space and float64, by solving the 3 x 3 system (no Moeller and
    Trumbore) and the quadratic equation.
    """
    origins, directions = camera_rays(scene.camera)
    shape = origins.shape[:2]
    origins, directions = origins.reshape(-1, 3), directions.reshape(-1, 3)
    n = len(origins)
    best = Cast(
        np.full(n, np.inf), np.zeros(n, bool), np.full(n, NONE), np.zeros((n, 3)), np.zeros((n, 3)),
        np.zeros((n, 3)), np.zeros((n, 2)), np.zeros(n), np.full(n, np.inf),
    )  # fmt: skip
    for row in range(len(scene.triangles)):
        _cast_triangle(scene.triangles, row, origins, directions, best)
    for row in range(len(scene.spheres)):
        _cast_sphere(scene.spheres, row, origins, directions, best)
    values = {name: value.reshape(*shape, *value.shape[1:]) for name, value in vars(best).items()}
    return Cast(**values)


def _cast_triangle(triangles, row, origins, directions, best):
    a, b, c = triangles.positions[row]
    matrix = np.stack(np.broadcast_arrays(b - a, c - a, -directions), axis=-1)  # columns
    regular = np.abs(np.linalg.det(matrix)) > 1e-300
    solution = np.full((len(origins), 3), np.nan)
    solution[regular] = np.linalg.solve(matrix[regular], (origins - a)[regular][..., None])[..., 0]
    u, v, t = solution.T
    with np.errstate(invalid="ignore"):
        inside = (u >= 0) & (v >= 0) & (u + v <= 1) & (t >= 0)
        edge = np.min(np.abs([u, v, 1 - u - v]), axis=0)
        near = (np.min([u, v, 1 - u - v], axis=0) > -0.1) & (t >= -0.1)
        best.margin[near] = np.minimum(best.margin, edge)[near]
        closer = inside & (t < best.distance)
    weights = np.stack([1 - u - v, u, v], axis=-1)
    best.distance[closer] = t[closer]
    best.is_sphere[closer], best.index[closer] = False, row
    best.weights[closer] = weights[closer]
    best.position[closer] = (origins + t[:, None] * directions)[closer]
    normal = weights @ triangles.normals[row].astype(np.float64)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    behind = directions @ np.cross(b - a, c - a) > 0  # the corners run clockwise as seen
    best.normal[closer] = np.where(behind[:, None], -normal, normal)[closer]
    best.uv[closer] = (weights @ triangles.uvs[row].astype(np.float64))[closer]
    best.object_index[closer] = triangles.object_index[row]


def _cast_sphere(spheres, row, origins, directions, best):
    centre, radius = spheres.centres[row], spheres.radii[row]
    half_b = np.sum((origins - centre) * directions, axis=1)
    c = np.sum((origins - centre) ** 2, axis=1) - radius**2
    discriminant = half_b**2 - c
    margin = np.abs(discriminant) / radius**2
    best.margin[half_b < 0] = np.minimum(best.margin, margin)[half_b < 0]
    root = np.sqrt(np.maximum(discriminant, 0))
    t = np.where(-half_b - root >= 0, -half_b - root, -half_b + root)
    closer = (discriminant >= 0) & (t >= 0) & (t < best.distance)
    best.distance[closer] = t[closer]
    best.is_sphere[closer], best.index[closer] = True, row
    best.position[closer] = (origins + t[:, None] * directions)[closer]
    outward = (origins + t[:, None] * directions - centre) / radius
    own = outward @ spheres.axes[row].T
    facing = np.where(np.sum(outward * directions, axis=1, keepdims=True) > 0, -outward, outward)
    best.normal[closer] = facing[closer]
    uv = np.stack(
        [np.arctan2(own[:, 1], own[:, 0]) / (2 * np.pi) + 0.5, np.arcsin(np.clip(own[:, 2], -1, 1)) / np.pi + 0.5]
    )
    best.uv[closer] = uv.T[closer]
    best.object_index[closer] = spheres.object_index[row]


def folded_index(i, size, extension):
    """Texel index -> index in the image, or -1 outside of a clipped one."""
    if extension == "REPEAT":
        return np.mod(i, size)
    if extension == "MIRROR":
        j = np.mod(i, 2 * size)
        return np.where(j < size, j, 2 * size - 1 - j)
    if extension == "CLIP":
        return np.where((i < 0) | (i >= size), -1, i)
    return np.clip(i, 0, size - 1)


def sample(image, uv):
    """float64, (n, 4): the image at uv, (n, 2), as Blender looks it up."""
    height, width, _ = image.pixels.shape

    def fetch(column, row):
        column = folded_index(column, width, image.extension)
        row = folded_index(row, height, image.extension)
        found = image.pixels[row, column].astype(np.float64)
        found[(column < 0) | (row < 0)] = 0.0
        return found

    at = np.asarray(uv, np.float64) * (width, height)
    if image.interpolation == "CLOSEST":
        return fetch(*np.floor(at).astype(int).T)
    corner = np.floor(at - 0.5).astype(int)
    weight = at - 0.5 - corner
    (x, y), (s, t) = corner.T, weight.T[..., None]
    below = fetch(x, y) * (1 - s) + fetch(x + 1, y) * s
    above = fetch(x, y + 1) * (1 - s) + fetch(x + 1, y + 1) * s
    return below * (1 - t) + above * t


def radiance(scene, material, position, normal, view, uv=(0.5, 0.5)):
    """(3,): Section 3.4 in Blender's units, in world space; lamps of watts, suns of W/m^2, no shadows."""
    base = np.array(material.base_color, float)
    emission = np.array(material.emission, float)
    if material.base_image is not None:
        base = base * sample(scene.images[material.base_image], [uv])[0, :3]
    if material.emission_image is not None:
        emission = emission * sample(scene.images[material.emission_image], [uv])[0, :3]
    out = emission + base * np.array(scene.ambient)
    for light in scene.lights:
        power = np.array(light.power, float)
        away = np.array(light.direction, float)
        if light.kind == "SUN":
            towards, irradiance = -away, power
        else:
            gap = np.array(light.position) - position
            distance = np.linalg.norm(gap)
            towards = gap / distance
            on_axis = -towards @ away
            if light.kind == "AREA":  # Lambert: the flux P is pi times the intensity on the axis
                irradiance = power / np.pi * max(on_axis, 0) / distance**2
            else:
                irradiance = power / (4 * np.pi) / distance**2
            if light.kind == "SPOT":
                edge, full = light.spot_cosines
                s = np.clip((on_axis - edge) / (full - edge), 0, 1)
                irradiance = irradiance * s * s * (3 - 2 * s)
        cosine = normal @ towards
        if cosine <= 0:
            continue
        reflectance = base / np.pi
        if material.specular > 0:
            half = (towards + view) / np.linalg.norm(towards + view)
            exponent = max(2 / max(material.roughness**2, 1e-3) ** 2 - 2, 1)
            # Blinn-Phong, normalised: (n + 8) / 8 pi; Principled's specular 0.5 is a reflectance of 0.04.
            highlight = (exponent + 8) / (8 * np.pi) * max(normal @ half, 0) ** exponent
            reflectance = reflectance + 0.08 * material.specular * highlight
        out = out + reflectance * cosine * irradiance
    return out

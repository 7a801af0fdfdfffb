"""The samples' pictures, from numpy and a fixed seed: nothing is downloaded.

Every function returns uint8, (height, width, 3), sRGB, row 0 at the bottom, as in Blender.
"""

import colorsys

import numpy as np

SEED = 2004


def checkerboard(first, second, cells=8, size=256):
    """Squares of two colours, three bytes each."""
    cell = np.arange(size) * cells // size
    odd = (cell[:, None] + cell[None, :]) % 2 == 1
    return np.where(odd[..., None], np.uint8(second), np.uint8(first))


def stripes(first, second, count=8, size=256):
    """Upright stripes: meridians on a sphere; one thin dark parallel in the middle shows its equator."""
    odd = (np.arange(size) * count // size) % 2 == 1
    picture = np.repeat(np.where(odd[None, :, None], np.uint8(second), np.uint8(first)), size, axis=0)
    picture[np.abs(np.arange(size) - size / 2 + 0.5) < size / 40] = (30, 30, 34)
    return picture


def uv_grid(cells=8, size=256):
    """The hue tells u, the lightness tells v: every cell of the grid is told from every other."""
    picture = np.empty((size, size, 3), np.uint8)
    cell = np.arange(size) * cells // size
    for row in range(cells):
        for column in range(cells):
            lightness = 0.30 + 0.5 * row / (cells - 1) + (0.06 if (row + column) % 2 else -0.06)
            colour = colorsys.hls_to_rgb(column / cells, lightness, 0.65)
            picture[np.ix_(cell == row, cell == column)] = np.round(255 * np.array(colour))
    on_line = (np.arange(size) * cells % size) < 2 * cells
    picture[on_line], picture[:, on_line] = 245, 245
    return picture


def bricks(brick, mortar, rows=8, size=256):
    """Half bricks shifted every other row, each a little lighter or darker."""
    random = np.random.default_rng(SEED)
    y, x = np.mgrid[:size, :size] * rows / size
    row = y.astype(int)
    x = (x / 2 + row % 2 / 2) % (rows / 2)
    shade = random.uniform(0.82, 1.12, (rows, rows // 2))[row, x.astype(int)]
    joint = (y % 1 < 0.1) | (x % 1 < 0.05)
    colour = np.where(joint[..., None], mortar, np.multiply.outer(shade, brick))
    return np.round(np.clip(colour, 0, 255)).astype(np.uint8)


def rings(first, second, count=5, size=256):
    """Circles around the middle: a lens turns them into anything but circles."""
    y, x = (np.mgrid[:size, :size] + 0.5) / size - 0.5
    odd = (np.hypot(x, y) * 2 * count).astype(int) % 2 == 1
    return np.where(odd[..., None], np.uint8(second), np.uint8(first))


def gradient_sky(size=512):
    """A clear sky for the environment: haze at the horizon, blue overhead, dull ground below. Equirectangular."""
    elevation = (np.arange(size // 2) + 0.5) / (size // 2) * 2 - 1
    stops = (-1, -0.15, 0, 0.12, 0.45, 1)
    colours = np.array([(52, 50, 58), (84, 84, 96), (176, 190, 208), (150, 182, 218), (84, 132, 198), (38, 76, 150)])
    column = np.stack([np.interp(elevation, stops, channel) for channel in colours.T], axis=-1)
    return np.repeat(np.round(column).astype(np.uint8)[:, None], size, axis=1)


def disk(width=1024, height=192, turns=1.5):
    """Glowing gas on a ring: u goes around, v from the inner rim, white hot, to the outer one, dark red. No seam."""
    random = np.random.default_rng(SEED)
    u = (np.arange(width) + 0.5) / width * 2 * np.pi
    v = ((np.arange(height) + 0.5) / height)[:, None]
    streaks = np.zeros((height, width))
    for octave in range(5):  # waves that trail, finer across than around
        for _ in range(6):
            around, across = random.integers(1, 4) * 2**octave, random.normal() * 9 * 2**octave
            streaks += np.sin(around * (u + turns * np.log(v + 0.25)) + across * v + random.uniform(0, 2 * np.pi)) / (
                2**octave * 4
            )
    heat = (0.06 + 0.94 * (1 - v) ** 1.7) * np.clip(0.75 + 0.45 * streaks, 0.12, 1.4)
    heat *= np.clip((1 - v) / 0.06, 0, 1) * 0.85 + 0.15  # the outer rim is thin
    light = 1.5 * heat[..., None] ** np.array((0.75, 1.45, 2.5)) * (1.0, 0.80, 0.62)
    return np.round(255 * _srgb(np.clip(light, 0, 1))).astype(np.uint8)


def asphalt(width=128, height=512):
    """A piece of road: v goes along it; dashes in the middle, a line at each edge."""
    random = np.random.default_rng(SEED)
    grain = 78 + 14 * random.normal(size=(height, width))
    picture = np.repeat(np.clip(grain, 40, 120)[..., None], 3, axis=2) * (1.0, 0.97, 0.95)
    u, v = (np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height
    dash = (np.abs(u - 0.5)[None, :] < 0.012) & ((v % 0.5) < 0.25)[:, None]
    edge = np.broadcast_to(np.abs(np.abs(u - 0.5) - 0.46)[None, :] < 0.012, dash.shape)
    picture[dash | edge] = 232, 226, 208
    return np.round(picture).astype(np.uint8)


def sand(size=256):
    """Ripples and grains; repeats without a seam."""
    random = np.random.default_rng(SEED)
    y, x = np.mgrid[:size, :size] / size * 2 * np.pi
    shade = 1 + 0.03 * random.normal(size=(size, size))
    for _ in range(8):
        a, b = random.integers(-6, 7, 2)
        shade += 0.03 * np.sin(a * x + b * y + random.uniform(0, 2 * np.pi))
    return np.round(np.clip(shade[..., None] * (204, 168, 118), 0, 255)).astype(np.uint8)


def ridge(width=512, height=64):
    """Rock in layers for the mountains."""
    random = np.random.default_rng(SEED)
    layers = np.interp(np.linspace(0, 1, height), np.linspace(0, 1, 12), random.uniform(0.8, 1.1, 12))
    shade = layers[:, None] + 0.05 * random.normal(size=(height, width))
    return np.round(np.clip(shade[..., None] * (126, 104, 118), 0, 255)).astype(np.uint8)


def car_paint(size=128):
    """The sides of a car: paint below, windows above, two lamps and a plate. v is the height."""
    picture = np.empty((size, size, 3), np.uint8)
    picture[:] = 190, 30, 26
    v, u = (np.mgrid[:size, :size] + 0.5) / size
    for where, colour in (
        (v < 0.10, (26, 26, 28)),
        ((np.abs(v - 0.30) < 0.05) & (np.abs(u - 0.5) < 0.17), (236, 232, 196)),
        ((np.abs(v - 0.42) < 0.06) & (np.abs(np.abs(u - 0.5) - 0.36) < 0.07), (255, 236, 170)),
    ):
        picture[where] = colour
    return picture


def window_paint(size=64):
    """The upper part of a car: glass within a frame."""
    v, u = (np.mgrid[:size, :size] + 0.5) / size
    glass = (np.abs(u - 0.5) < 0.42) & (np.abs(v - 0.45) < 0.38) & (np.abs(u - 0.5) > 0.015)
    return np.where(glass[..., None], np.uint8((40, 52, 66)), np.uint8((190, 30, 26)))


def desert_sky(size=512):
    """Blue above, pale dust at the horizon, sand below it. Equirectangular."""
    elevation = (np.arange(size // 2) + 0.5) / (size // 2) * 2 - 1
    stops = (-1, -0.02, -0.004, 0.004, 0.05, 0.2, 1)
    colours = np.array(
        [
            (190, 152, 104),
            (206, 172, 124),
            (222, 206, 178),
            (216, 222, 224),
            (160, 198, 228),
            (96, 152, 214),
            (40, 84, 160),
        ]
    )
    column = np.stack([np.interp(elevation, stops, channel) for channel in colours.T], axis=-1)
    return np.repeat(np.round(column).astype(np.uint8)[:, None], size, axis=1)


def planet(width=512):
    """Bands and storms of a gas planet. Equirectangular, no seam."""
    random = np.random.default_rng(SEED)
    height = width // 2
    latitude = ((np.arange(height) + 0.5) / height - 0.5) * np.pi
    longitude = (np.arange(width) + 0.5) / width * 2 * np.pi
    directions = _unit(longitude[None, :], latitude[:, None])
    swirl = _noise(directions, random, 3.0, 4)
    height_in_bands = directions[..., 2] * 9 + 0.5 * swirl
    stops = np.linspace(-1, 1, 9)
    colours = random.permutation(
        [(214, 178, 132), (168, 104, 70), (236, 214, 178), (190, 140, 96), (226, 196, 150)] * 2
    )[:9]
    wave = np.sin(height_in_bands)
    picture = np.stack([np.interp(wave, stops, channel) for channel in colours.T], axis=-1)
    return np.round(np.clip(picture * (1 + 0.06 * swirl[..., None]), 0, 255)).astype(np.uint8)


def star_sky(width=1024, stars=2600):
    """Stars and a coloured band around the sky, tilted against the horizon. Equirectangular, no seam."""
    random = np.random.default_rng(SEED)
    height = width // 2
    latitude = ((np.arange(height) + 0.5) / height - 0.5) * np.pi
    longitude = (np.arange(width) + 0.5) / width * 2 * np.pi
    directions = _unit(longitude[None, :], latitude[:, None])
    pole = _unit(0.4, 1.0)  # of the band
    light = _band(directions, pole, random)
    light += (0.004, 0.005, 0.012)

    # As many stars again lie near the band as everywhere else.
    places = random.normal(size=(stars, 3))
    places -= np.outer((places @ pole) * (np.arange(stars) % 2) * 0.85, pole)
    places /= np.linalg.norm(places, axis=1, keepdims=True)
    brightness = np.minimum(0.05 * random.pareto(1.3, stars) + 0.06, 1.6)
    warmth = random.normal(0, 1, stars)[:, None]
    colours = np.clip(1 + warmth * (0.22, 0.02, -0.25), 0.3, 1.5)
    _add_stars(light, places, brightness[:, None] * colours)
    return np.round(255 * _srgb(np.clip(light, 0, 1))).astype(np.uint8)


def _band(directions, pole, random):
    """Radiance of the band, (height, width, 3): a glow, warm in the middle and blue outside, with dark lanes."""
    across = directions @ pole
    clouds = _noise(directions, random, 2.5, 4)
    lanes = _noise(directions, random, 4.0, 4)
    offset = across + 0.10 * clouds
    glow = np.exp(-((offset / 0.20) ** 2)) * (0.55 + 0.45 * clouds)
    core = np.exp(-((offset / 0.09) ** 2)) * (0.6 + 0.5 * lanes)
    dust = np.exp(-(((across + 0.07 * lanes) / 0.035) ** 2)) * (0.5 + 0.5 * clouds)
    light = 0.22 * np.clip(glow, 0, None)[..., None] * (0.45, 0.55, 1.0)
    light += 0.34 * np.clip(core, 0, None)[..., None] * (1.0, 0.72, 0.50)
    light += 0.10 * np.clip(glow * lanes, 0, None)[..., None] * (1.0, 0.25, 0.55)
    return light * (1 - 0.75 * np.clip(dust, 0, 1))[..., None]


def _noise(directions, random, frequency, octaves):
    """Sums of plane waves on the sphere, about -1 to 1: smooth, and without a seam or poles."""
    total = np.zeros(directions.shape[:-1])
    for octave in range(octaves):
        for _ in range(6):
            wave = random.normal(size=3) * frequency * 2**octave
            total += np.sin(directions @ wave + random.uniform(0, 2 * np.pi)) / 2**octave / 3
    return np.clip(total, -1, 1)


def _add_stars(light, places, colours):
    """Draw each star as a small round spot, as round near the poles as at the equator."""
    height, width = light.shape[:2]
    for place, colour in zip(places, colours, strict=True):
        latitude = np.arcsin(np.clip(place[2], -1, 1))
        row = (latitude / np.pi + 0.5) * height
        column = (np.arctan2(place[1], place[0]) / (2 * np.pi)) % 1 * width
        squeeze = max(np.cos(latitude), 0.02)
        reach = int(np.ceil(2 / squeeze))
        rows = np.arange(max(int(row) - 2, 0), min(int(row) + 3, height))
        columns = np.arange(int(column) - reach, int(column) + reach + 1)
        distance = (rows[:, None] + 0.5 - row) ** 2 + ((columns + 0.5 - column)[None, :] * squeeze) ** 2
        spot = np.exp(-distance / (0.5 + 0.35 * colour.max()))
        light[np.ix_(rows, columns % width)] += spot[..., None] * colour


def _unit(longitude, latitude):
    """Unit vectors, (…, 3), Z up."""
    x, y, z = np.broadcast_arrays(
        np.cos(longitude) * np.cos(latitude), np.sin(longitude) * np.cos(latitude), np.sin(latitude)
    )
    return np.stack([x, y, z], axis=-1)


def _srgb(linear):
    """Scene-linear to sRGB, both 0 to 1."""
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.power(linear, 1 / 2.4) - 0.055)

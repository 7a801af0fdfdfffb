"""What a frame takes in memory is what was checked before, and beside its picture it does not grow with it."""

import dataclasses
import tracemalloc

import numpy as np
import pytest

from addon.core import device as gpu
from addon.core import memory, trace
from addon.core.memory import frame_bytes, picture_bytes, sky_bytes, tile_bytes
from addon.core.models import MODELS
from addon.core.pipelines.fused import FusedPipeline
from addon.core.scene import Environment, Scene, SceneError
from addon.core.settings import PASSES, Settings
from addon.core.trace import pack_for, render

from . import scenes

SIDE = 64  # pixels of a tile here, the same in every frame
SKY = Environment(faces=np.ones((6, 32, 32, 3), np.float32))
SETTINGS = {
    "picture": Settings(tolerance=1e-2, edge_samples=1),
    "edges": Settings(tolerance=1e-2, edge_samples=2),
    "every pass": Settings(tolerance=1e-2, step_control="embedded", passes=PASSES, edge_samples=1),
    "paper": scenes.papers(tolerance=1e-2),
}


def scene_of(columns, rows, environment=SKY, model=scenes.STRAIGHT):
    return scenes.mixed(model, scenes.camera(columns, rows), environment=environment)


@pytest.fixture
def tiles_of_one_size(monkeypatch):
    monkeypatch.setattr(FusedPipeline, "tile_size", lambda self: (min(SIDE, self.size[0]), min(SIDE, self.size[1])))
    for module, name in ((trace, "TILE"), (memory, "TILE"), (memory, "LARGEST_TILE")):
        monkeypatch.setattr(module, name, SIDE)


def taken(scene, settings, monkeypatch):
    """Bytes of arrays at the worst moment, and of all textures that were made on the device."""
    made = []
    original = gpu.Device.texture

    def spy(self, *given, **named):
        texture = original(self, *given, **named)
        made.append(texture.width * texture.height * texture.components * gpu.BYTES[texture.dtype])
        return texture

    with monkeypatch.context() as patched:
        patched.setattr(gpu.Device, "texture", spy)
        tracemalloc.start()
        try:
            render(scene, settings)
            return tracemalloc.get_traced_memory()[1], sum(made)
        finally:
            tracemalloc.stop()


@pytest.mark.parametrize("name", ["picture", "every pass", "paper"])
def test_beside_its_picture_a_large_frame_takes_no_more_than_a_small_one(name, tiles_of_one_size, monkeypatch):
    """Sixteen times the pixels; what Python itself keeps of a tile does not add up to the picture's hundredth part."""
    settings = SETTINGS[name]
    sizes = (256, 128), (1024, 512)
    render(scene_of(*sizes[0]), settings)  # programs and tables that stay are made once
    arrays, textures = zip(*(taken(scene_of(*size), settings, monkeypatch) for size in sizes), strict=True)
    pictures = [picture_bytes(size, settings) for size in sizes]
    beside = [whole - picture for whole, picture in zip(arrays, pictures, strict=True)]
    print(f"{name}: {beside} bytes beside the pictures, {textures} on the device")
    assert textures[0] == textures[1]
    assert beside[1] - beside[0] < 0.01 * pictures[1]
    assert beside[1] < tile_bytes((SIDE, SIDE), settings) + 2**20


@pytest.mark.parametrize("name", SETTINGS)
def test_no_frame_takes_more_than_was_checked(name, tiles_of_one_size, monkeypatch):
    """All that is uploaded, at a size where neither the picture's part nor the tile's hides the other."""
    settings, size = SETTINGS[name], (300, 200)
    scene = scene_of(*size, model=scenes.HOLE)
    render(scene, settings)
    arrays, on_device = taken(scene, settings, monkeypatch)
    stated = frame_bytes(scene, settings, pack_for(scene, settings))
    print(f"{name}: {arrays} + {on_device} of {stated} bytes")
    assert picture_bytes(size, settings) <= arrays + on_device <= stated


def limit_between(without, wanted, monkeypatch):
    """A limit that allows the first scene, by a byte, but not the second."""
    settings = SETTINGS["picture"]
    allowed = frame_bytes(without, settings, pack_for(without, settings))
    monkeypatch.setattr(trace, "memory_limit_bytes", allowed)
    render(without, settings)
    with pytest.raises(SceneError, match="Memory Limit"):
        render(wanted, settings)


def test_the_limit_counts_the_sky(monkeypatch):
    limit_between(scene_of(8, 8, Environment()), scene_of(8, 8), monkeypatch)


def test_the_limit_counts_the_far_sky(monkeypatch):
    near = scene_of(8, 8, model=MODELS["wormhole"]())
    limit_between(near, dataclasses.replace(near, far_environment=SKY), monkeypatch)


def test_the_limit_counts_a_volume(monkeypatch):
    def of(cells):
        density = np.zeros((cells, cells, cells), np.float32)
        model = MODELS["refraction"](medium="grid", grid=density, grid_min=(-1, -1, -1), grid_max=(1, 1, 1))
        return Scene(scenes.camera(8, 8), model)

    limit_between(of(4), of(16), monkeypatch)


def test_a_sky_that_nothing_shows_counts_nothing():
    """A far side's where there is none, and any where no picture is asked for."""
    shown = scene_of(8, 8)
    far = dataclasses.replace(shown, far_environment=SKY)
    picture, others = Settings(), Settings(passes=("Depth",))
    assert sky_bytes(far, picture) == sky_bytes(shown, picture) > 2 * SKY.faces.nbytes
    assert sky_bytes(shown, others) == sky_bytes(scene_of(8, 8, Environment()), picture) == 0

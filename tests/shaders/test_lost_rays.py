"""The walk down the tree of boxes ends on every driver; a ray whose walk was broken off is counted, with an advice."""

from dataclasses import replace

import numpy as np
import pytest

from addon.core import trace
from addon.core.scene import Scene
from addon.core.settings import Settings
from addon.core.status import Status, advice
from addon.core.textures import pack
from tests.shaders import scenes

PASSES = ("Combined", "Depth", "Normal", "Object Index", "Direction", "Status", "Steps")
FILLS_A_ROW = 4097  # coincident triangles: 1024 nodes, two texels each
MODELS = {"straight": scenes.STRAIGHT, "hole": scenes.HOLE}


def rendered(scene, monkeypatch, nodes=lambda tree: None):
    """The frame of a scene whose tree, uint32, (nodes, 2, 4), was changed by nodes()."""

    def packed(scene, settings):
        found = pack(scene, groups=False, tree=True, mipmaps=settings.filters_textures)
        tree = found.arrays["u_tree"].copy()
        nodes(tree.reshape(-1, 2, 4))
        return replace(found, arrays=found.arrays | {"u_tree": tree})

    monkeypatch.setattr(trace, "pack_for", packed)
    return trace.render(scene, Settings(pipeline="fused", passes=PASSES, failed_rays="marker"))


def in_circles(tree):
    """Every inner child is the root, and every box is that of everything: deeper and deeper."""
    tree[:] = tree[0]
    tree[:, :, 3] = 0


def to_and_fro(tree):
    """The root's one child is the root, and its other one is missed: no deeper, and without an end."""
    tree[0, 1, :3] = np.frombuffer(bytes((0, 255, 255, 0)), np.uint32)  # low 0, high 0, low 1, high 1, in cells
    tree[0, :, 3] = 0


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("broken", [in_circles, to_and_fro])
def test_walks_without_an_end_are_broken_off_and_counted(broken, model, monkeypatch):
    scene = scenes.mixed(MODELS[model], scenes.camera(16, 12))
    frame = rendered(scene, monkeypatch, broken)
    status = frame.passes["Status"][..., 0]
    lost = frame.statistics.rays[Status.LOST]
    assert lost == np.sum(status == Status.LOST) > 0.1 * status.size
    assert Status.HIT not in frame.statistics.rays
    assert all(np.isfinite(pixels).all() for pixels in frame.passes.values())
    assert (frame.passes["Combined"][status == Status.LOST] == (1.0, 0.0, 1.0, 1.0)).all()  # as every failure
    (sentence,) = advice(frame.statistics.rays)
    assert sentence.startswith(f"{lost} of 192 rays were lost in the tree of objects. The graphics driver is at fault")


def test_a_whole_tree_is_walked_where_its_texture_has_no_room_left(monkeypatch):
    """As many coincident triangles as fill the texture with nodes, and in their boxes, but beside them, every ray: it
    comes to every node and every leaf.
    """
    corners = np.array([[-3.0, 0.0, -3.0], [3.0, 0.0, -3.0], [-3.0, 0.01, 3.0]])
    scene = Scene(
        scenes.camera(16, 12, target=(2.0, 0.0, 2.0), half=0.1),
        scenes.STRAIGHT,
        triangles=scenes.triangles(np.broadcast_to(corners, (FILLS_A_ROW, 3, 3))),
    )
    full = []
    frame = rendered(scene, monkeypatch, lambda nodes: full.append(nodes.any(axis=(1, 2)).all()))
    assert full == [True] and frame.statistics.rays == {Status.ESCAPED: 192}

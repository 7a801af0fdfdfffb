"""More samples where neighbouring rays end differently: as good as many samples everywhere, for far fewer rays."""

from dataclasses import replace

import numpy as np
import pytest

from addon.core import trace
from addon.core.antialiasing import sample_offset
from addon.core.models import MODELS
from addon.core.pipelines.fused import FusedPipeline
from addon.core.scene import Environment, Material, Scene
from addon.core.settings import Settings, SettingsError
from addon.core.status import Status
from addon.core.trace import Cancelled, render
from tests.shaders import scenes

EMBEDDED = {
    "pipeline": "fused", "integrator": "dormand_prince_54", "step_control": "embedded", "tolerance": 1e-4,
}  # fmt: skip
PASSES = ("Combined", "Depth", "Position", "Normal", "Object Index", "Direction", "Status", "Steps")


def flat(width=48, height=36):
    """A hole, a sky of one colour, a glowing ball and a wall with the same object index: flat colours and edges."""
    materials = tuple(Material(base_color=(0, 0, 0), emission=color) for color in ((1, 0, 0), (0, 1, 0)))
    return Scene(
        scenes.camera(width, height, (0.0, -14.0, 1.0), half=0.5),
        MODELS["schwarzschild"](mass=0.4),
        triangles=scenes.quad((-4, 3, 0), (1.5, 0, 0), (0, 0, 1.5), object_index=[0, 0], material=1),
        spheres=scenes.spheres([[3.0, 0.0, -1.0]], 1.0, object_index=[0]),
        materials=materials,
        environment=Environment((0.1, 0.2, 1.0)),
    )


@pytest.fixture
def finders(monkeypatch):
    """The EdgeFinders that render() makes."""
    made = []

    class Kept(trace.EdgeFinder):
        def __init__(self, columns, rows):
            super().__init__(columns, rows)
            made.append(self)

    monkeypatch.setattr(trace, "EdgeFinder", Kept)
    return made


def refined(finder):
    """(rows, columns), bool: the pixels that got more samples."""
    rows, columns = finder.mask.shape
    found = np.zeros((rows + 1, columns + 1), bool)
    for x, y in finder.quads().astype(int):
        found[y : y + 2, x : x + 2] = True
    return found[:rows, :columns]


def half_plane_difference(few, many):
    """The largest difference of the shares of few and of many samples that lie on one side of a straight edge."""
    offsets = np.array([sample_offset(sample, 1.5) for sample in range(many)])
    largest = 0.0
    for angle in np.linspace(0, np.pi, 90, endpoint=False):
        along = offsets @ (np.cos(angle), np.sin(angle))
        places = np.linspace(-1.5, 1.5, 200)
        shares = [(along[:n, None] < places).mean(axis=0) for n in (few, many)]
        largest = max(largest, np.abs(shares[0] - shares[1]).max())
    return largest


def test_edges_converge_with_far_fewer_rays():
    """64 samples at edges against 256 everywhere: as far apart as straight edges between colours that differ by 1, with
    a hundredth for those that are not straight. Between edges the colours are flat.
    """
    exact = render(flat(72, 54), Settings(**EMBEDDED, samples=256))
    single = render(flat(72, 54), Settings(**EMBEDDED))
    edges = render(flat(72, 54), Settings(**EMBEDDED, edge_samples=64))
    error, error_of_one = (
        np.abs(frame.passes["Combined"] - exact.passes["Combined"]).max() for frame in (edges, single)
    )
    bound = half_plane_difference(64, 256) + 0.01
    rays = edges.statistics.ray_count / (72 * 54)
    print(f"largest error {error:.3f} (bound {bound:.3f}, one sample {error_of_one:.3f}), {rays:.1f} rays a pixel")
    assert error < bound
    assert error_of_one > 0.3
    assert rays < 64 / 2


def test_the_mask_covers_the_shadows_edge_and_the_silhouettes(finders):
    """A picture of 5 x 5 rays a pixel says which pixels see two things."""
    scene = flat()
    render(scene, Settings(**EMBEDDED, edge_samples=4))
    (finder,) = finders
    fine = replace(scene.camera, width=5 * 48, height=5 * 36)
    passes = render(replace(scene, camera=fine), Settings(**EMBEDDED, passes=("Combined",))).passes
    colors = passes["Combined"][..., :3].reshape(36, 5, 48, 5, 3)
    two = (np.ptp(colors, axis=(1, 3)) > 0.05).any(axis=-1)
    assert two.sum() > 100
    assert refined(finder)[two].all()
    assert refined(finder).mean() < 0.5


def test_the_mask_covers_the_photon_ring(finders):
    """Pixels whose ray has an impact parameter within 3 % of the critical one, 3 sqrt(3) M: it goes around the hole.
    Synge's formula for an observer at rest: b = r sin(psi) / sqrt(1 - 2 M / r). A pixel is 5 % wide.
    """
    width = 64
    view = scenes.camera(width, width, (0.0, -60.0, 0.0), half=0.14)
    scene = Scene(view, scenes.HOLE, environment=Environment((1, 1, 1)))
    render(scene, Settings(**EMBEDDED, edge_samples=2, observer="static"))
    x = (np.arange(width) + 0.5) / width * 0.28 - 0.14
    tangent = np.hypot(x, x[:, None])
    impact = 60.0 * tangent / np.sqrt(1 + tangent**2) / np.sqrt(1 - 2 / 60)
    ring = np.abs(impact / np.sqrt(27.0) - 1.0) < 0.03
    assert ring.sum() > 50
    assert refined(finders[0])[ring].all()


def test_only_the_picture_changes_and_only_at_edges(finders):
    """Object index and status of a pixel are its first ray's; a picture with odd sides, too."""
    plain = render(flat(41, 31), Settings(**EMBEDDED, passes=PASSES)).passes
    more = render(flat(41, 31), Settings(**EMBEDDED, passes=PASSES, edge_samples=8)).passes
    inside = ~refined(finders[0])
    for name in PASSES[1:]:
        assert np.array_equal(plain[name], more[name]), name
    assert np.array_equal(plain["Combined"][inside], more["Combined"][inside])
    assert not np.array_equal(plain["Combined"], more["Combined"])


@pytest.mark.parametrize("samples", [1, 3])
def test_at_edges_everywhere_it_is_the_picture_of_many_samples(samples, monkeypatch):
    """With every pixel refined, the sum of the first and the further samples is that of all. Sums of 8 float32 in
    different orders.
    """
    monkeypatch.setattr(trace.EdgeFinder, "add", lambda self, *tile: self.mask.fill(True))
    whole = render(flat(21, 15), Settings(**EMBEDDED, samples=8))
    edges = render(flat(21, 15), Settings(**EMBEDDED, samples=samples, edge_samples=8))
    assert np.abs(whole.passes["Combined"] - edges.passes["Combined"]).max() < 8 * 2.0**-23
    assert edges.statistics.ray_count == whole.statistics.ray_count == 8 * 21 * 15
    assert edges.statistics.rays == whole.statistics.rays


def test_the_picture_does_not_depend_on_the_tiles(monkeypatch):
    settings = Settings(**EMBEDDED, edge_samples=4)
    whole = render(flat(), settings).passes["Combined"]
    sizes = iter([(16, 8), (32, 8), (8, 32)] * 1000)
    monkeypatch.setattr(FusedPipeline, "tile_size", lambda self: next(sizes))
    assert np.array_equal(whole, render(flat(), settings).passes["Combined"])


def test_a_region_is_cut_out_of_the_whole_picture():
    """At an even corner, for quads; its own edges have no neighbours, and are left out of the comparison."""
    settings = Settings(**EMBEDDED, edge_samples=4)
    whole = render(flat(), settings).passes["Combined"]
    scene = flat()
    part = render(replace(scene, camera=replace(scene.camera, region=(10, 8, 38, 30))), settings).passes["Combined"]
    assert np.abs(part[2:-2, 2:-2] - whole[10:28, 12:36]).max() < 1e-6


def test_without_edges_nothing_is_added():
    scene = Scene(scenes.camera(16, 12), scenes.STRAIGHT, environment=Environment((0.25, 0.5, 1.0)))
    frame = render(scene, Settings(**EMBEDDED, edge_samples=16))
    assert frame.statistics.rays == {Status.ESCAPED: 16 * 12}
    assert (frame.passes["Combined"] == np.float32([0.25, 0.5, 1.0, 1.0])).all()


def test_progress_goes_on_and_a_cancel_stops_the_further_samples(monkeypatch):
    fractions = []
    render(flat(), Settings(**EMBEDDED, edge_samples=16), progress=lambda fraction, _: fractions.append(fraction))
    assert fractions == sorted(fractions) and fractions[-1] == 1.0
    assert any(0.5 < fraction < 1.0 for fraction in fractions)
    with pytest.raises(Cancelled):
        reached = []
        render(
            flat(),
            Settings(**EMBEDDED, edge_samples=16),
            progress=lambda fraction, _: reached.append(fraction),
            cancelled=lambda: bool(reached) and reached[-1] > 0.5,
        )
    assert reached[-1] < 1.0


def test_who_refines_edges():
    assert Settings(**EMBEDDED, edge_samples=4).refines_edges
    assert not Settings(**EMBEDDED, samples=4, edge_samples=4).refines_edges
    assert not Settings(**EMBEDDED, passes=("Status",), edge_samples=4).refines_edges
    assert not Settings(pipeline="paper", edge_samples=4).refines_edges
    with pytest.raises(SettingsError, match="edge_samples"):
        Settings(edge_samples=0)

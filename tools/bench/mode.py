"""How much is measured: quick, for a look within three minutes on two cores, or full."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Mode:
    """repeats, slow_repeats : timed runs of a frame; the second where it takes seconds
    rays, noisy_rays : sampled to find an error; the second where their truth takes long
    table_size, figure_size, scaling_size : columns, rows of the pictures of Table 1, Figure 5, and the triangles
    cycles_sizes : of the pictures beside Cycles; the targets are those of the first
    large_size : of the picture whose memory is measured
    spheres, crossbar_spheres : how many, in Figure 5; the second where every sphere takes a quad for every segment
    """

    name: str
    repeats: int
    slow_repeats: int
    rays: int
    noisy_rays: int
    table_size: tuple[int, int]
    figure_size: tuple[int, int]
    scaling_size: tuple[int, int]
    cycles_sizes: tuple[tuple[int, int], ...]
    large_size: tuple[int, int]
    spheres: tuple[int, ...]
    crossbar_spheres: tuple[int, ...]
    triangle_rings: tuple[int, ...]


QUICK = Mode(
    name="quick",
    repeats=3,
    slow_repeats=2,
    rays=512,
    noisy_rays=96,
    table_size=(200, 150),
    figure_size=(160, 120),
    scaling_size=(400, 300),
    cycles_sizes=((800, 600),),
    large_size=(2048, 1024),
    spheres=(1, 10, 100, 1000),
    crossbar_spheres=(1, 10, 100),
    triangle_rings=(8, 32, 128, 512),
)
FULL = Mode(
    name="full",
    repeats=5,
    slow_repeats=2,
    rays=1024,
    noisy_rays=256,
    table_size=(800, 600),
    figure_size=(240, 180),
    scaling_size=(800, 600),
    cycles_sizes=((800, 600), (1920, 1080)),
    large_size=(16384, 8192),
    spheres=(1, 3, 10, 30, 100, 300, 1000),
    crossbar_spheres=(1, 3, 10, 30, 100, 300, 1000),
    triangle_rings=(8, 16, 32, 64, 128, 256, 512),
)

"""What a pipeline is asked for and what it gives back."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np

from ..scene import Environment
from ..settings import Settings
from ..textures import Packed

GIVEN_RAYS = ("u_given_origins", "u_given_directions", "u_given_moments")  # samplers of Request.rays
ROUNDING_OF_A_STEP = 1e-7  # float32's, radians


class Stopwatch:
    """Milliseconds by stage, in the order the stages began."""

    def __init__(self):
        self.milliseconds: dict[str, float] = {}

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        begin = time.perf_counter()
        try:
            yield
        finally:
            self.milliseconds[name] = self.milliseconds.get(name, 0.0) + 1e3 * (time.perf_counter() - begin)


@dataclass(frozen=True, eq=False)
class ModelShader:
    """What a model adds to the programs: files of shaders/, flags for their #ifdef, printed functions, and textures,
    (rows, columns, 4) for texelFetch or (depth, rows, columns, channels) for a volume.  of_long_rays : as
    Model.files_of_long_rays() has it
    """

    files: tuple[str, ...]
    flags: frozenset[str] = frozenset()
    generated: tuple[tuple[str, str], ...] = ()
    textures: dict[str, np.ndarray] = field(default_factory=dict)
    of_long_rays: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class IntegratorShader:
    """advance(): a file of shaders/integrators or a printed tableau. error_order : of its error estimate, or 0;
    rounding : of that estimate, as a multiple of an explicit method's
    step_share : of a ray's tolerance, what one step may be estimated at. Measured: the errors of a ray sum up to a
    hundred of them (Lorenz, Dormand and Prince's method)
    second_derivatives : whether v of the derivative is the second derivative of x
    """

    files: tuple[str, ...] = ()
    generated: tuple[tuple[str, str], ...] = ()
    error_order: int = 0
    rounding: float = 1.0
    step_share: float = 0.01
    second_derivatives: bool = False

    def step_tolerance(self, tolerance: float) -> float:
        """What a step's estimate may be, radians, where the whole ray may be wrong by the tolerance."""
        return max(self.step_share * tolerance, self.smallest_tolerance())

    def smallest_tolerance(self) -> float:
        """Of a step: an estimate below it is noise."""
        return self.rounding * ROUNDING_OF_A_STEP


@dataclass(frozen=True, eq=False)
class Request:
    """Everything a pipeline needs to make its programs, beside the settings.

    camera          "perspective", "orthographic" or "given": two files of camera/
    errors          file of errors/: how the steps' errors add up
    advance         file of advances/: constant steps of the paper's pipeline
    observer        file of observers/
    flat_frame      whether observers/flat is needed, for a model without a frame at rest of its own
    packed          the scene's textures
    cube            float32, (6, size, size, 3), or None
    far_sky         the sky of the far side, where it has one of its own
    uniforms        all values: model, camera, observer, skies, ambient
    straight        nothing bends the rays: one step of first_step takes them through everything
    rays            origins, directions and moments, (rows, columns, 4) each, for the camera "given"
    first_step      h, model lengths
    smallest_step   below it an adapted step counts as a failure, model lengths
    escape_radius   of the bounding sphere, model lengths
    inner_radius    where even a ray straight at the centre begins to bend, model lengths; at most escape_radius
    bends_within    how many impact parameters from the centre any other ray begins to bend
    """

    settings: Settings
    camera: str
    model: ModelShader
    integrator: IntegratorShader
    errors: str
    advance: str
    observer: str
    packed: Packed
    cube: np.ndarray | None
    uniforms: dict[str, object]
    first_step: float
    smallest_step: float
    escape_radius: float
    inner_radius: float
    bends_within: float
    outputs: frozenset[str] = field(default_factory=frozenset)
    rays: tuple[np.ndarray, ...] | None = None
    flat_frame: bool = False
    far_sky: Environment | None = None
    straight: bool = False


@dataclass(eq=False)
class TileEnds:
    """What the rays of a tile ended as; float32, (rows, columns, …), model space, row 0 at the bottom.

    position  (…, 4): where the ray ended or what it hit, and τ
    velocity  (…, 4): unit direction there (0 where it is not finite), and the status
    color     (…, 4): radiance, where asked for
    surface   (…, 4): the hit's normal and object index, where asked for
    tally     (…, 4): depth, steps, error estimate, drift of the invariants, where asked for
    frequency (…, 4): of the light as the observer sees it, as a multiple of the emitted one, where asked for
    rejected  (…, 4): of the steps taken, those whose result did not stand, where asked for and steps adapt
    """

    position: np.ndarray
    velocity: np.ndarray
    color: np.ndarray | None = None
    surface: np.ndarray | None = None
    tally: np.ndarray | None = None
    frequency: np.ndarray | None = None
    rejected: np.ndarray | None = None


def shading_choice(packed: Packed) -> tuple[list[str], set[str]]:
    """Files of shaders/, and flags, that define shade() for these objects."""
    files, flags = ["shading/blinn_phong"], set()
    if packed.light_count:
        files.append("shading/lights")
        flags.add("LIGHTS")
    if "u_image_table" in packed.arrays:
        files.append("shading/images")
        flags.add("IMAGES")
    return files, flags

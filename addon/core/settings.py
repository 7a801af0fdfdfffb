"""What the user chooses, checked once. Frozen, so that the choices in it can key the program cache."""

from __future__ import annotations

import math
from dataclasses import dataclass

PIPELINES = ("paper", "fused")
INTEGRATORS = (
    "automatic",
    "euler",
    "verlet",
    "runge_kutta_4",
    "bogacki_shampine_32",
    "dormand_prince_54",
    "nystrom_64",
    "rosenbrock_32",
)
WITH_ERROR_ESTIMATE = ("automatic", "bogacki_shampine_32", "dormand_prince_54", "nystrom_64", "rosenbrock_32")
TOLERANCES = {"paper": 1e-3, "fused": 5e-5}  # radians; fused: directions are right to 1e-4, fronts and rims included
STEP_CONTROLS = ("constant", "doubling", "embedded")
OBSERVERS = ("chart", "static", "moving", "falling")
EARLY_TERMINATIONS = ("both", "hits", "bounds", "off")
LARGEST_SPEED = 0.9999  # of an observer; beyond it float32 has no digits left for 1 - v^2
FAILED_RAYS = ("environment", "marker")
PASSES = (
    "Combined",
    "Depth",
    "Position",
    "Normal",
    "Object Index",
    "Direction",
    "Status",
    "Steps",
    "Error",
    "Drift",
    "Frequency Shift",
)
PASS_CHANNELS = {
    "Combined": "RGBA",
    "Depth": "V",
    "Position": "XYZ",
    "Normal": "XYZ",
    "Object Index": "X",
    "Direction": "XYZ",
    "Status": "X",
    "Steps": "X",
    "Error": "X",
    "Drift": "X",
    "Frequency Shift": "X",
}


class SettingsError(ValueError):
    """A setting is out of its range; the message names it, its value and the range."""


@dataclass(frozen=True)
class Settings:
    """Lengths are model lengths (the placement's scale turns them into metres); angles are radians.

    None stands for the pipeline's own choice, and is replaced by it.

    pipeline            one of PIPELINES
    integrator          one of INTEGRATORS; "automatic": "nystrom_64" where the force depends on the position alone,
                        in the model's chart for orbits where it has one and there are no objects; "dormand_prince_54"
                        elsewhere; None: Euler in the paper's pipeline, automatic in the fused one
    step_control        "constant"; "doubling": the paper's step doubling with two thresholds (Section 4.2); "embedded":
                        every step is predicted from the integrator's own error estimate (WITH_ERROR_ESTIMATE);
                        None: "doubling" in the paper's pipeline, "embedded" in the fused one where the integrator can
    observer            "chart": directions are taken in the chart, as the paper does;
                        "static": in the frame of an observer at rest;
                        "moving": in that of one who passes him with observer_velocity;
                        "falling": in that of one who falls (Kerr)
    observer_velocity   (x, y, z), world space, in units of that of light; "moving"
    step                h, the step of τ (the first one where steps adapt); None lets the model choose
    tolerance           angle, radians, that a segment ("doubling") or the whole ray ("embedded") may be wrong by;
                        None: TOLERANCES of the pipeline. Next to a photon orbit every error is magnified, and two
                        rays may part for good: what it has become there, the pass Error says
    chord_tolerance     angle, radians, that what is intersected may be away from the ray: a chord in the paper's
                        pipeline ("embedded"), None: the tolerance; a curve in the fused one, None: a twentieth of it
    max_steps           steps a ray may take
    segments            n_segs: chords a ray may take; few rays among others have as many as max_steps allows, by
                        doubling (fused only)
    steps_per_segment   n_integration: steps between two chords
    early_termination   which ended rays the early z test skips: "both", "hits", "bounds", "off" (or True, False)
    escape_radius       bounding sphere around the model's centre; None lets model and scene choose
    passes              a tuple out of PASSES
    samples             rays a pixel, spread over the pixel by Blackman and Harris' filter; a single one is its centre
    filter_width        pixels, of that filter; Blender's Film > Filter Size
    edge_samples        rays a pixel where neighbours end differently (silhouettes, photon rings), if more than samples
                        (fused only)
    filter_textures     filter sky and images over what a pixel covers of them after all the bending (fused only)
    batch_size          objects read by one draw; 1 is the paper's crossbar, None as many as keep a draw short
    cull_batches        skip a batch whose bounding sphere a segment misses
    ray_bits            32 or 16: precision of the ray textures (16 shows the paper's finding)
    failed_rays         "environment" or "marker": what pixels show whose ray ended in a failure
    """

    pipeline: str = "fused"
    integrator: str | None = None
    step_control: str | None = None
    observer: str = "chart"
    observer_velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    step: float | None = None
    tolerance: float | None = None
    chord_tolerance: float | None = None
    max_steps: int = 100_000
    segments: int = 500
    steps_per_segment: int = 10
    early_termination: str | bool = "both"
    escape_radius: float | None = None
    passes: tuple[str, ...] = ("Combined",)
    samples: int = 1
    filter_width: float = 1.5
    edge_samples: int = 1
    filter_textures: bool = True
    batch_size: int | None = None
    cull_batches: bool = True
    ray_bits: int = 32
    failed_rays: str = "environment"

    def __post_init__(self):
        if isinstance(self.early_termination, bool):
            object.__setattr__(self, "early_termination", "both" if self.early_termination else "off")
        object.__setattr__(self, "passes", tuple(self.passes))
        _one_of("pipeline", self.pipeline, PIPELINES)
        self._follow_the_pipeline()
        _one_of("integrator", self.integrator, INTEGRATORS)
        _one_of("step_control", self.step_control, STEP_CONTROLS)
        _one_of("observer", self.observer, OBSERVERS)
        object.__setattr__(self, "observer_velocity", _slower_than_light(self.observer_velocity))
        _one_of("early_termination", self.early_termination, EARLY_TERMINATIONS)
        _one_of("filter_textures", self.filter_textures, (True, False))
        _one_of("failed_rays", self.failed_rays, FAILED_RAYS)
        _one_of("ray_bits", self.ray_bits, (16, 32))
        if not self.passes:
            raise SettingsError(f"Setting 'passes' is (), but must hold one or more of {PASSES}. Choose one of them.")
        for name in self.passes:
            _one_of("passes", name, PASSES)
        if self.step is not None:
            _in_range("step", self.step, 1e-9, 1e9)
        if self.escape_radius is not None:
            _in_range("escape_radius", self.escape_radius, 1e-9, 1e12)
        _in_range("tolerance", self.tolerance, 1e-9, math.pi)
        if self.chord_tolerance is not None:
            _in_range("chord_tolerance", self.chord_tolerance, 1e-9, math.pi)
        if self.step_control == "embedded" and self.integrator not in WITH_ERROR_ESTIMATE:
            raise SettingsError(
                f"Setting 'step_control' is 'embedded', but integrator '{self.integrator}' has no error estimate. "
                f"Choose one of {WITH_ERROR_ESTIMATE}, or another step control."
            )
        _whole("max_steps", self.max_steps, 1, 10_000_000)
        _whole("segments", self.segments, 1, 1_000_000)
        _whole("steps_per_segment", self.steps_per_segment, 1, 1000)
        _whole("samples", self.samples, 1, 4096)
        _whole("edge_samples", self.edge_samples, 1, 4096)
        _in_range("filter_width", self.filter_width, 0.01, 10.0)
        if self.batch_size is not None:
            _whole("batch_size", self.batch_size, 1, 65536)

    @property
    def step_limit(self) -> int:
        """Steps a ray may take by all limits; step doubling takes three for each of a segment."""
        taken = 3 if self.step_control == "doubling" else 1
        return min(self.max_steps, self.segments * self.steps_per_segment * taken)

    @property
    def filters_textures(self) -> bool:
        """Whether the pipeline filters sky and images, where there are any."""
        return self.pipeline == "fused" and self.filter_textures

    @property
    def refines_edges(self) -> bool:
        """Whether pixels at edges get more samples than the others."""
        return self.pipeline == "fused" and "Combined" in self.passes and self.edge_samples > self.samples

    def _follow_the_pipeline(self) -> None:
        """What is None becomes what the pipeline does best with the rest."""
        papers = self.pipeline == "paper"
        if self.integrator is None:
            simple = papers and self.step_control != "embedded"
            object.__setattr__(self, "integrator", "euler" if simple else "automatic")
        if self.step_control is None:
            embedded = not papers and self.integrator in WITH_ERROR_ESTIMATE
            object.__setattr__(self, "step_control", "embedded" if embedded else "doubling")
        if self.tolerance is None:
            object.__setattr__(self, "tolerance", TOLERANCES[self.pipeline])


def _one_of(name: str, value, choices: tuple) -> None:
    if value not in choices:
        raise SettingsError(f"Setting '{name}' is {value!r}, but must be one of {choices}. Choose one of them.")


def _in_range(name: str, value: float, low: float, high: float) -> None:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if not (number and math.isfinite(value) and low <= value <= high):
        raise SettingsError(f"Setting '{name}' is {value!r}, but must lie in [{low:g}, {high:g}]. Change it.")


def _slower_than_light(velocity) -> tuple[float, float, float]:
    try:
        x, y, z = (float(component) for component in velocity)
    except (TypeError, ValueError):
        raise SettingsError(
            f"Setting 'observer_velocity' is {velocity!r}, but must be three numbers. Change it."
        ) from None
    speed = math.hypot(x, y, z)
    if not speed <= LARGEST_SPEED:
        raise SettingsError(
            f"Setting 'observer_velocity' has the length {speed:g}, but must lie in [0, {LARGEST_SPEED}], "
            "in units of the speed of light. Change it."
        )
    return x, y, z


def _whole(name: str, value: int, low: int, high: int) -> None:
    if not (isinstance(value, int) and not isinstance(value, bool) and low <= value <= high):
        raise SettingsError(f"Setting '{name}' is {value!r}, but must be a whole number in [{low}, {high}]. Change it.")

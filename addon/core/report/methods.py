"""Every integrator and step control that the product offers, with the steps or tolerances that the report tries."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from ..models import Model
from ..settings import INTEGRATORS, PIPELINES, STEP_CONTROLS, WITH_ERROR_ESTIMATE, Settings
from ..trace import integrator_for, integrator_shader

FACTORS = {  # constant steps, in units of the model's default step, which suits Euler's method
    "euler": (8.0, 4.0, 2.0, 1.0, 0.5, 0.25),
    "verlet": (16.0, 8.0, 4.0, 2.0, 1.0, 0.5),
}
FACTORS_OF_HIGH_ORDER = (32.0, 16.0, 8.0, 4.0, 2.0, 1.0)
DOUBLING = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)  # tolerances of a segment, radians
EULERS_DOUBLING = (1e-1, 3e-2, 1e-2, 3e-3, 1e-3, 3e-4)  # its steps grow as fast in number as these fall
EMBEDDED = (1000.0, 300.0, 100.0, 30.0, 10.0, 3.0, 1.0)  # tolerances of the ray, in units of the smallest that matters
SEGMENTS = 20_000  # so that the number of steps alone limits a ray
LABELS = {
    "automatic": "Automatic",
    "euler": "Euler",
    "verlet": "Verlet",
    "runge_kutta_4": "RK4",
    "bogacki_shampine_32": "Bogacki–Shampine 3(2)",
    "dormand_prince_54": "Dormand–Prince 5(4)",
    "nystrom_64": "Nyström 6(4)",
    "rosenbrock_32": "Rosenbrock 3(2)",
}


@dataclass(frozen=True)
class Method:
    """A curve of the diagram."""

    pipeline: str
    integrator: str
    step_control: str

    @property
    def label(self) -> str:
        return f"{LABELS[self.integrator]}, {self.step_control}, {self.pipeline}"

    def settings(self, model: Model, most_steps: int) -> Iterator[tuple[float, Settings]]:
        """(the step in model lengths, or the tolerance in radians; the settings), from coarse to fine."""
        chosen = {"pipeline": self.pipeline, "integrator": self.integrator, "step_control": self.step_control}
        chosen |= {"segments": SEGMENTS, "max_steps": most_steps}
        if self.step_control == "constant":
            for factor in FACTORS.get(self.integrator, FACTORS_OF_HIGH_ORDER):
                step = factor * model.default_step()
                yield step, Settings(step=step, **chosen)
        else:
            for tolerance in self.tolerances():
                yield tolerance, Settings(tolerance=tolerance, **chosen)

    def tolerances(self) -> tuple[float, ...]:
        """Radians, from loose to tight. No two of them are the same to the shaders, as all would be that ask for less
        than float32's rounding of a step.
        """
        if self.step_control == "doubling":
            return EULERS_DOUBLING if self.integrator == "euler" else DOUBLING
        integrator = integrator_shader(self.integrator)
        smallest = integrator.smallest_tolerance() / integrator.step_share
        return tuple(float(f"{factor * smallest:.3g}") for factor in EMBEDDED)


METHODS = tuple(
    Method(pipeline, integrator, control)
    for pipeline in PIPELINES
    for integrator in INTEGRATORS
    for control in STEP_CONTROLS
    if integrator != "automatic" and (control != "embedded" or integrator in WITH_ERROR_ESTIMATE)
)


def integrator_label(model: Model, settings: Settings) -> str:
    """With what Automatic takes for this law."""
    label, taken = LABELS[settings.integrator], integrator_for(model, settings)
    return f"{label} ({LABELS[taken]})" if settings.integrator == "automatic" and taken in LABELS else label


def papers_default(most_steps: int) -> Settings:
    """Section 4.2 with n_integration = 10, and the tolerance that the product gives it."""
    return Settings(
        pipeline="paper",
        integrator="euler",
        step_control="doubling",
        tolerance=1e-3,
        steps_per_segment=10,
        segments=SEGMENTS,
        max_steps=most_steps,
    )


def too_many_steps(model: Model, settings: Settings) -> bool:
    """Whether constant steps from one side of the bent region to the other are more than a ray may take."""
    if settings.step_control != "constant" or not model.curved:
        return False
    return 2.0 * model.escape_radius(0.0) / settings.step > 2.0 * settings.max_steps

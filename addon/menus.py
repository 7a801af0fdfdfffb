"""What the menus of the panel offer: core's choices in the user's words."""

import zlib

from .core.models import MODELS
from .core.settings import EARLY_TERMINATIONS, FAILED_RAYS, INTEGRATORS, OBSERVERS, PIPELINES, STEP_CONTROLS
from .core.status import Status

TEXTS = {  # choice -> its label and description
    "chart": ("Chart", "Take the camera's directions in the model's coordinates, as the paper does"),
    "static": ("Static", "Take the camera's directions in the frame of an observer at rest"),
    "moving": ("Moving", "Take the camera's directions in the frame of an observer who moves past one at rest"),
    "falling": ("Falling", "Take the camera's directions in the frame of an observer who falls into the hole"),
    "paper": ("Paper", "The paper's passes: setup, integration, intersection, termination"),
    "fused": ("Fused", "The whole ray in one shader program, with a tree over the objects: much faster, same picture"),
    "automatic": (
        "Automatic",
        "Nyström 6(4) where the force depends on the position alone, by Binet's equation where a Schwarzschild hole "
        "has no objects around; Dormand-Prince 5(4) elsewhere",
    ),
    "euler": ("Euler", "Euler's method, first order, as in the paper"),
    "verlet": ("Verlet", "Velocity Verlet, second order"),
    "runge_kutta_4": ("Runge-Kutta 4", "The classical method of fourth order"),
    "bogacki_shampine_32": ("Bogacki-Shampine 3(2)", "Third order with an error estimate"),
    "dormand_prince_54": ("Dormand-Prince 5(4)", "Fifth order with an error estimate"),
    "nystrom_64": (
        "Nyström 6(4)",
        "Sixth order with an error estimate, half the work of Dormand-Prince; for forces of the position alone",
    ),
    "rosenbrock_32": (
        "Rosenbrock 3(2)",
        "Third order with an error estimate, for stiff laws such as strong friction; slower for all others",
    ),
    "constant": ("Constant", "Every step has the same size"),
    "doubling": ("Step Doubling", "Halve or double the step by comparing one step with two halves"),
    "embedded": ("Embedded", "Every step follows the integrator's own error estimate"),
    "both": ("Hits and Bounds", "Skip rays that hit an object or left the bounding sphere"),
    "hits": ("Hits", "Skip rays that hit an object"),
    "bounds": ("Bounds", "Skip rays that left the bounding sphere"),
    "off": ("Off", "Skip no ray: slowest, for comparison"),
    "environment": ("Environment", "Pixels of rays that failed show the environment"),
    "marker": ("Marker", "Pixels of rays that failed show a marker colour"),
}


def number(name: str) -> int:
    """What a .blend stores of a choice. It depends on the name alone, so that a new choice moves no other one."""
    return zlib.crc32(name.encode()) & 0x7FFFFFFF


def items(choices: tuple[str, ...]) -> list[tuple[str, str, str, int]]:
    """The items of an EnumProperty. A choice that has no text yet is shown by its name."""
    return [(name, *TEXTS.get(name, (name.replace("_", " ").title(), "")), number(name)) for name in choices]


MODEL_ITEMS = [(name, model.label, model.description, number(name)) for name, model in MODELS.items()]
OBSERVER_ITEMS = items(OBSERVERS)
PIPELINE_ITEMS = items(PIPELINES)
INTEGRATOR_ITEMS = items(INTEGRATORS)
STEP_CONTROL_ITEMS = items(STEP_CONTROLS)
EARLY_TERMINATION_ITEMS = items(EARLY_TERMINATIONS)
FAILED_RAYS_ITEMS = items(FAILED_RAYS)
RAY_BITS_ITEMS = [
    ("32", "32 Bit", "Rays are stored in single precision", 0),
    ("16", "16 Bit", "Rays are stored in half precision: visibly wrong, to show the paper's finding", 1),
]
PASS_TIPS = {
    "Depth": "Where along the ray the hit is: number of the segment plus the fraction of it",
    "Position": "Hit point in world space, metres",
    "Normal": "Unit surface normal in world space",
    "Object Index": "Pass index of the object that was hit",
    "Direction": "Unit direction of the ray where it ended, for the sky infinitely far away, world space",
    "Status": "How the ray ended, as a number: "
    + ", ".join(f"{status.value} {status.name.lower().replace('_', ' ')}" for status in Status if status),
    "Steps": "Number of integration steps that the ray took",
    "Error": "Error of the ray by the step control's own estimate, radians",
    "Drift": "Largest change of what the model conserves along the ray, as a part of the largest conserved number",
    "Frequency Shift": "Frequency of the light that the observer sees, as a multiple of the emitted; 0 for no light",
}

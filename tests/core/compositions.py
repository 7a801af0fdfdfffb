"""Every program that this project can compose, without a device: what its scenes, models and settings may ask for."""

import itertools
from collections.abc import Iterator
from dataclasses import replace
from functools import cache

import numpy as np

from addon.core.compose import Choice
from addon.core.models import MODELS, Model
from addon.core.pipelines.fused import FusedPipeline
from addon.core.pipelines.paper import PaperPipeline
from addon.core.pipelines.tile import Request
from addon.core.scene import Camera, Environment, Image, Light, Material, Scene, Spheres, Triangles
from addon.core.settings import EARLY_TERMINATIONS, INTEGRATORS, WITH_ERROR_ESTIMATE, Settings
from addon.core.textures import Packed
from addon.core.trace import OUTPUTS, camera_uniforms, make_request, pack_for, suits

VIEW = Camera(np.eye(4), (-1.0, 1.0, -1.0, 1.0), 4, 4)
TRIANGLE = Triangles(
    np.eye(3)[None],
    np.eye(3, dtype=np.float32)[None],
    np.zeros((1, 3, 2), np.float32),
    np.zeros(1, np.int32),
    np.ones(1, np.int32),
)
SPHERE = Spheres(np.zeros((1, 3)), np.ones(1), np.eye(3)[None], np.zeros(1, np.int32), np.ones(1, np.int32))
OBJECTS = {
    "nothing": {},
    "triangles": {"triangles": TRIANGLE},
    "spheres": {"spheres": SPHERE},
    "both": {"triangles": TRIANGLE, "spheres": SPHERE},
}
PICTURE = {"materials": (Material(base_image=0),), "images": (Image("picture", np.ones((2, 2, 4), np.float32)),)}
IMAGES = {"plain": {"materials": (Material(),)}, "pictures": PICTURE}
LIGHTS = {"dark": {}, "lit": {"lights": (Light("SUN", (1.0, 1.0, 1.0)),)}}
SKIES = {"color": Environment(), "cube": Environment(faces=np.ones((6, 2, 2, 3), np.float32))}
FAR_SKIES = {"one sky": None} | SKIES
CAMERAS = ("PERSPECTIVE", "ORTHOGRAPHIC")
PICTURES = (  # what a frame's passes ask for
    {"color"},
    set(OUTPUTS.values()) - {"color"},
    set(OUTPUTS.values()),
    {"color", "surface"},
    {"color", "steps"},
)
RAYS = ({"steps", "drift"}, {"steps", "drift", "error", "rejected"})  # what trace_rays() asks for
MORE = {  # what a model has beside its options
    "refraction": {"grid": np.ones((3, 3, 3), np.float32)},
    "radial_potential": {"centres": np.zeros((2, 3))},
}
FORMULAS = {  # beside the default ones
    "refraction": ("1 + step(1, r)", "1.2 + 0.1*floor(x)*sign(y)", "sqrt(2 - min(r, 1)^2)", "1 + exp(-r)*atan(y)"),
    "radial_potential": ("exp(-r)^1.5", "tanh(r) + asin(1/(1 + r))"),
}


@cache
def models() -> dict[str, Model]:
    """Every model with every choice of its options, formulas and arrays."""
    found = {}
    for name, model in MODELS.items():
        keys = [option.name for option in model.options]
        for chosen in itertools.product(*([key for key, *_ in option.choices] for option in model.options)):
            values = dict(zip(keys, chosen, strict=True))
            more = [{}, MORE[name]] if name == "radial_potential" else [MORE.get(name, {})]
            if "expression" in chosen:
                more = [extra | {"formula": text} for extra in more for text in FORMULAS[name]] + more
            for number, extra in enumerate(more):
                found["-".join((name, *chosen, *([str(number)] if number else [])))] = model(**values, **extra)
    return found


def methods(model: Model) -> Iterator[tuple[str, str]]:
    """Integrators and step controls that the model's rays can take."""
    for integrator in INTEGRATORS:
        if suits(integrator, model):
            for control in ("constant", "doubling", *(["embedded"] if integrator in WITH_ERROR_ESTIMATE else [])):
                yield integrator, control


ONE_RAY = np.array([[0.0, -20.0, 1.0]]), np.array([[0.0, 1.0, 0.0]])
PARTS = tuple(itertools.product(OBJECTS, IMAGES, LIGHTS, SKIES, FAR_SKIES, (False, True), (1, 4)))


@cache
def packed_scene(curved: bool, objects: str, images: str, lights: str, pipeline: str, filters: bool) -> Packed:
    model = MODELS["schwarzschild" if curved else "straight"]()
    scene = Scene(VIEW, model, **OBJECTS[objects], **IMAGES[images], **LIGHTS[lights])
    return pack_for(scene, Settings(pipeline=pipeline, filter_textures=filters))


def request_for(model: Model, pipeline: str, parts: tuple, outputs, kind="PERSPECTIVE", **chosen) -> Request:
    """What a frame with these parts, one of PARTS, asks of its pipeline. chosen : settings"""
    objects, images, lights, sky, far_sky, filters, edge_samples = parts
    scene = Scene(
        replace(VIEW, kind=kind),
        model,
        environment=SKIES[sky],
        far_environment=FAR_SKIES[far_sky],
        **OBJECTS[objects],
        **IMAGES[images],
        **LIGHTS[lights],
    )
    more = {"filter_textures": filters, "edge_samples": edge_samples} if pipeline == "fused" else {}
    settings = Settings(pipeline=pipeline, **(more | chosen))
    packed = packed_scene(model.curved, objects, images, lights, pipeline, filters)
    given = {"rays": ONE_RAY} if "rejected" in outputs or outputs == RAYS[0] else {}
    return make_request(scene, settings, packed, camera_uniforms(scene), frozenset(outputs), 10.0, **given)


def programs(request: Request) -> list[Choice]:
    """Every program that its pipeline may draw with."""
    settings = request.settings
    if settings.pipeline == "fused":
        fused = object.__new__(FusedPipeline)
        fused.request, fused.settings = request, settings
        first = fused._choose_program()
        if request.straight:
            return [first]
        files = tuple(request.model.of_long_rays.get(file, file) for file in first.files)
        return [first, replace(first, files=files, flags=first.flags | {"RESUMED", "QUAD_LIST"})]
    paper = object.__new__(PaperPipeline)
    paper.request, paper.settings, paper.doubling = request, settings, settings.step_control == "doubling"
    paper._choose_programs()
    return paper.choices()


def covering(pipeline: str) -> set[Choice]:
    """Programs of every model with every method, and with every value of all else in turn, but not of all products."""
    found, turn = set(), itertools.count()
    for model in models().values():
        parts = [each for each in PARTS if each[4] == "one sky" or model.has_far_side]
        for integrator, control in methods(model):
            i = next(turn)
            observer = model.observers[i % len(model.observers)]
            chosen = {"integrator": integrator, "step_control": control, "observer": observer}
            chosen["early_termination"] = EARLY_TERMINATIONS[i % len(EARLY_TERMINATIONS)]
            outputs, kind = PICTURES[i % len(PICTURES)], CAMERAS[i % len(CAMERAS)]
            # A stride without a common divisor with how many there are: all have their turn.
            several = programs(request_for(model, pipeline, parts[37 * i % len(parts)], outputs, kind, **chosen))
            found |= set(several if pipeline == "paper" else several[i % len(several) :][:1])
        for outputs in RAYS:
            found |= set(programs(request_for(model, pipeline, parts[0], outputs)))
    return found

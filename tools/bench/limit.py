"""The arithmetic rate of the integration loop, beside that of a bare multiply-add shader on the same device.

What is counted are the operations of the equation and of the integrator, as the formulas have them: a sum, a product,
a quotient and a root are one each. What controls the step, and asks whether the ray has ended, is not: the loop spends
time on it, and so the share that is reached is below one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction

import numpy as np

from addon.core import device as gpu
from addon.core.compose import SHADERS, Source
from addon.core.nystrom import NYSTROM_METHODS, Nystrom
from addon.core.settings import Settings
from addon.core.tableaus import TABLEAUS, Tableau
from addon.core.trace import render

from . import scenes, tried
from .measure import KeptFrame, interleaved, wall_job
from .mode import Mode
from .report import Part, Table, Target
from .scaling import PIXELS, within_pixels

COMPONENTS = 6  # of a ray's state (x, v)
# Schwarzschild, shaders/models/schwarzschild.glsl. What all positions of a ray share: x cross v 6 products, 3
# differences; h.h 3 products, 2 sums; -3 M times that 2 products. And of each: x.x 3 products, 2 sums; the root; r^5, 2
# products; the quotient; that times x, 3.
CONSERVED = 9 + 5 + 2
POSITION = 5 + 1 + 2 + 1 + 3
SCHWARZSCHILD = CONSERVED + POSITION
LEAST_SHARE = 0.6

SIZE = (256, 256)  # pixels of the multiply-add shader
MULTIPLY_ADDS = 12_000  # of each pixel, about
UNROLLED = 16  # multiply-adds of each chain in a round of the loop
CHAINS = (2, 4, 8, 12, 16, 24)  # the fewer, the more they wait; the more, the fewer registers are left


def step_operations(tableau: Tableau, rhs: int, adaptive: bool) -> int:
    """Of one step whose first derivative is at hand: the evaluations of the right-hand side, rhs operations each, and
    the sums s + (h a1 k1 + h a2 k2 + …) between them.  adaptive : also the error estimate h e1 k1 + …
    """
    rows = list(tableau.a[1:])
    if not tableau.first_same_as_last:
        rows.append(tableau.b)
    total = len(rows) * rhs + sum(combination(row, COMPONENTS) + COMPONENTS for row in rows)
    if adaptive:
        off = [b - e for b, e in zip(tableau.b, tableau.embedded, strict=True)]
        total += combination(off, COMPONENTS)
    return total


def nystrom_operations(method: Nystrom) -> int:
    """The same of Nystrom's method with its estimate; its stages are positions, s.x + (c h v + h^2 a1 k1 + …)."""
    stages = len(method.a) - 1
    total = CONSERVED + 1 + stages * POSITION  # 1: h^2
    total += sum(combination((time, *row), 3) + 3 for time, row in zip(method.c[1:], method.a[1:], strict=True))
    off = [b - e for b, e in zip(method.d, method.embedded, strict=True)]
    return total + combination(method.d, 3) + 3 + combination(off, 3)


def combination(weights: Sequence[Fraction], components: int) -> int:
    """Of a sum of weighted vectors: the weights times h, these times the vectors, the sums. Those of 0 are left out."""
    used = sum(weight != 0 for weight in weights)
    return used + components * (2 * used - 1)


def multiply_add_text(chains: int) -> str:
    """A fragment shader whose loop holds nothing but multiply-adds, of `chains` floats that wait for themselves only.

    The factors are literals, as a tableau's are: llvmpipe reads a uniform anew in every round.
    """
    names = [f"a{i}" for i in range(chains)]
    begin = "\n".join(f"    float {name} = 1e-3 * gl_FragCoord.x + {i}.0;" for i, name in enumerate(names))
    once = " ".join(f"{name} = {name} * 0.999 + 0.001;" for name in names)
    body = "\n".join([f"        {once}"] * UNROLLED)
    return (
        f"#version 330 core\nuniform int u_rounds;\nout vec4 out_sum;\nvoid main() {{\n{begin}\n"
        f"    for (int i = 0; i < u_rounds; ++i) {{\n{body}\n    }}\n    out_sum = vec4({' + '.join(names)});\n}}\n"
    )


def multiply_add_operations(chains: int) -> int:
    """Of the whole picture."""
    return 2 * chains * UNROLLED * rounds(chains) * SIZE[0] * SIZE[1]


def rounds(chains: int) -> int:
    """Of the loop: as many as make all pictures take the same number of operations, about."""
    return MULTIPLY_ADDS // (chains * UNROLLED)


class MultiplyAdd:
    """The bare shader, compiled; draw() waits until it is done."""

    def __init__(self, device: gpu.Device, chains: int):
        source = Source(multiply_add_text(chains), ("multiply-add",), ("out_sum",))
        quad = gpu.VERTEX_VERSION + (SHADERS / "passes" / "quad.vert").read_text(encoding="utf-8")
        self.device, self.rounds = device, rounds(chains)
        self.program = gpu.Program(device.ctx, source, quad)
        self.target = device.target({"sum": device.texture(SIZE)})

    def draw(self) -> None:
        self.target.begin(SIZE)
        self.program.draw(self.target, {}, {"u_rounds": self.rounds, "u_quad_depth": 0.5})
        self.device.finish()


def measure(mode: Mode) -> Part:
    shaders = gpu.run(lambda device: {chains: MultiplyAdd(device, chains) for chains in CHAINS})
    bare = {f"{chains}": wall_job(lambda one=one: gpu.run(lambda _: one.draw())) for chains, one in shaders.items()}
    loops = {label: (one, steps_of(one)) for label, one in loop_settings(mode).items()}
    scene = scenes.sky_scene(scenes.HOLE, mode.scaling_size)
    jobs = bare | {label: KeptFrame(scene, one) for label, (one, _) in loops.items()}
    timings = interleaved(jobs, mode.repeats)
    rates = {name: multiply_add_operations(int(name)) / timings[name].best("frame") / 1e6 for name in bare}
    peak = max(rates.values())
    rows = [(f"multiply-add, {chains} chains", rate, rate / peak, None, None, None) for chains, rate in rates.items()]
    figures: dict[str, object] = {"multiply-add, Gflop/s": rates}
    shares = {}
    pixels = mode.scaling_size[0] * mode.scaling_size[1]
    for label, (one, steps) in loops.items():
        adaptive = one.step_control == "embedded"
        operations = (
            nystrom_operations(NYSTROM_METHODS[one.integrator])
            if one.integrator in NYSTROM_METHODS
            else step_operations(TABLEAUS[one.integrator], SCHWARZSCHILD, adaptive)
        )
        trace = timings[label].best("trace")
        rate = pixels * steps * operations / trace / 1e6
        shares[label] = rate / peak
        rows.append((label, rate, rate / peak, operations, steps, 1e6 * trace / (pixels * steps)))
        figures[label] = {"Gflop/s": rate, "share": rate / peak, "operations a step": operations, "steps a ray": steps}
    columns, lines = mode.scaling_size
    title = f"Against the limit: arithmetic; frames of the sky behind a hole, {columns} x {lines}"
    table = Table(title, ("", "Gflop/s", "share", "operations a step", "steps a ray", "ns a ray and step"), rows)
    target = Target(
        "Limit: integration loop, share of the multiply-add rate", shares[ADAPTIVE], LEAST_SHARE, True, tried.LOOP
    )
    return Part([table], figures, [target])


ADAPTIVE = "Nystrom, adaptive"
CONSTANT_STEPS = 100


def loop_settings(mode: Mode) -> dict[str, Settings]:
    """The loop as it runs, with each of the two methods, and two without step control, all of whose rays take the same
    number of steps.
    """
    adaptive, _ = within_pixels(mode.scaling_size, mode.rays, PIXELS, "nystrom_64")
    steady = replace(
        adaptive,
        integrator="dormand_prince_54",
        step_control="constant",
        step=1e-3,
        max_steps=CONSTANT_STEPS,
        escape_radius=scenes.BOUNDS,
    )
    return {
        ADAPTIVE: adaptive,
        "Dormand-Prince, adaptive": within_pixels(mode.scaling_size, mode.rays, PIXELS, "dormand_prince_54")[0],
        "Dormand-Prince, constant steps": steady,
        "Runge-Kutta 4, constant steps": replace(steady, integrator="runge_kutta_4"),
    }


def steps_of(settings: Settings) -> float:
    """Mean number of steps of a ray in the picture, those that are repeated counted."""
    scene = scenes.sky_scene(scenes.HOLE, (200, 150))
    return float(np.mean(render(scene, replace(settings, passes=("Steps",))).passes["Steps"]))

"""n(x, y, z, r, t) as the user types it, with the gradient that follows from the formula by differentiation."""

from __future__ import annotations

import numpy as np

from ..expressions import GLSL_FILE, Expression, ExpressionError, named, number, parse, simplified
from .base import ParameterError
from .borders import JUMP, LEAVING, Borders
from .media import Medium

NAMES = ("x", "y", "z", "r", "t")
LARGEST_INDEX = 1e18  # its square is a float32


class Typed(Medium):
    """n of the position x, y, z, the distance r from the centre (model lengths) and t, the parameter `time`."""

    key = "expression"
    label = "Formula"
    description = "An index n that you type, as a formula in x, y, z, r and the time t"
    parameters = ("time", "grain")
    straight_far_out = False

    def prepare(self) -> None:
        try:
            self.index = parse(self.model.formula, NAMES)
            self.slopes = {name: self.index.derivative(name) for name in "xyzr"}
        except ExpressionError as error:
            raise ParameterError(f"Model 'refraction': formula for n, {error}") from None

    def _values(self, x: np.ndarray) -> dict[str, np.ndarray]:
        r = np.linalg.norm(x, axis=1)
        return {"x": x[:, 0], "y": x[:, 1], "z": x[:, 2], "r": r, "t": np.full(len(x), self.model.time)}

    def field(self, x):
        values = self._values(x)
        n = self.index.numpy(values)
        slopes = {name: slope.numpy(values) for name, slope in self.slopes.items()}
        outward = x / np.maximum(values["r"], 1e-30)[:, None]
        gradient = np.stack([slopes[axis] for axis in "xyz"], axis=1) + slopes["r"][:, None] * outward
        return n[:, None] * gradient, n**2

    def dark(self, x):
        n = self.index.numpy(self._values(x))
        return ~((n > 0.0) & (n < LARGEST_INDEX))

    def clear_distances(self, x):
        """The user says how fine the formula is."""
        return np.full(len(x), self.model.grain)

    def default_step(self) -> float:
        return 0.5 * self.model.grain

    def flat_radius(self) -> float:
        return 100.0 * self.model.grain

    def files(self):
        return (*super().files(), GLSL_FILE)

    @property
    def borders(self) -> Borders:
        """Where the formula jumps, which only its parts step, sign and floor do; and where rays leave it."""
        return JUMP if self.index.jumps() else LEAVING

    def generated(self) -> tuple[tuple[str, str], ...]:
        """typed_index(): the gradient of n, and n. Where the formula jumps, each of its jumps has the value that is
        held of it, and the functions of a law with borders are printed, too.
        """
        held: dict[Expression, Expression] = {}
        holds, gaps = [], []
        for jump in self.index.jumps():
            jump_held = Expression(jump.head, tuple(part.with_parts(held) for part in jump.arguments))
            name = f"held_{len(held)}"
            holds.append(f"    {name} = {jump_held.glsl(RENAMED)};")
            gaps += _gaps(jump_held, name)
            held[jump] = named(name)
        index = self.index.with_parts(held)
        text = f"""// Provides the index that the user typed. Printed by addon/core/models/typed_index.py.
{"".join(f"{chr(10)}float {name.name} = 0.0;" for name in held.values())}
vec4 typed_index(vec3 p, float t) {{
    float r = length(p);
    vec3 outward = p / max(r, 1e-30);
    return vec4({_gradient(index)}, {index.glsl(RENAMED)});
}}
"""
        return (("media/typed_index", text + (_borders(holds, gaps) if held else "")),)


RENAMED = {"x": "p.x", "y": "p.y", "z": "p.z"}


def _gradient(expression: Expression) -> str:
    """GLSL, a vec3."""
    slope = {name: expression.derivative(name).glsl(RENAMED) for name in "xyzr"}
    return f"vec3({slope['x']}, {slope['y']}, {slope['z']}) + {slope['r']} * outward"


def _gaps(jump: Expression, held: str) -> list[tuple[str, Expression]]:
    """What a jump is positive by as long as it has the value that is held of it, as (sign, expression).

    jump : its own arguments may hold others;  held : the name of its value
    """
    first, last = jump.arguments[0], jump.arguments[-1]
    if jump.head == "floor":
        low = simplified("-", first, named(held))
        return [("1.0", low), ("1.0", simplified("-", number(1.0), low))]
    if jump.head == "sign":
        return [(f"({held} >= 0.0 ? 1.0 : -1.0)", first)]
    return [(f"({held} > 0.5 ? 1.0 : -1.0)", simplified("-", last, first))]


def _borders(holds: list[str], gaps: list[tuple[str, Expression]]) -> str:
    """hold() and border() of shaders/borders: the nearest jump, or the bounding sphere, as a distance."""
    tests = "".join(
        f"    nearest = nearer_jump(nearest, {sign} * vec4({_gradient(gap)}, {gap.glsl(RENAMED)}));\n"
        for sign, gap in gaps
    )
    return f"""
void hold(vec3 p) {{
    float r = length(p);
    float t = u_time;
{chr(10).join(holds)}
}}

// The one that is nearer, as a distance from where it jumps. a : a distance;  b : gradient and value
vec4 nearer_jump(vec4 a, vec4 b) {{
    b /= max(length(b.xyz), 1e-30);
    return b.w < a.w ? b : a;
}}

vec4 bounds(vec3 x);

vec4 border(vec3 p) {{
    float r = length(p);
    float t = u_time;
    vec3 outward = p / max(r, 1e-30);
    vec4 nearest = bounds(p);
{tests}    return nearest;
}}

// A long step is looked at in its middle, too.
vec3 border_heart(vec3 p) {{
    return p;
}}

bool settles() {{
    return true;
}}
"""

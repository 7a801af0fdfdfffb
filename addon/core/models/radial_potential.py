"""Motion in a potential field: Section 5.2 of the paper. Several centres c add up.

    f = − Σ (x − c)/r · ξ(r),   r = |x − c|

    yukawa       V = ζ e^(−μr)/r, f = −∇V:   ξ = −ζ (1 + μr) e^(−μr)/r²
    coulomb      ξ = k/r², attractive for k > 0
    cubic        ξ = strength · (2r³/R³ − 3r²/R² + 1) for r ≤ R, 0 outside (Gröller 1995; Figure 4 (c))
    expression   ξ typed by the user; it fades to 0 towards 1000 model lengths

Nothing is softened: where ξ may be singular (all but cubic), a ray that comes within `core_radius` of a centre is
absorbed.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..expressions import GLSL_FILE, ExpressionError, parse
from ..textures import folded
from .base import Model, ParameterError
from .borders import RIM, SWALLOWING, Borders
from .parameter import Option, Parameter, Text
from .reach import within_reach

MOST_CENTRES = 4096
FORMULA_NAMES = ("r", "k", "R", "mu", "zeta", "strength")
FARTHEST = 1000.0  # model lengths: no flat radius is larger
FLAT = 1e-6  # of r ξ, which bounds what a ray is still turned by, radians


class RadialPotential(Model):
    """centres : (n, 3), model space; None is one centre at the origin."""

    name = "radial_potential"
    label = "Radial Potential"
    description = "Light pulled or pushed by centres: Yukawa, Coulomb and Newton, a smooth ball, or a formula"
    menu_order = 30
    parameters = (
        Parameter("k", 1.0, "model lengths", "Coulomb: strength of k/r²; positive attracts", -1e6, 1e6, -5.0, 5.0),
        Parameter(
            "zeta", -1.0, "model lengths", "Yukawa: ζ of V = ζ exp(−μr)/r; negative attracts", -1e6, 1e6, -5.0, 5.0
        ),
        Parameter("mu", 0.5, "1 / model lengths", "Yukawa: μ, one over the range; 0 is Coulomb", 0.0, 1e6, 0.0, 5.0),
        Parameter("R", 5.0, "model lengths", "Cubic: radius outside of which there is no force", 1e-6, 1e6, 0.1, 50.0),
        Parameter(
            "strength", 0.1, "1 / model lengths", "Cubic: the force at the centre; positive attracts", -1e6, 1e6, -1, 1
        ),
        Parameter(
            "core_radius",
            1e-3,
            "model lengths",
            "Rays nearer to a centre are absorbed, since the force is infinite there (not for Cubic)",
            1e-6,
            1e6,
            1e-4,
            1.0,
        ),
    )
    options = (
        Option(
            "xi",
            "Force",
            "How the force depends on the distance r from a centre",
            (
                ("cubic", "Cubic", "A smooth ball of radius R (Gröller 1995; Figure 4 c of the paper)"),
                ("coulomb", "Coulomb", "k/r²: electric charges, and Newton's gravitation"),
                ("yukawa", "Yukawa", "The potential ζ exp(−μr)/r of particles with mass"),
                ("expression", "Expression", "Typed below"),
            ),
            "cubic",
        ),
    )
    texts = (
        Text(
            "formula",
            "Formula",
            "Expression: the force ξ towards a centre, in r, k, R, mu, zeta and strength; positive attracts",
            "k * exp(-mu * r) / r^2",
        ),
    )
    extras = ("centres",)
    observers = ("chart",)

    @classmethod
    def unused(cls, chosen: Mapping[str, str]) -> frozenset[str]:
        used = {"cubic": {"strength", "R"}, "coulomb": {"k", "core_radius"}, "yukawa": {"zeta", "mu", "core_radius"}}
        names = frozenset(entry.name for entry in (*cls.parameters, *cls.texts))
        return names - used.get(chosen["xi"], names)

    def prepare(self) -> None:
        if self.xi == "expression":
            try:
                self._xi = parse(self.formula, FORMULA_NAMES)
            except ExpressionError as error:
                raise ParameterError(f"Model '{self.name}': 'formula', {error}") from None
        centres = np.zeros((1, 3)) if self.centres is None else np.asarray(self.centres, np.float64)
        if centres.ndim != 2 or centres.shape[1] != 3 or not 1 <= len(centres) <= MOST_CENTRES:
            raise ParameterError(
                f"Model '{self.name}': 'centres' has the shape {centres.shape}, but needs (n, 3) with n in "
                f"[1, {MOST_CENTRES}]. Choose other objects as centres."
            )
        if not (np.abs(centres) < 1e18).all():
            raise ParameterError(f"Model '{self.name}': 'centres' are not all numbers. Move them nearer.")
        self.values["centres"] = centres

    def force(self, r: np.ndarray) -> np.ndarray:
        """ξ(r), the force towards a centre. r : float64, model lengths -> float64, the same shape."""
        if self.xi == "expression":
            typed = self._xi.numpy({name: r if name == "r" else self.values[name] for name in FORMULA_NAMES})
            return within_reach(r, FARTHEST) * typed
        with np.errstate(divide="ignore", invalid="ignore"):
            if self.xi == "coulomb":
                return self.k / r**2
            if self.xi == "yukawa":
                return -self.zeta * (1.0 + self.mu * r) * np.exp(-self.mu * r) / r**2
        inside = 2.0 * r**3 / self.R**3 - 3.0 * r**2 / self.R**2 + 1.0
        return self.strength * np.where(r <= self.R, inside, 0.0)

    def rhs(self, states: np.ndarray) -> np.ndarray:
        x, v = states[:, None, :3], states[:, 3:]
        outward = x - self.centres
        r = np.linalg.norm(outward, axis=2, keepdims=True)
        with np.errstate(divide="ignore", invalid="ignore"):
            pull = np.where(r > 0.0, outward / r * self.force(r), 0.0)
        return np.concatenate([v, -pull.sum(axis=1)], axis=1)

    def nearest(self, states: np.ndarray) -> np.ndarray:
        """float64, (n, 6) -> (n,): how far the nearest centre is, model lengths."""
        return np.linalg.norm(states[:, None, :3] - self.centres, axis=2).min(axis=1)

    def absorbed(self, states: np.ndarray) -> np.ndarray:
        if self.xi == "cubic":
            return super().absorbed(states)
        return self.nearest(states) < self.core_radius

    def clear_distances(self, states: np.ndarray) -> np.ndarray:
        r = self.nearest(states)
        return np.maximum(r - self.R, 0.0) + 0.25 * self.R if self.xi == "cubic" else 0.25 * r

    def borders(self) -> Borders:
        return RIM if self.xi == "cubic" else SWALLOWING

    def far_files(self) -> tuple[str, ...]:
        return ("far/coulomb",) if self.xi == "coulomb" else super().far_files()

    def force_of_position(self) -> bool:
        return True

    def default_step(self) -> float:
        """A part of the length at which a ray is turned by much."""
        size = {"cubic": self.R, "coulomb": abs(self.k), "yukawa": abs(self.zeta), "expression": 1.0}[self.xi]
        return 0.02 * min(max(size, 0.1), 100.0)

    def flat_radius(self) -> float:
        return self._flat_radius(FARTHEST)

    def _flat_radius(self, farthest: float) -> float:
        radii = np.geomspace(1e-3, farthest, 601)
        flat = len(self.centres) * np.abs(self.force(radii)) * radii < FLAT  # false for NaN, too
        bent = np.append(np.flatnonzero(~flat), -1)[:-1]
        reach = radii[min(bent[-1] + 1, len(radii) - 1)] if len(bent) else 0.0
        return float(np.linalg.norm(self.centres, axis=1).max() + reach)

    def escape_radius(self, reach: float) -> float:
        """Coulomb's force falls so slowly that it has to begin at the camera: a ray that went straight until FARTHEST
        would be faster there by k / FARTHEST than one from far out.
        """
        flat = self.flat_radius()
        if self.xi == "yukawa" and reach:  # of a long range, or, for mu = 0, Coulomb's
            return self._flat_radius(abs(self.zeta) / FLAT + FARTHEST)
        if self.xi != "coulomb":
            return flat
        return max(flat, min(1.1 * reach, len(self.centres) * abs(self.k) / FLAT))

    def observer_problem(self, observer: str, positions: np.ndarray) -> str | None:
        x = np.asarray(positions, np.float64).reshape(-1, 3)
        r = min(float(np.linalg.norm(x - centre, axis=1).min()) for centre in self.centres)
        if self.xi != "cubic" and r < self.core_radius:
            return (
                f"The camera is {r:g} model lengths from a centre, within its core of {self.core_radius:g}, where "
                "light is absorbed. Move the camera or lower Core Radius."
            )
        return None

    def shader_files(self) -> tuple[str, ...]:
        kind = f"models/radial_{self.xi}"
        formulas = (GLSL_FILE, "models/reach") if self.xi == "expression" else ()
        ends = "models/radial_rim" if self.xi == "cubic" else "models/radial_core"
        return (*formulas, "models/radial_potential", ends, kind)

    def flags(self) -> frozenset[str]:
        flags = {"FORMULA"} if self.xi == "expression" else set()
        return frozenset(flags) | ({"ONE_CENTRE"} if len(self.centres) == 1 else set())

    def generated(self) -> tuple[tuple[str, str], ...]:
        if self.xi != "expression":
            return ()
        formula = self._xi.glsl(lambda name: name if name == "r" else f"u_{name}")
        body = f"    return within_reach(r, {FARTHEST}) * {formula};"
        return (("the formula", f"// Provides a typed force.\n\nfloat xi(float r) {{\n{body}\n}}\n"),)

    def uniforms(self) -> dict[str, object]:
        middle = self.centres.mean(axis=0)
        return super().uniforms() | {
            "u_centre_count": len(self.centres),
            "u_centre": tuple(self.centres[0]),
            "u_middle": tuple(middle),
            "u_whole_k": len(self.centres) * self.k,
            "u_quadrupole": float(np.sum((self.centres - middle) ** 2, axis=1).max()),
        }

    def textures(self) -> dict[str, np.ndarray]:
        """One centre is a uniform: reading a texel takes longer than the rest of its force."""
        if len(self.centres) == 1:
            return {}
        texels = np.zeros((len(self.centres), 4), np.float32)
        texels[:, :3] = self.centres
        return {"u_centres": folded(texels)}

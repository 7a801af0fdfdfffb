"""The outline of a rotating black hole, seen from infinity: Bardeen 1973.

    ξ(r) = ((r² − a²) − r Δ) / (a (r − 1))        η(r) = r³ (4Δ − r (r − 1)²) / (a² (r − 1)²)        Δ = r² − 2r + a²

are L_z / E and Q / E² of the light that circles at the radius r; a picture shows it at α = −ξ / sin i and
β = √(η + a² cos² i − ξ² cot² i). M = 1.
"""

from __future__ import annotations

import numpy as np


def outline(a: float, inclination: float, phase: np.ndarray) -> np.ndarray:
    """a : in [0, 1];  inclination : of the camera, from the axis
    phase : (n,), angles in the picture, from its right -> radii, (n,), M
    """
    if a == 0.0:
        return np.full(len(phase), np.sqrt(27.0))
    prograde, retrograde = (2.0 * (1.0 + np.cos(2.0 / 3.0 * np.arccos(sign * a))) for sign in (-1, 1))
    r = np.linspace(max(prograde, 1.0 + 1e-7), retrograde, 400_001)
    delta = r * r - 2.0 * r + a * a
    xi = ((r * r - a * a) - r * delta) / (a * (r - 1.0))
    eta = r**3 * (4.0 * delta - r * (r - 1.0) ** 2) / (a * (r - 1.0)) ** 2
    if inclination < 1e-9:
        on_axis = np.argmin(np.abs(xi))
        return np.full(len(phase), np.sqrt(eta[on_axis] + a * a))
    beta_squared = eta + (a * np.cos(inclination)) ** 2 - (xi / np.tan(inclination)) ** 2
    seen = (beta_squared >= 0.0) & (eta >= -1e-9)
    alpha, beta = -xi[seen] / np.sin(inclination), np.sqrt(beta_squared[seen])
    if a == 1.0:  # the straight side: light of many radii r = 1 has ξ = 2
        alpha, beta = np.append(alpha[0], alpha), np.append(0.0, beta)
    around = np.arctan2(beta, alpha)
    order = np.argsort(around)
    folded = np.abs(np.mod(phase + np.pi, 2.0 * np.pi) - np.pi)
    above = np.clip(np.searchsorted(around[order], folded), 1, len(order) - 1)
    p, q = order[above - 1], order[above]
    crossed = alpha[p] * beta[q] - alpha[q] * beta[p]
    return crossed / (np.cos(folded) * (beta[q] - beta[p]) - np.sin(folded) * (alpha[q] - alpha[p]))

// Provides where light at a hole at rest is certain to be absorbed: within the photon sphere, r = 3 M, none that goes inwards
// turns round. A method too coarse for the way from there to the horizon must not let it escape.

bool captured(RayState s) {
    return dot(s.x, s.x) < 9.0 * u_mass * u_mass && dot(s.x, s.v) < 0.0;
}

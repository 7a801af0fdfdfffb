// Provides where light at a hole at rest is certain to be absorbed, in isotropic coordinates: within the photon sphere, r = 3 M,
// which is rho = (1 + sqrt(3) / 2) M, none that goes inwards turns round. A method too coarse for the way from there to the
// horizon must not let it escape.

const float PHOTON_SPHERE = 1.8660254;  // in masses

bool captured(RayState s) {
    float radius = PHOTON_SPHERE * u_mass;
    return dot(s.x, s.x) < radius * radius && dot(s.x, s.v) < 0.0;
}

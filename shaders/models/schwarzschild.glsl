// Provides light around a black hole at rest, paper Section 5.4 and Appendix A, in the force form
//
//     f = -3 M h^2 x / r^5,   h = |x cross v|
//
// whose orbits are those of the null geodesic equation in pseudo-Cartesian Schwarzschild coordinates, tau affine
// (derivation: addon/core/models/schwarzschild.py). State: x in model lengths (G = c = 1), v = dx/dtau, |v| = 1 at the camera.

uniform float u_mass;

RayState initial_state(vec3 x, vec3 d) {
    return RayState(x, d);
}

#ifndef ORBIT
// At x, on the ray that comes through s: h is the same all along it.
vec3 acceleration(vec3 x, RayState s) {
    vec3 h = cross(s.x, s.v);
    float r_squared = dot(x, x);
    float inverse = 1.0 / r_squared;  // r^5 = r / inverse^3 might be too large for float32
    return (-3.0 * u_mass * dot(h, h) * inverse) * (inverse * (inverse * sqrt(r_squared))) * x;
}

RayState rhs(RayState s) {
    return RayState(s.v, acceleration(s.x, s));
}

// Rays end where the horizon is about to be; on that border they are absorbed.
const float HORIZON = 2.0 * (1.0 + 1.0e-5);    // in masses
const float ABSORBING = 2.0 * (1.0 + 2.0e-5);

vec4 border(vec3 x) {
    float r = length(x);
    return vec4(x / max(r, 1e-30), r - HORIZON * u_mass);
}

vec3 border_heart(vec3 x) {
    return vec3(0.0);
}

bool absorbed(RayState s) {
    return dot(s.x, s.x) <= ABSORBING * ABSORBING * u_mass * u_mass;
}

// Half of the radius: a ray that falls in meets the horizon's inside before it is through.
float longest_step(RayState s) {
    if (dot(s.x, s.v) > 0.0 && dot(s.x, s.x) > 16.0 * u_mass * u_mass) return 1.0e30;
    return 0.5 * length(s.x) / max(length(s.v), 1e-30);
}
#endif

vec3 ray_direction(RayState s) {
    return normalize(s.v);
}

// Conserved: E^2 = |v|^2 - 2 M h^2 / r^3 (with E the energy at infinity), and the vector h.
vec4 invariants(RayState s) {
    vec3 h = cross(s.x, s.v);
    float r = length(s.x);
    return vec4(dot(s.v, s.v) - 2.0 * u_mass * dot(h, h) / (r * r * r), h);
}

// An observer at rest measures lengths along r as longer by (1 - 2M/r)^(-1/2) than the chart does.
vec3 static_frame(vec3 x, vec3 direction) {
    vec3 outward = normalize(x);
    float radial = dot(direction, outward);
    float shrink = sqrt(max(1.0 - 2.0 * u_mass / length(x), 0.0));
    return direction + (shrink - 1.0) * radial * outward;
}

// sqrt(-g_tt): the rate of a clock at rest against one at infinity.
float clock_rate(vec3 x) {
    return sqrt(max(1.0 - 2.0 * u_mass / length(x), 0.0));
}

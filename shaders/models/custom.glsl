// Provides light under a force that the user types:
//
//     dx/dtau = v        dv/dtau = typed_force(x, v)      Eq. (1) of the paper; f = 0 beyond reach
//
// in x y z, vx vy vz, r = |x|, t and named parameters; it is printed behind this file. State: x in model lengths,
// v = dx/dtau, |v| = 1 at the camera.

uniform float u_time;   // seconds: t
uniform float u_reach;  // model lengths

vec3 typed_force(vec3 x, vec3 v, float r);

RayState initial_state(vec3 x, vec3 d) {
    return RayState(x, d);
}

// At x with the velocity of s, for a force that may depend on it.
vec3 acceleration(vec3 x, RayState s) {
    float r = length(x);
    return within_reach(r, u_reach) * typed_force(x, s.v, r);
}

RayState rhs(RayState s) {
    return RayState(s.v, acceleration(s.x, s));
}

vec3 ray_direction(RayState s) {
    return unit_or(s.v, vec3(0.0, 0.0, -1.0));
}

bool absorbed(RayState s) {
    return false;
}

// A quarter of the radius, in case that the force is singular at the origin; the floor lets rays through where it is not.
float longest_step(RayState s) {
    return 0.25 * max(length(s.x), 1e-3) / max(length(s.v), 1e-30);
}

// What a typed force conserves is not known.
vec4 invariants(RayState s) {
    return vec4(0.0);
}

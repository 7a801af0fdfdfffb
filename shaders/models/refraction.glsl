// Provides light in a medium with a varying index of refraction n(x), paper Section 5.3: Fermat's principle as Eq. (1),
//
//     f = 1/2 grad(n^2),   |v| = n along the ray
//
// State: x in model lengths, v = dx/dtau = n d with d the unit direction; tau is the integral of ds / n.
// n stands in one file of shaders/media/, which also knows where light ends (absorbed) and how fine n is (longest_step).

vec4 medium(vec3 x);  // half the gradient of n^2, and n^2, with the formula of the held region
void hold(vec3 x);    // the region that x is in, where n has several

RayState initial_state(vec3 x, vec3 d) {
    hold(x);
    return RayState(x, sqrt(max(medium(x).w, 0.0)) * d);
}

vec3 acceleration(vec3 x, RayState s) {
    return medium(x).xyz;
}

vec3 ray_direction(RayState s) {
    return s.v / max(length(s.v), 1e-30);
}

// Conserved: |v|^2 / n^2 = 1 (dtau is ds / n); around a centre also Bouguer's x cross v; in layers also v along them.
vec4 invariants(RayState s) {
    hold(s.x);
    float speed = dot(s.v, s.v) / max(medium(s.x).w, 1e-30);
#ifdef RADIAL
    return vec4(speed, cross(s.x, s.v));
#else
#ifdef LAYERED
    return vec4(speed, s.v.xy, 0.0);
#else
    return vec4(speed, 0.0, 0.0, 0.0);
#endif
#endif
}

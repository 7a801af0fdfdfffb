// Provides light in radial force fields, paper Section 5.2:
//
//     f = - sum over centres c of  (x - c) / r  xi(r),   r = |x - c|
//
// xi, its potential and its scale stand in models/radial_<xi>.glsl, or are printed from a formula. State: x in model
// lengths, v = dx/dtau, |v| = 1 at the camera. What xi ends at stands in models/radial_core.glsl or models/radial_rim.glsl.

uniform float u_k;            // coulomb, model lengths
uniform float u_zeta;         // yukawa, model lengths
uniform float u_mu;           // yukawa, 1 / model lengths
uniform float u_R;            // cubic, model lengths
uniform float u_strength;     // cubic, 1 / model lengths
#ifdef ONE_CENTRE
uniform vec3 u_centre;

vec3 centre(int i) {
    return u_centre;
}

int centre_count() {
    return 1;
}
#else
uniform sampler2D u_centres;  // one texel a centre
uniform int u_centre_count;

vec3 centre(int i) {
    return texel(u_centres, i).xyz;
}

int centre_count() {
    return u_centre_count;
}
#endif

float xi(float r);            // the force towards a centre
float potential(float r);     // its integral: potential' = xi
float longest_way(float r);   // how far a step may go, r away from the nearest centre

vec3 nearest_centre(vec3 x) {
    float least = 1.0e30;
    vec3 found = centre(0);
    for (int i = 0; i < centre_count(); ++i) {
        vec3 away = x - centre(i);
        float squared = dot(away, away);
        if (squared < least) {
            least = squared;
            found = centre(i);
        }
    }
    return found;
}

float nearest(vec3 x) {
    return length(x - nearest_centre(x));
}

RayState initial_state(vec3 x, vec3 d) {
    return RayState(x, d);
}

vec3 acceleration(vec3 x, RayState s) {
    vec3 f = vec3(0.0);
    for (int i = 0; i < centre_count(); ++i) {
        vec3 outward = x - centre(i);
        float r = length(outward);
        if (r > 0.0) f -= xi(r) / r * outward;
    }
    return f;
}

RayState rhs(RayState s) {
    return RayState(s.v, acceleration(s.x, s));
}

vec3 ray_direction(RayState s) {
    return unit_or(s.v, vec3(0.0, 0.0, -1.0));
}

float longest_step(RayState s) {
    return longest_way(nearest(s.x)) / max(length(s.v), 1e-30);
}

// Conserved: the energy |v|^2 / 2 + potential, where the potential is known, and around a single centre (x - c) cross v.
vec4 invariants(RayState s) {
    float energy = 0.0;
#ifndef FORMULA
    energy = 0.5 * dot(s.v, s.v);
    for (int i = 0; i < centre_count(); ++i) energy += potential(length(s.x - centre(i)));
#endif
    return vec4(energy, centre_count() == 1 ? cross(s.x - centre(0), s.v) : vec3(0.0));
}

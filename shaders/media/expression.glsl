// Provides what a typed n(x) needs beside the formula itself, which addon/core/models/refraction.py prints as
// typed_index(): the gradient of n, and n.

vec4 typed_index(vec3 p, float t);

uniform float u_time;
uniform float u_grain;

vec4 medium(vec3 x) {
    vec4 typed = typed_index(x, u_time);
    return vec4(typed.w * typed.xyz, typed.w * typed.w);
}

const float LARGEST_INDEX = 1.0e18;

// A typed n may be anything; there is no light where it is not a positive number.
bool absorbed(RayState s) {
    float n = typed_index(s.x, u_time).w;
    return !finite(n) || n <= 0.0 || n >= LARGEST_INDEX;
}

// The user says how fine the formula is.
float longest_step(RayState s) {
    return u_grain / max(length(s.v), 1e-30);
}

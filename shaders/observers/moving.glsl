// Provides an observer who moves with the velocity beta (in units of that of light) past the one at rest: aberration and
// Doppler's shift of the light that arrives. He looks along n', so the light's wave vector is (1, -n') for him, and its
// Lorentz transform to rest is omega (1, -n):
//
//     omega = gamma (1 - beta.n'),   omega n = n' - gamma beta + gamma^2 / (gamma + 1) (beta.n') beta
//
// so that what lies ahead draws together around beta, and is bluer by 1 / omega.

RayState initial_state(vec3 x, vec3 d);  // the model's
vec3 static_frame(vec3 x, vec3 direction);  // orthonormal frame at rest -> chart

uniform vec3 u_observer_velocity;  // beta, |beta| < 1, model space

float lorentz_factor() {
    return inversesqrt(1.0 - dot(u_observer_velocity, u_observer_velocity));
}

// omega n of a direction of any length; linear in both.
vec3 boosted(vec3 direction, float size) {
    float gamma = lorentz_factor();
    float ahead = dot(u_observer_velocity, direction);
    return direction + (gamma * gamma / (gamma + 1.0) * ahead - gamma * size) * u_observer_velocity;
}

vec3 direction_at_rest(vec3 direction) {
    return normalize(boosted(direction, 1.0));
}

vec3 chart_direction(vec3 x, vec3 direction) {
    return normalize(static_frame(x, direction_at_rest(direction)));
}

vec3 chart_vector(vec3 x, vec3 direction) {
    return static_frame(x, boosted(direction, length(direction)));
}

// |towards + off| - |towards| without the difference of two nearly equal lengths.
vec3 change_at_rest(vec3 towards, vec3 off) {
    float longer = dot(off, 2.0 * towards + off) / (length(towards + off) + length(towards));
    return boosted(off, longer);
}

RayState first_state(vec3 x, vec3 direction) {
    return initial_state(x, chart_direction(x, direction));
}
#ifdef FREQUENCY

float clock_rate(vec3 x);  // of a clock at rest, against one at infinity

float frequency_shift(vec3 x, vec3 direction) {
    float omega = lorentz_factor() * (1.0 - dot(u_observer_velocity, direction));
    return 1.0 / (omega * clock_rate(x));
}
#endif

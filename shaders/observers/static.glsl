// Provides an observer at rest: directions are measured in his orthonormal frame, which the model's metric turns into
// the chart's.

vec3 static_frame(vec3 x, vec3 direction);  // the model's: orthonormal frame at rest -> chart
RayState initial_state(vec3 x, vec3 d);

vec3 chart_direction(vec3 x, vec3 direction) {
    return normalize(static_frame(x, direction));
}

vec3 chart_vector(vec3 x, vec3 direction) {
    return static_frame(x, direction);
}

vec3 change_at_rest(vec3 towards, vec3 off) {
    return off;
}

RayState first_state(vec3 x, vec3 direction) {
    return initial_state(x, chart_direction(x, direction));
}
#ifdef FREQUENCY

float clock_rate(vec3 x);  // of a clock at rest, against one at infinity

float frequency_shift(vec3 x, vec3 direction) {
    return 1.0 / clock_rate(x);
}
#endif

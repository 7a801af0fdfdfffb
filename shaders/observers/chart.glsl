// Provides the paper's camera: its directions are those of the chart. The light is as blue as for an observer at rest.

RayState initial_state(vec3 x, vec3 d);  // the model's

vec3 chart_direction(vec3 x, vec3 direction) {
    return direction;
}

vec3 chart_vector(vec3 x, vec3 direction) {
    return direction;
}

vec3 change_at_rest(vec3 towards, vec3 off) {
    return off;
}

RayState first_state(vec3 x, vec3 direction) {
    return initial_state(x, direction);
}
#ifdef FREQUENCY

float clock_rate(vec3 x);  // of a clock at rest, against one at infinity

float frequency_shift(vec3 x, vec3 direction) {
    return 1.0 / clock_rate(x);
}
#endif

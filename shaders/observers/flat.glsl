// Provides the frame at rest of a model that has none of its own: the chart's, and clocks that all run alike.

vec3 static_frame(vec3 x, vec3 direction) {
    return direction;
}

float clock_rate(vec3 x) {
    return 1.0;
}
